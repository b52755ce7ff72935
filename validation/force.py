# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Clips of gripped objects with the measured force: does a harder grip show?

No ball of known size was pressed on the sensor of the clips, so slopes come from an estimator of
the rendered twin of its design, with each colour's difference scaled by the blank gels' ratio.
Depths show a trend, not a calibrated number; the disturbed area needs no slopes at all.
"""

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64
from scipy.stats import spearmanr

from recon.arrays import Unwarped
from recon.contact.disturbed import disturbed_mask
from recon.estimators import GradientEstimator
from recon.images import read_frame
from recon.pipeline import reconstruct
from recon.presses import press_reader, read_presses
from sensor.dataset import Dataset
from sensor.errors import WedgeError
from validation.folds import fit_presses

FORCES = "force.csv"
REST_FRAMES = 3
"""What the force sensor reads while nothing is gripped is taken off."""


@dataclass(frozen=True, kw_only=True)
class ForceCurve:
    """One clip, frame by frame."""

    name: str
    force_n: Float64[np.ndarray, " n"]
    """Less its reading at rest; positive when gripped."""
    area_mm2: Float64[np.ndarray, " n"]
    """Of the skin that the grip disturbs: contact and collar."""
    deepest_mm: Float64[np.ndarray, " n"]

    @property
    def rank_correlation(self) -> tuple[float, float]:
        """Spearman's, of force with area and with depth; frames without contact share a rank."""
        by_area, by_depth = (
            float(spearmanr(self.force_n, values).statistic)
            for values in (self.area_mm2, self.deepest_mm)
        )
        return by_area, by_depth


@dataclass(frozen=True, kw_only=True)
class Lent:
    """An estimator of another sensor of the same design, with that sensor's blank gel."""

    estimator: GradientEstimator
    blank: Unwarped


def lend(twin: Dataset) -> Lent:
    """Fit the paper's network to all presses of the twin."""
    presses = read_presses(twin)
    everything = range(len(presses.presses))
    return Lent(
        estimator=fit_presses(presses.presses, everything, "mlp", "RGB", seed=0),
        blank=presses.unwarp(presses.background),
    )


def force_curve(clip: Dataset, lent: Lent) -> ForceCurve:
    """Contact of every kept frame of a clip, with the force at that frame.

    Raises:
        WedgeError: the forces are missing or damaged.
    """
    forces = measured_forces(clip.folder / FORCES)
    reader = press_reader(clip)
    ratio = lent.blank.mean((0, 1)) / np.maximum(reader.blank.mean((0, 1)), 1e-3)
    rows = []
    for path in sorted(clip.folder.glob("frame-*.png")):
        index = int(path.stem.removeprefix("frame-"))
        difference = (reader.unwarp(read_frame(clip.folder, path.name)) - reader.blank) * ratio
        touch = reconstruct(
            difference.astype(np.float32),
            lent.estimator,
            missing="none",
            lights_deg=clip.card.lights_deg,
            mm_per_px=clip.card.mm_per_px,
        )
        area = float(disturbed_mask(touch.difference).sum() * np.prod(touch.mm_per_px))
        rows.append((forces[index], area, touch.deepest_mm))
    force, area_mm2, deepest = np.array(rows).T
    return ForceCurve(name=clip.card.name, force_n=force, area_mm2=area_mm2, deepest_mm=deepest)


def measured_forces(path: Path) -> Float64[np.ndarray, " n"]:
    """Force at every frame of a clip, in N: less its reading at rest, positive when gripped.

    Raises:
        WedgeError: the table is missing or damaged.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            values = np.array([float(row["force_N"]) for row in csv.DictReader(stream)])
    except (OSError, ValueError, KeyError, TypeError, csv.Error) as error:
        raise WedgeError(f"{path} must hold a column force_N of numbers: {error}.") from error
    rest = float(np.median(values[:REST_FRAMES]))
    pressed = values - rest
    # Some clips count pressing as negative.
    return pressed * (1.0 if pressed.max() >= -pressed.min() else -1.0)
