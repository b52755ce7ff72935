# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What to say of pixels that are far from square, or that the pad is no whole number of."""

from math import sqrt

from app._output import command_line
from sensor.dataset import CARD_FILE, LABELS_FILE, Dataset

OBLONG = 1.2
"""Longer over shorter side, from which on it is said: ``default`` and the contact mask count pixels
along both axes alike."""
ROUNDED = 0.005
"""Share by which lengths may be off before it is said: less than a caliper's are."""


def pitch_remarks(dataset: Dataset) -> list[str]:
    """Sentences on the pitch that a card states; none where it suits the frames and the pad."""
    card, size_px = dataset.card, dataset.card.unwarped_size_px
    x, y = card.mm_per_px
    said = []
    if max(x, y) > OBLONG * min(x, y):
        mend = (
            f"resize the frames and correct mm_per_px in {CARD_FILE}"
            if size_px is None
            else f"write one number twice in mm_per_px of {CARD_FILE}"
        )
        said.append(
            f"Pixels of {x:.4g} x {y:.4g} mm are far from square, so that errors of depth and of "
            f"contacts' area grow: {mend}, move {LABELS_FILE} aside, run "
            f"`{command_line('label', dataset.folder)}` and calibrate again. Until then, a pixel "
            f"of a contact_radius_px counts as √({x:.4g} x {y:.4g}) = {sqrt(x * y):.4g} mm."
        )
    if size_px is not None and card.pad_size_mm is not None:
        length, width = card.pad_size_mm
        fit_x, fit_y = length / size_px[0], width / size_px[1]
        off = max(abs(fit_x / x - 1), abs(fit_y / y - 1))
        if off > ROUNDED:
            said.append(
                f"The pad of {length:g} x {width:g} mm is no whole number of pixels of {x:g} x "
                f"{y:g} mm, so lengths are off by up to {100 * off:.1f} %: write mm_per_px = "
                f"[{fit_x:.6g}, {fit_y:.6g}] in {CARD_FILE} and calibrate again."
            )
    return said
