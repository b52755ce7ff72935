# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the commands say of frames whose depth means little."""

from collections.abc import Sequence

NAMED = 3
"""So many frames are named one by one; of more the first, and how many."""


def doubt_remarks(doubts: Sequence[tuple[str, str]]) -> list[str]:
    """A sentence for each way in which frames are doubted, in the order of the first.

    Args:
        doubts: names of frames, each with its ``recon.plausible.doubt_word`` or ``cut_word``; where
            that is empty, nothing is said.
    """
    from recon.plausible import CUT_TWICE, IMPLAUSIBLE, STRANGE

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
