# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the commands say of frames that are to be doubted: backgrounds, and depth."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from app._lights import COLORS

if TYPE_CHECKING:
    from recon.arrays import Frame
    from recon.calibration import Calibration

MOST_TOUCHED = 0.4
"""Of the gel. A ball on real and rendered gel changes 0.16 at most; where the light of one side
became dimmer, on eight gels, 0.43 and more."""
NAMED = 3
"""So many frames are named one by one; of more, the first and how many others."""


def background_remarks(unit: "Calibration", background: "Frame | None", named: str) -> list[str]:
    """Sentences where something touches on a background, and where a light is not as it was.

    The latter is where `wedge accept` would no longer give grade A, though what changed all over
    were taken off, as it is off frames.

    Args:
        unit: with which slopes are read.
        background: of today, (h, w, 3) uint8 RGB and of the unit's size; None for the unit's own.
        named: what the background is called.
    """
    import numpy as np

    from recon.brightness import brightness_change, without_dots
    from recon.markers.tracking import marker_tracker
    from recon.pipeline import disturbed_in
    from recon.same_light import light_of
    from validation.acceptance.limits import limit_called

    if background is None:
        return []
    gels = map(unit.unwarp, (unit.background, background))
    before, now = (without_dots(gel, marker_tracker(gel)) for gel in gels)
    now = now / light_of(now - before, before)
    touched = disturbed_in(now - before, unit.estimator)
    said, share = [], float(touched.mean())
    if 0 < share < MOST_TOUCHED:
        now = np.where(touched[..., None], before, now)
        said.append(
            f"{named} differs from the unit's own blank frame on {100 * share:.2g}% of the gel, as "
            "where something touches, and counts as flat there: take one with nothing on the gel; "
            "if it still differs, the gel is marked or has moved."
        )
    limit = limit_called("brightness_change_share")
    changes = brightness_change(before, now, unit.card.channels)
    parts = [
        f"{share:.0%} in {COLORS[color]}"
        for color, share in changes.items()
        if limit.grade(share) != "A"
    ]
    if parts:
        said.append(
            f"{named} differs in brightness from the unit's own blank frame, by "
            f"{', '.join(parts)}: slopes and depth are off by about as much; set the camera as it "
            "was at the calibration (apply the settings file that `wedge tune` wrote before it), "
            "or calibrate again."
        )
    return said


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
