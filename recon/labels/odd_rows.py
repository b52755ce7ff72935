# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Rows of ``labels.csv`` that cannot be right, whoever wrote them."""

from pathlib import Path

from recon.geometry.unwarp import is_within
from recon.images import frame_count, is_one_of
from sensor.dataset import BallLabel, frame_name


def has_frame(folder: Path, file: str) -> bool:
    """Whether the frame that a label names is in its folder.

    Raises:
        WedgeError: it names one of an archive that is damaged.
    """
    name, _, number = frame_name(file).partition("#")
    if not (folder / name).is_file():
        return False
    if "#" not in file:
        return True
    return is_one_of(frame_count(folder / name), number)


def is_outside(label: BallLabel, size_px: tuple[int, int]) -> bool:
    """Whether a circle's centre lies outside the unwarped frame of that size (width, height)."""
    return not is_within(label.center_px, size_px)
