# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Small frames of gels with dots: the quick way says what the slow way says."""

from dataclasses import replace

import numpy as np
import pytest

from recon.calibration import Calibration
from recon.fast import FastReconstructor
from recon.fast.disturbance import LEAST_SIDE_PX, LEAST_STILL_PX
from recon.pipeline import Reconstructor
from tests.dotted import dotted, grid_px, pad
from tests.recon.fast.test_reconstructor import RED_AND_BLUE, in_bytes, to_the_minimum
from tests.recon.fast.units import SLOPE, make_unit, random_default, random_mlp, scaled

SIZES_PX = [(96, 72), (133, 99), (161, 121), (263, 197)]
OBLIQUE = RED_AND_BLUE | {"lights_deg": {"R": 50.0, "B": -130.0}}
RADIUS_PX, SPACING_PX = 2.0, 14.0


def places_px(size_px: tuple[int, int]) -> np.ndarray:
    return grid_px(SPACING_PX, margin_px=8.0, size=size_px)


def unit_of(size_px: tuple[int, int], estimator, lit: dict) -> Calibration:
    places = places_px(size_px)
    unit = make_unit(size_px, estimator=estimator, **lit)
    return replace(
        unit,
        card=replace(unit.card, markers={"count": float(len(places))}),
        background=in_bytes(dotted(places, RADIUS_PX, pad(size_px))),
    )


def touched(size_px: tuple[int, int], center: float, moved_px: float) -> np.ndarray:
    """A contact about a share of the frame, whose dots have moved."""
    width, height = size_px
    changed, places = pad(size_px), places_px(size_px)
    x, y = round(center * width), round(center * height)
    rows = slice(max(y - height // 6, 0), y + height // 6)
    changed[rows, max(x - width // 6, 0) : x + width // 6] += [0.1, -0.05, -0.1]
    away = np.square((places - [x, y]) / (0.2 * width)).sum(1, keepdims=True)
    shifted = places + moved_px * np.exp(-away) * [1.0, 0.5]
    return in_bytes(dotted(shifted, RADIUS_PX, changed, seed=1))


def test_the_sizes_are_small_ones_of_both_kinds() -> None:
    sides = [min(size_px) for size_px in SIZES_PX]
    assert max(sides) < LEAST_SIDE_PX
    assert min(sides) < LEAST_STILL_PX - 1 in sides
    assert any(side > LEAST_STILL_PX for side in sides)


@pytest.mark.parametrize("size_px", SIZES_PX)
@pytest.mark.parametrize(
    ("kind", "lit"),
    [
        pytest.param(random_mlp, {}, id="mlp"),
        pytest.param(random_default, {}, id="default"),
        pytest.param(random_default, RED_AND_BLUE, id="line"),
        pytest.param(random_default, OBLIQUE, id="oblique"),
    ],
)
@pytest.mark.parametrize("center", [0.5, 0.1])
def test_small_frames_with_dots_are_the_reference_s(
    size_px, kind, lit, center, monkeypatch: pytest.MonkeyPatch
) -> None:
    to_the_minimum(monkeypatch)
    estimator = kind(channels=lit.get("channels", "RGB"))
    if kind is random_default:  # so gentle that gel beside a contact is still
        estimator = replace(estimator, layers=scaled(estimator, 0.02))
    unit = unit_of(size_px, estimator, lit)
    quick, slow = FastReconstructor(unit), Reconstructor(unit)
    for moved_px in (3.0, 0.0):  # a frame's dots leave no trace in the next
        frame = touched(size_px, center, moved_px)
        touch, truth = quick(frame), slow(frame)
        assert truth.markers == touch.markers == "tracked"
        np.testing.assert_allclose(touch.difference, truth.difference, atol=1e-5)
        np.testing.assert_array_equal(touch.disturbed, truth.disturbed)
        assert touch.boundary == truth.boundary
        np.testing.assert_array_equal(touch.gradient.any(-1), truth.gradient.any(-1))
        steepest = np.abs(truth.gradient).max()
        bound = min(3 * SLOPE if lit else SLOPE, 0.01 * steepest)
        assert np.abs(touch.gradient - truth.gradient).max() < bound
        assert np.abs(touch.depth_mm - truth.depth_mm).max() < 0.01 * np.ptp(truth.depth_mm)
        assert (touch.contact == truth.contact).mean() > 0.99
