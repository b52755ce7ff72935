# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The rendered sets that the repository carries: frames of the twin, labelled by its own truth."""

import shutil
from pathlib import Path

import simulation
from sensor.dataset import CARD_FILE
from sensor.design import Wedge

BALL_RADIUS_MM = 2.4
LICENCE = "CC-BY-4.0"
SOURCE = "rendered by wedge simulate from the design's numbers"
WIDTH_PX = 320


def mm_per_px(design: Wedge) -> tuple[float, float]:
    """Square pixels, as many along the pad as a small camera frame is wide."""
    pitch = design.gel.pad_length_mm / WIDTH_PX
    return pitch, pitch


def find_twin(design: Wedge) -> Path | None:
    """The set of a design, beside the code that rendered it."""
    folder = Path(simulation.__file__).parent / "sets" / design.name
    return folder if (folder / CARD_FILE).is_file() else None


def import_twin(source: Path, folder: Path) -> None:
    """Copy a set: it is a dataset folder already."""
    shutil.copytree(source, folder, dirs_exist_ok=True)
