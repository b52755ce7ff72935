# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The same touches with one light, two and three: what each leaves of their depth.

The touches are one ball press that no estimator has learnt from and the set's shapes whose depth is
known. (The figures of the paper's section on the missing axis, with a truth beside them.)
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from jaxtyping import Float32

from recon.arrays import DepthMap, Difference
from recon.estimators import GradientEstimator, fit_estimator, lesson_of
from recon.estimators.effort import Effort
from recon.pipeline import Reconstruction, reconstruct
from recon.presses import read_presses
from sensor.dataset import Dataset, read_dataset
from sensor.toml import Pair
from sensor.unit import MissingAxis
from validation.depth import depth_errors, true_depth
from validation.shapes import known_shapes, rmse_of_deeper_mm

SEED = 0
ALL_LIGHTS = "RGB"
WAYS: tuple[tuple[str, str, MissingAxis], ...] = (
    ("two lights, zero", "RB", "zero"),
    ("two lights, network", "RB", "network"),
    ("one light, network", "R", "network"),
    ("three lights", ALL_LIGHTS, "none"),
)
"""What is compared: its name, the lights, what stands in for the slope they do not see."""


@dataclass(frozen=True, kw_only=True)
class Touch:
    """One touch, as each way has it."""

    name: str
    truth_mm: DepthMap
    depth_mm: dict[str, DepthMap]
    """By the names of ``WAYS``."""
    rmse_mm: dict[str, float]
    """Of a shape by ``rmse_of_deeper_mm``; of the ball in its contact, as error tables do it."""
    doubt: Float32[np.ndarray, "h w"]
    """Of two lights with network: expected error of the inferred slope, mm/mm."""
    mm_per_px: Pair

    def lowest(self, way: str) -> float:
        """Least depth over the true height: negative where depth is."""
        return float(self.depth_mm[way].min() / self.truth_mm.max())


def measure_touches(
    folder: Path, estimator: str, names: tuple[str, ...] | None = None
) -> list[Touch]:
    """Every way on one ball press and on shapes; estimators learn from the other presses.

    Args:
        folder: of a rendered set with true depths.
        estimator: its name, such as "mlp".
        names: of the shapes; all unless given.

    Raises:
        WedgeError: the dataset cannot be used.
    """
    dataset = read_dataset(folder)
    presses = read_presses(dataset).presses
    widest = max(range(len(presses)), key=lambda i: presses[i].contact_radius_px)
    others = [index for index in range(len(presses)) if index != widest]
    taught = lesson_of(estimator, presses, others, SEED)
    fitted = {
        lit: fit_estimator(estimator, taught, lit, SEED, effort=Effort.SLOPES)
        for lit in dict.fromkeys(lit for _, lit, _ in WAYS)
    }
    ball = presses[widest]
    ways = _ways(ball.difference, fitted, dataset)
    truth_mm = true_depth(ways["three lights"].depth_mm, ball, folder).depth_mm
    touches = [
        _touch(
            "ball", ways, truth_mm, lambda depth_mm: depth_errors(depth_mm, ball, folder).rmse_mm
        )
    ]
    for shape in known_shapes(dataset, names):
        ways = _ways(shape.difference, fitted, dataset)
        rmse_mm = partial(rmse_of_deeper_mm, truth_mm=shape.truth_mm)
        touches.append(_touch(shape.name, ways, shape.truth_mm, rmse_mm))
    return touches


def _ways(
    difference: Difference, fitted: Mapping[str, GradientEstimator], dataset: Dataset
) -> dict[str, Reconstruction]:
    return {
        way: reconstruct(
            difference,
            fitted[lit],
            missing=missing,
            lights_deg=dataset.card.lights_deg,
            mm_per_px=dataset.card.mm_per_px,
        )
        for way, lit, missing in WAYS
    }


def _touch(
    name: str,
    ways: Mapping[str, Reconstruction],
    truth_mm: DepthMap,
    rmse_of_mm: Callable[[DepthMap], float],
) -> Touch:
    inferred = ways["two lights, network"]
    assert inferred.doubt is not None
    return Touch(
        name=name,
        truth_mm=truth_mm,
        depth_mm={way: found.depth_mm for way, found in ways.items()},
        rmse_mm={way: rmse_of_mm(found.depth_mm) for way, found in ways.items()},
        doubt=inferred.doubt,
        mm_per_px=inferred.mm_per_px,
    )
