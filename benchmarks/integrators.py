# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The integrators: exactness, order of convergence, ball caps, and time against the floor."""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from scipy import fft

from benchmarks.measurement import Measurement, interleaved_ms
from recon.arrays import DepthMap, GradientField
from recon.ball import ball_cap
from recon.integration.poisson import Boundary, integrate, solve_dirichlet, solve_neumann
from sensor.toml import Pair

SIZES_PX = ((320, 240), (640, 480))
BOUNDARIES: tuple[Boundary, ...] = ("dirichlet", "neumann")
CAPS_MM_PER_PX = (0.1, 0.1)
CAP_CENTERS_PX = ((70.3, 72.6), (221.8, 80.4), (148.1, 179.2))
CONTACT_RADII_MM = (2.5, 2.0, 3.0)
Moves = Sequence[Pair]
"""Of each of them, in pixels."""
NOT_MOVED: Moves = ((0.0, 0.0),) * 3
PLACES = 40
"""So many times each is moved within a pixel."""


def measure() -> Iterator[Measurement]:
    """Every figure of the integrators."""
    yield from _exactness()
    for boundary in BOUNDARIES:
        coarse, fine = (bump_error(count, boundary) for count in (60, 120))
        yield Measurement(
            name=f"{boundary}: error of a smooth bump when the pitch is halved",
            value=fine / coarse,
            unit="ratio",
            bar=0.26,  # second order: a quarter
        )
    yield from _caps()
    yield from _time()


def _exactness() -> Iterator[Measurement]:
    rng = np.random.default_rng(0)
    depth, pitch_mm = rng.normal(size=(240, 320)), (0.1, 0.13)
    ringed = np.pad(depth, 1)
    zero = solve_dirichlet(
        np.diff(ringed[1:-1], axis=1) / pitch_mm[0],
        np.diff(ringed[:, 1:-1], axis=0) / pitch_mm[1],
        pitch_mm,
    )
    free = solve_neumann(
        np.diff(depth, axis=1) / pitch_mm[0], np.diff(depth, axis=0) / pitch_mm[1], pitch_mm
    )
    for boundary, error in (("dirichlet", zero - depth), ("neumann", free - depth + depth.mean())):
        yield Measurement(
            name=f"{boundary}: error on exact discrete gradients of random depth, 320x240",
            value=float(np.abs(error).max() / np.ptp(depth)),
            unit="of the height",
            bar=1e-10,
        )


def bump_error(count: int, boundary: Boundary) -> float:
    """Largest error on cos^4 bump of height 1 whose gradient is sampled at pixel centres."""
    pitch = 2 / count
    along = (np.arange(count) + 0.5) * pitch - 1
    value, slope = np.cos(np.pi * along / 2) ** 4, _slope(along)
    depth = value[:, None] * value[None, :]
    gradient = np.stack([value[:, None] * slope[None, :], slope[:, None] * value[None, :]], -1)
    found = integrate(gradient, (pitch, pitch), boundary)
    offset = 0.0 if boundary == "dirichlet" else float((depth - found).mean())
    return float(np.abs(found + offset - depth).max())


def _slope(along: np.ndarray) -> np.ndarray:
    return -2 * np.pi * np.cos(np.pi * along / 2) ** 3 * np.sin(np.pi * along / 2)


def three_caps(moved_px: Moves = NOT_MOVED) -> tuple[DepthMap, GradientField]:
    """Depth and centre-sampled gradients of three ball caps at 320x240, ``CAPS_MM_PER_PX``."""
    depth, gradient = np.zeros((240, 320)), np.zeros((240, 320, 2))
    for (x_px, y_px), radius_mm, (right_px, down_px) in zip(
        CAP_CENTERS_PX, CONTACT_RADII_MM, moved_px, strict=True
    ):
        center_px = (x_px + right_px, y_px + down_px)
        cap = ball_cap((320, 240), center_px, radius_mm, 4.0, CAPS_MM_PER_PX)
        depth += cap.depth_mm
        gradient += cap.gradient
    return depth, gradient


def integrated_caps(moved_px: Moves = NOT_MOVED) -> tuple[DepthMap, dict[Boundary, DepthMap]]:
    """Depth of ``three_caps``, and by boundary what their gradients integrate to.

    A free border leaves the level open: it is taken from the flat around the caps.
    """
    depth, gradient = three_caps(moved_px)
    found = {boundary: integrate(gradient, CAPS_MM_PER_PX, boundary) for boundary in BOUNDARIES}
    found["neumann"] = found["neumann"] - np.median(found["neumann"][depth == 0])
    return depth, found


def _caps() -> Iterator[Measurement]:
    """Where their rims lie between pixels changes what is left: many places, and the worst."""
    moved_px = np.random.default_rng(0).uniform(-0.5, 0.5, (PLACES, 3, 2)).tolist()
    errors: dict[Boundary, list[tuple[float, float, float]]] = {b: [] for b in BOUNDARIES}
    for of_each in moved_px:
        depth, integrated = integrated_caps(of_each)
        for boundary, found in integrated.items():
            errors[boundary].append(_misfit(depth, found))
    figures = ("RMSE", "of the height", 3e-3), ("scale error", "ratio", 5e-3), ("shift", "px", 0.05)
    for boundary, found_errors in errors.items():
        caps = f"{boundary}: three ball caps, 320x240"
        for (name, unit, bar), values in zip(figures, np.transpose(found_errors), strict=True):
            for word, value in (("median", np.median(values)), ("worst", values.max())):
                yield Measurement(
                    name=f"{caps}, {name}, {word} of {PLACES} places",
                    value=float(value),
                    unit=unit,
                    bar=bar,
                )


def _misfit(depth: DepthMap, found: DepthMap) -> tuple[float, float, float]:
    """RMSE of the height, error of the scale, and shift in px."""
    shifts = np.gradient(depth)
    terms = np.stack([depth.ravel(), shifts[1].ravel(), shifts[0].ravel()], 1)
    scale, shift_x, shift_y = np.linalg.lstsq(terms, found.ravel(), rcond=None)[0]
    rmse = float(np.sqrt(np.mean((found - depth) ** 2)))
    return rmse / float(depth.max()), abs(float(scale) - 1), float(np.hypot(shift_x, shift_y))


def _time() -> Iterator[Measurement]:
    for width, height in SIZES_PX:
        gradient = np.random.default_rng(0).normal(size=(height, width, 2)).astype(np.float32)
        plane = np.ascontiguousarray(gradient[..., 0])
        floor_ms, *taken_ms = interleaved_ms(
            [
                partial(_there_and_back, plane),
                *(partial(integrate, gradient, (0.1, 0.1), boundary) for boundary in BOUNDARIES),
            ],
            rounds=15,
        )
        for boundary, ms in zip(BOUNDARIES, taken_ms, strict=True):
            yield Measurement(
                name=f"{boundary}: time at {width}x{height} against one DCT and its inverse",
                value=ms / floor_ms,
                unit=f"ratio ({ms:.1f} ms)",
            )


def _there_and_back(plane: DepthMap) -> DepthMap:
    """The floor: one cosine transform and its inverse."""
    return fft.idctn(fft.dctn(plane))
