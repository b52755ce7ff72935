# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Which frame of a clip is the first that shows a contact."""

from collections.abc import Iterable

import numpy as np
from jaxtyping import Bool

from recon.arrays import ContactMask
from recon.contact.disturbed import is_strange

IN_A_ROW = 3
"""Frames that show a contact: a single one may be a flicker."""


def touches(contact: ContactMask, disturbed: Bool[np.ndarray, "_ _"]) -> bool:
    """Whether a frame shows a contact, and not light that went off or another sensor's gel."""
    return bool(contact.any()) and not is_strange(disturbed)


def first_contact(touching: Iterable[bool]) -> int | None:
    """Which frame is the first of three in a row in which something touches.

    Args:
        touching: ``touches`` of each frame in its order.

    Returns:
        Its number from 0; ``None`` where no three do.
    """
    row = 0
    for index, touched in enumerate(touching):
        row = row + 1 if touched else 0
        if row == IN_A_ROW:
            return index - IN_A_ROW + 1
    return None
