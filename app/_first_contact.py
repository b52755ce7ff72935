# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the commands say of a clip's first contact."""

from collections.abc import Sequence
from typing import Any

from app._frames import UnitFrames


def first_touched(came: UnitFrames, frames: Sequence[tuple[int, int, bool]]) -> dict[str, Any]:
    """What a JSON file says of the first contact, told on the terminal.

    Args:
        came: whence they are. Of frames that have nothing to do with each other nothing is told,
            and seconds only where they bear times.
        frames: number, time in ns and whether something touches, of each whole frame in its order.

    Returns:
        ``first_contact``, its number and time: ``None`` without one, and where nothing is told; and
        ``touched_at_start``, whether something already touches in the first frame, so that when it
        first did is not seen.
    """
    from recon.contact.first_contact import IN_A_ROW, first_contact

    unseen: dict[str, Any] = {"first_contact": None, "touched_at_start": False}
    if came.apart:
        return unseen
    index = first_contact(touches for _, _, touches in frames)
    if index is None:
        print(f"First contact: none that lasts {IN_A_ROW} frames in a row.")
        return unseen
    number, time_ns, _ = frames[index]
    if index == 0:
        print(f"First contact: not seen, as something touches in the first frame, {number}.")
        return unseen | {"touched_at_start": True}
    after_s = (time_ns - frames[0][1]) / 1e9
    after = f", {after_s:.3f} s after the first." if came.timed else "."
    print(f"First contact: frame {number}{after}")
    return unseen | {"first_contact": {"frame": number, "time_ns": time_ns}}
