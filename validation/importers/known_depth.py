# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A GelSlim-like sensor whose frames show the gel plane: 22 presses, 4 of commanded depth.

The published circles (x, y) are good to a few pixels; all are refitted, which brings the error of
a cubic fit of the slopes, judged on other presses, from 0.24 to 0.14 of the mean slope.
"""

import io
import re
from pathlib import Path

import numpy as np

from recon.arrays import DepthMap
from recon.ball import offsets_mm
from recon.images import read_image
from sensor.dataset import BallLabel, DatasetCard
from sensor.errors import WedgeError
from sensor.files import write_atomic
from sensor.toml import Pair
from validation.importers.folder import copy_frames, write_dataset

SOURCE = "github.com/RVSATHU/GelSight-Sim2Real"
LICENCE = "none stated by RVSATHU/GelSight-Sim2Real; for development only, not redistributed"
BACKGROUND = "background_real.png"
BALL_RADIUS_MM = 2.92
MM_PER_PX = (0.059259, 0.059259)
SPHERE_CENTER_PX = (208.0, 166.0)
SPHERE_DEPTHS_MM = (0.25, 0.5, 0.75, 1.0)


def import_known_depth(source: Path, folder: Path) -> None:
    """Write the 22 presses that ``calib_res.txt`` labels.

    Raises:
        WedgeError: a frame is missing or damaged, or no line of the table is readable.
    """
    labels = published_labels(source)
    copy_frames(source, folder, [BACKGROUND, *(label.file for label in labels)])
    write_dataset(folder, _card("known-depth", "calib_*_real.png"), labels, mend_circles=True)


def published_labels(source: Path) -> list[BallLabel]:
    """The circles of ``calib_res.txt``, drawn by hand round the visible discs.

    Raises:
        WedgeError: no line of the table is readable.
    """
    table = source / "calib_res.txt"
    try:
        lines = re.findall(r"(\S+)\s+\((\d+),\s*(\d+)\)\s+(\d+)", table.read_text())
    except (OSError, UnicodeDecodeError) as error:
        raise WedgeError(f"{table} cannot be read: {error}.") from error
    if not lines:
        raise WedgeError(f"{table} holds no line such as: calib_1_real.png (214, 261) 28.")
    return [
        BallLabel(
            file=name,
            center_x_px=float(x),
            center_y_px=float(y),
            contact_radius_px=float(radius),
        )
        for name, x, y, radius in lines
    ]


def import_known_depth_spheres(source: Path, folder: Path) -> None:
    """Write the four presses of commanded depth, with the ball at that depth as the truth.

    The commanded depth is not the gel's: gel sinks beside the ball, so that the shading follows
    the ball only to 0.58-0.68 of the circle where the ball crosses the gel plane. The labels are
    that smaller circle, found by refitting; ``truth/`` is the ball itself where it lies below the
    plane, and zero elsewhere.

    Raises:
        WedgeError: a frame is missing or damaged.
    """
    labels = []
    height, width = read_image(source / BACKGROUND).shape[:2]
    for depth_mm in SPHERE_DEPTHS_MM:
        name = f"sphere_{depth_mm}_real.png"
        labels.append(
            BallLabel(
                file=name,
                center_x_px=SPHERE_CENTER_PX[0],
                center_y_px=SPHERE_CENTER_PX[1],
                # A first guess: Hertz's contact radius on a thick gel, Contact Mechanics, 1985.
                contact_radius_px=float(np.sqrt(BALL_RADIUS_MM * depth_mm)) / MM_PER_PX[0],
            )
        )
        truth = sunk_ball_depth((width, height), SPHERE_CENTER_PX, depth_mm)
        content = io.BytesIO()
        np.save(content, truth.astype(np.float32))
        write_atomic(folder / "truth" / f"{Path(name).stem}.npy", content.getvalue())
    copy_frames(source, folder, [BACKGROUND, *(label.file for label in labels)])
    card = _card("known-depth-spheres", "sphere_*_real.png")
    write_dataset(folder, card, labels, mend_circles=True)


def sunk_ball_depth(size_px: tuple[int, int], center_px: Pair, depth_mm: float) -> DepthMap:
    """How far the ball's surface lies below the gel plane, its lowest point at ``depth_mm``."""
    x_mm, y_mm = offsets_mm(size_px, center_px, MM_PER_PX)
    height = np.sqrt(np.maximum(BALL_RADIUS_MM**2 - x_mm**2 - y_mm**2, 0))
    depth: DepthMap = np.maximum(depth_mm - BALL_RADIUS_MM + height, 0)
    return depth


def _card(name: str, files: str) -> DatasetCard:
    return DatasetCard(
        name=name,
        source=f"{SOURCE}, {files}",
        licence=LICENCE,
        mm_per_px=MM_PER_PX,
        ball_radius_mm=BALL_RADIUS_MM,
        background=(BACKGROUND,),
    )
