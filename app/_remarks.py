# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the commands say of frames that are to be doubted: their light, and their depth."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from app._lights import COLORS

if TYPE_CHECKING:
    from recon.arrays import Frame
    from recon.calibration import Calibration

NAMED = 3
"""So many frames are named one by one; of more, the first and how many others."""


def light_remarks(unit: "Calibration", background: "Frame | None", named: str) -> list[str]:
    """A sentence where a light is too far from what it was at the calibration.

    That is where `wedge accept` would no longer give grade A, though what changed all over were
    taken off, as it is off frames.

    Args:
        unit: with which slopes are read.
        background: of today, (h, w, 3) uint8 RGB and of the unit's size; None for the unit's own.
        named: what the background is called.
    """
    from recon.brightness import brightness_change
    from recon.same_light import light_of
    from validation.acceptance.limits import limit_called

    if background is None:
        return []
    limit = limit_called("brightness_change_share")
    before, now = map(unit.unwarp, (unit.background, background))
    changes = brightness_change(before, now / light_of(now - before, before), unit.card.channels)
    parts = [
        f"{share:.0%} in {COLORS[color]}"
        for color, share in changes.items()
        if limit.grade(share) != "A"
    ]
    if not parts:
        return []
    return [
        f"{named} differs in brightness from the unit's own blank frame, by {', '.join(parts)}: "
        "slopes and depth are off by about as much; set the camera as it was at the calibration "
        "(apply the settings file that `wedge tune` wrote before it), or calibrate again."
    ]


def doubt_remarks(doubts: Sequence[tuple[str, str]]) -> list[str]:
    """A sentence for each way in which frames are doubted, in the order of the first.

    Args:
        doubts: names of frames, each with its ``recon.plausible.doubt_word`` or ``cut_word``; where
            that is empty, nothing is said.
    """
    from recon.contact.disturbed import STRANGE
    from recon.plausible import CUT_TWICE, IMPLAUSIBLE

    asked = {
        STRANGE: "are the lights on, and is this the unit's sensor?",
        IMPLAUSIBLE: (
            "is there no reflection on the gel, and is this the unit's sensor, not mirrored, with "
            "red and blue not swapped?"
        ),
        CUT_TWICE: "can one of its ends lie inside the frame?",
    }
    said = []
    for word in dict.fromkeys(word for _, word in doubts if word):
        names = [name for name, found in doubts if found == word]
        which = ", ".join(names)
        if len(names) > NAMED:
            which = f"{names[0]} and {len(names) - 1} more"
        said.append(f"{which}: {word}, so the depth cannot be trusted: {asked[word]}")
    return said
