# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the commands say of a clip's first contact."""

from collections.abc import Sequence
from typing import Any


def first_touched(frames: Sequence[tuple[str | int, int, bool]]) -> dict[str, Any] | None:
    """The frame of the first contact for a JSON file, told on the terminal; ``None`` without one.

    Args:
        frames: name, time in ns and whether something touches, in their order.
    """
    from recon.contact.first import IN_A_ROW, first_contact

    index = first_contact(touches for _, _, touches in frames)
    if index is None:
        print(f"First contact: in no {IN_A_ROW} frames in a row.")
        return None
    name, time_ns, _ = frames[index]
    after_s = (time_ns - frames[0][1]) / 1e9
    print(
        f"First contact: frame {name}" + (f", {after_s:.3f} s after the first." if index else ".")
    )
    return {"frame": name, "time_ns": time_ns}
