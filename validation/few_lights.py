# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The same touches with one light, two and three: what each leaves of their depth.

The touches are one ball press that no estimator has learnt from and the set's shapes whose depth is
known. (The figures of the paper's section on the missing axis, with a truth beside them.)
"""

from collections.abc import Mapping
from dataclasses import dataclass
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
    touches = [
        Touch(
            name="ball",
            truth_mm=true_depth(ways["three lights"].depth_mm, ball, folder).depth_mm,
            depth_mm={way: found.depth_mm for way, found in ways.items()},
            rmse_mm={
                way: depth_errors(found.depth_mm, ball, folder).rmse_mm
                for way, found in ways.items()
            },
            doubt=_doubt(ways),
            mm_per_px=ball.mm_per_px,
        )
    ]
    for shape in known_shapes(dataset, names):
        ways = _ways(shape.difference, fitted, dataset)
        touches.append(
            Touch(
                name=shape.name,
                truth_mm=shape.truth_mm,
                depth_mm={way: found.depth_mm for way, found in ways.items()},
                rmse_mm={
                    way: rmse_of_deeper_mm(found.depth_mm, shape.truth_mm)
                    for way, found in ways.items()
                },
                doubt=_doubt(ways),
                mm_per_px=dataset.card.mm_per_px,
            )
        )
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


def _doubt(ways: Mapping[str, Reconstruction]) -> Float32[np.ndarray, "h w"]:
    doubt = ways["two lights, network"].doubt
    assert doubt is not None
    return doubt
