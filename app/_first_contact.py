# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the commands say of a clip's first contact."""

from collections.abc import Sequence
from typing import Any

from app._frames import UnitFrames


def first_touched(
    came: UnitFrames, frames: Sequence[tuple[int, int, bool]]
) -> dict[str, Any] | None:
    """The frame of the first contact for a JSON file, told on the terminal.

    Args:
        came: whence they are. Of frames that have nothing to do with each other nothing is told,
            and seconds only where they bear times.
        frames: number, time in ns and whether something touches, in their order.

    Returns:
        Its number and time; ``None`` without one, and where nothing is told.
    """
    from recon.contact.first import IN_A_ROW, first_contact

    if came.apart:
        return None
    index = first_contact(touches for _, _, touches in frames)
    if index is None:
        print(f"First contact: in no {IN_A_ROW} frames in a row.")
        return None
    number, time_ns, _ = frames[index]
    after_s = (time_ns - frames[0][1]) / 1e9
    after = f", {after_s:.3f} s after the first." if index and came.timed else "."
    print(f"First contact: frame {number}{after}")
    return {"frame": number, "time_ns": time_ns}
