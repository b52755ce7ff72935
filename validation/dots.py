# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Dots of real gels, counted by eye in enlarged frames, against the dots that are detected.

``hand_counted_dots.csv`` holds places read off a grid of lines laid over the enlarged blank
frames, to a pixel or two. A dot that the frame's edge cuts is listed and neither asked for nor
counted as false.
"""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from recon.arrays import Unwarped
from recon.markers.detection import find_markers
from recon.markers.lattice import Points
from recon.presses import press_reader
from sensor.dataset import read_dataset
from sensor.errors import WedgeError
from validation.datasets import dataset_folder

COUNTS = Path(__file__).with_name("hand_counted_dots.csv")
COUNTED_FRAMES = ("wedge-lab", "marker-balls-a", "marker-balls-b")
SAME_DOT = 0.3
"""Of the spacing: a dot found nearer than this to a counted one is that one."""


@dataclass(frozen=True, kw_only=True)
class DetectionScore:
    """How the dots of one frame were found."""

    whole: int
    """Counted by eye, not cut by the edge."""
    found: int
    """Of those."""
    false: int
    """Detected where none was counted."""
    rms_px: float
    """Between the detected and the hand-set places, mean offset removed: mostly the hand's."""


def hand_counted(name: str) -> tuple[Unwarped, Points, np.ndarray] | None:
    """The blank frame of a dataset, its dots' places and which of them the edge cuts.

    ``None`` where this machine does not have the dataset.
    """
    try:
        blank = press_reader(read_dataset(dataset_folder(name))).blank
    except WedgeError:
        return None
    with COUNTS.open(encoding="utf-8", newline="") as stream:
        lines = (line for line in stream if not line.startswith("#"))
        rows = [row for row in csv.DictReader(lines) if row["dataset"] == name]
    places = np.array([(float(row["x_px"]), float(row["y_px"])) for row in rows])
    return blank, places, np.array([row["cut"] == "1" for row in rows])


def score_detection(blank: Unwarped, places: Points, cut: np.ndarray) -> DetectionScore:
    """Match detected dots to counted ones, one to one."""
    markers = find_markers(blank)
    whole = int((~cut).sum())
    if markers is None:
        return DetectionScore(whole=whole, found=0, false=0, rms_px=np.nan)
    reach = SAME_DOT * markers.spacing_px
    away = cdist(places, markers.position_px)
    counted, detected = linear_sum_assignment(np.minimum(away, 10 * reach))
    same = away[counted, detected] < reach
    counted, detected = counted[same], detected[same]
    offset = markers.position_px[detected] - places[counted]
    return DetectionScore(
        whole=whole,
        found=int((~cut[counted]).sum()),
        false=len(markers) - len(counted),
        rms_px=float(np.sqrt(((offset - offset.mean(0)) ** 2).sum(1).mean())),
    )
