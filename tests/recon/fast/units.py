# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Units that nobody calibrated: a random network, a blank frame, any geometry."""

from itertools import pairwise
from typing import Any

import numpy as np

from recon.calibration import Calibration
from recon.estimators import default
from recon.estimators.default import Default
from recon.estimators.mlp import HIDDEN, Mlp
from recon.estimators.shading import LIGHT_POWERS
from recon.estimators.surroundings import ASPECTS
from sensor.unit import UnitCard

CORNERS_PX = ((12.0, 6.0), (150.0, 10.0), (140.0, 112.0), (20.0, 108.0))
SLOPE = 1e-3
"""What the quick way may differ by, in slope."""


def random_mlp(seed: int = 0, channels: str = "RGB") -> Mlp:
    """As steep as a fitted one: slopes change by about 1 within a tenth of full scale."""
    rng = np.random.default_rng(seed)
    sizes = (len(channels) + 2, *HIDDEN, 2)
    layers = tuple(
        (
            rng.normal(0, 1.5 / np.sqrt(n), (n, m)).astype(np.float32),
            rng.normal(0, 0.3, m).astype(np.float32),
        )
        for n, m in pairwise(sizes)
    )
    spread = rng.uniform(0.05, 0.1, len(channels)).astype(np.float32)
    return Mlp(channels=channels, color_scale=spread, layers=layers)


def random_default(
    seed: int = 13, channels: str = "RGB", members: int = default.MEMBERS
) -> Default:
    """Networks that differ, on light that no polynomial leaves dark; by seed 13 all steep."""
    rng, count = np.random.default_rng(seed), len(channels)
    features = (2 + ASPECTS) * count + 2
    layers = tuple(
        (
            rng.normal(0, 1.2 / np.sqrt(n), (members, n, m)).astype(np.float32),
            rng.normal(0, 0.1, (members, m)).astype(np.float32),
        )
        for n, m in pairwise((features, *default.HIDDEN, 2))
    )
    light = rng.normal(0, 0.05, (len(LIGHT_POWERS), count))
    light[0] = 0.5
    return Default(
        channels=channels,
        light=light.astype(np.float32),
        mean=rng.normal(0, 0.1, features).astype(np.float32),
        spread=rng.uniform(0.3, 0.6, features).astype(np.float32),
        layers=layers,
        gel=np.zeros((2, 2), np.float32),
        error90=np.outer(np.linspace(0.05, 0.3, len(default.SLOPE_KNOTS)), (1, 0.8)).astype("f4"),
    )


def blank_frame(size_px: tuple[int, int], seed: int = 0) -> np.ndarray:
    """Light falling off smoothly, with a grey level of noise."""
    width, height = size_px
    y, x = np.indices((height, width))
    rng = np.random.default_rng(seed)
    light = 120 + 60 * np.stack([x / width, y / height, 1 - x / width], -1)
    return (light + rng.normal(0, 1, light.shape)).round().clip(0, 255).astype(np.uint8)


def make_unit(
    size_px: tuple[int, int] = (160, 120),
    *,
    corners_px: tuple | None = None,
    channels: str = "RGB",
    estimator: Any = None,
    **card: object,
) -> Calibration:
    """A unit of frames of (width, height); with corners they are unwarped to the same size."""
    estimator = estimator or random_mlp(channels=channels)
    fields = {
        "serial": "test",
        "created": "2026-01-01",
        "design_sha256": "0",
        "dataset": "none",
        "dataset_sha256": "0",
        "estimator": estimator.name,
        "channels": channels,
        "missing_axis": "none",
        "mm_per_px": (0.05, 0.06),
        "frame_size_px": size_px,
        "size_px": size_px,
        "metrics": {},
        "corners_px": corners_px,
        "pad_size_mm": (size_px[0] * 0.05, size_px[1] * 0.06) if corners_px else None,
    }
    return Calibration(
        card=UnitCard(**fields | card),
        background=blank_frame(size_px),
        estimator=estimator,
    )


def pressed(background: np.ndarray, center_px: tuple[float, float], seed: int = 1) -> np.ndarray:
    """The frame with a patch of other colours, as a ball leaves."""
    height, width = background.shape[:2]
    y, x = np.indices((height, width))
    dx, dy = (x - center_px[0]) / (width / 6), (y - center_px[1]) / (height / 6)
    inside = np.hypot(dx, dy) < 1
    change = 60 * np.stack([dx, dy, -dx - dy], -1) * inside[..., None]
    noise = np.random.default_rng(seed).normal(0, 1, background.shape)
    return (background + change + noise).round().clip(0, 255).astype(np.uint8)


def planes(image: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(np.moveaxis(image, -1, 0))


def scaled(network: Mlp | Default, gain: float) -> tuple:
    """Its layers, the last of them times a gain."""
    *hidden, (weight, bias) = network.layers
    return (*hidden, (gain * weight, gain * bias))
