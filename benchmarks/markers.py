# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Dots: how well and how fast slopes under them are filled, and whether real dots are found."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from benchmarks.integrators import three_caps
from benchmarks.measurement import Measurement, interleaved_ms
from recon.arrays import ContactMask
from recon.integration.poisson import integrate
from recon.markers.filling import METHODS, fill_gradients, prepare_fill
from validation.dots import COUNTED_FRAMES, hand_counted, score_detection

DOT_RADIUS_PX, DOT_PITCH_PX = 4.0, 32
PLACES_PX = ((0, 0), (8, 5), (16, 16), (5, 20), (24, 11), (12, 28))
SLOPE_NOISE = 0.05
SIZES_PX = ((200, 150), (320, 240))
SLOW = ("linear", "cubic")
"""Triangulate anew for each field: timed on one frame."""


@dataclass(frozen=True, kw_only=True)
class FillRow:
    """One way of filling."""

    method: str
    slope_error: float
    """Mean absolute, under dots in contact, mm/mm."""
    depth_error_mm: float
    """RMSE of the depth that is integrated from the filled slopes, less that of whole slopes."""
    ms: tuple[float, float]
    """A frame while the dots stand still, at ``SIZES_PX``."""


def fill_table() -> list[FillRow]:
    """Every way of filling on three ball caps with noise, dots in six places."""
    rng = np.random.default_rng(0)
    depth, exact = three_caps()
    pitch = (0.1, 0.1)
    noisy = [
        (exact + SLOPE_NOISE * rng.normal(size=exact.shape)).astype(np.float32) for _ in PLACES_PX
    ]
    rows = []
    for method in METHODS:
        slopes, depths = [], []
        for gradient, place in zip(noisy, PLACES_PX, strict=True):
            hidden = dots((320, 240), place)
            filled = fill_gradients(gradient, hidden, method, pitch)
            touched = hidden & exact.any(-1)
            slopes.append(float(np.abs(filled - exact)[touched].mean()))
            rmse = [
                float(np.sqrt(np.mean((integrate(field, pitch, "dirichlet") - depth) ** 2)))
                for field in (filled, gradient)
            ]
            depths.append(rmse[0] - rmse[1])
        rows.append(
            FillRow(
                method=method,
                slope_error=float(np.mean(slopes)),
                depth_error_mm=float(np.mean(depths)),
                ms=(_steady_ms(method, SIZES_PX[0]), _steady_ms(method, SIZES_PX[1])),
            )
        )
    return rows


def dots(size_px: tuple[int, int], place_px: tuple[int, int]) -> ContactMask:
    """A grid of round dots shifted to a place."""
    columns, rows = np.meshgrid(np.arange(size_px[0]), np.arange(size_px[1]))
    offsets = [
        (along + at + DOT_PITCH_PX / 2) % DOT_PITCH_PX - DOT_PITCH_PX / 2
        for along, at in zip((columns, rows), place_px, strict=True)
    ]
    return np.hypot(*offsets) <= DOT_RADIUS_PX


def _steady_ms(method: str, size_px: tuple[int, int]) -> float:
    gradient = np.random.default_rng(0).normal(size=(size_px[1], size_px[0], 2)).astype(np.float32)
    hidden = dots(size_px, (8, 5))
    call = partial(fill_gradients, gradient, hidden, method)
    if method not in SLOW:
        call()
    (ms,) = interleaved_ms([call], rounds=1 if method in SLOW else 15)
    return ms


def measure() -> Iterator[Measurement]:
    """Every figure of the markers."""
    rows = {row.method: row for row in fill_table()}
    nearest = rows["nearest"]
    for method, row in rows.items():
        yield Measurement(
            name=f"{method}: slope error under dots against nearest, three caps, noise 0.05",
            value=row.slope_error / nearest.slope_error,
            unit="ratio",
            bar=0.7 if method == "surface" else None,
        )
        yield Measurement(
            name=f"{method}: depth error that dots add, three caps, noise 0.05",
            value=row.depth_error_mm,
            unit="mm",
        )
        bars = {"surface": (None, 1.0), "nearest": (10.0, None)}.get(method, (None, None))
        for (width, height), ms, bar in zip(SIZES_PX, row.ms, bars, strict=True):
            yield Measurement(
                name=f"{method}: fill a frame of {width}x{height}, dots at rest",
                value=ms,
                unit="ms",
                bar=bar,
            )
    hidden = dots((320, 240), (8, 5))
    (ms,) = interleaved_ms([partial(prepare_fill, hidden)], rounds=5)
    yield Measurement(name="surface: dots moved, shapes known, 320x240", value=ms, unit="ms")
    for name in COUNTED_FRAMES:
        counted = hand_counted(name)
        if counted is None:
            continue
        score = score_detection(*counted)
        yield Measurement(
            name=f"{name}: dots missed of {score.whole} counted by eye",
            value=1 - score.found / score.whole,
            unit="share",
            bar=0.02,
        )
        yield Measurement(
            name=f"{name}: dots found where none is",
            value=score.false / score.whole,
            unit="share",
            bar=0.01,
        )
