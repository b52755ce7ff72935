# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Circles that somebody drew with another tool, looked at before they become labels."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from recon.images import read_arrays
from sensor.dataset import BallLabel
from sensor.errors import WedgeError

MOST_PRESSES = 10_000
LARGEST_RADIUS_PX = 1e4


def read_numbers(path: Path, names: Sequence[str]) -> dict[str, np.ndarray]:
    """Arrays of an archive that must be real numbers.

    Raises:
        WedgeError: the archive is damaged, too large or incomplete, or holds something else.
    """
    arrays = read_arrays(path, names)
    for name, array in arrays.items():
        if array.dtype.kind not in "uif":
            raise WedgeError(f"{path}: {name} must be numbers, not {array.dtype}.")
    return arrays


def is_circle(x_px: float, y_px: float, radius_px: float) -> bool:
    """Whether numbers may be a circle in a picture."""
    return bool(np.isfinite([x_px, y_px]).all()) and 0 < radius_px < LARGEST_RADIUS_PX


def drawn_label(
    file: str, circle: Sequence[float], where: Path, ball_radius_mm: float | None = None
) -> BallLabel:
    """The label of one drawn circle.

    Args:
        file: of its frame in the dataset.
        circle: centre x, centre y and radius in pixels.
        where: it was found, for the sentence.
        ball_radius_mm: of this press, where the source says.

    Raises:
        WedgeError: it is no circle.
    """
    x_px, y_px, radius_px = circle
    if not is_circle(x_px, y_px, radius_px):
        raise WedgeError(f"{where}: ({x_px:g}, {y_px:g}), radius {radius_px:g} is not a circle.")
    return BallLabel(
        file=file,
        center_x_px=x_px,
        center_y_px=y_px,
        contact_radius_px=radius_px,
        ball_radius_mm=ball_radius_mm,
    )


def refuse_count(source: Path, presses: int) -> None:
    """Refuse a source without a labelled press, or with more than anybody makes.

    Raises:
        WedgeError: says how many there are.
    """
    if not 0 < presses <= MOST_PRESSES:
        raise WedgeError(
            f"{source} holds {presses} labelled presses: 1 to {MOST_PRESSES} can be imported."
        )
