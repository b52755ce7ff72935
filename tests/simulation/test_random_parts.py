# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Random parts: undersides that stand on zero, planes that are plane, parts that can be pressed."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.rendered_presses import part_presses
from sensor.design import FINGER, STANDARD
from simulation.presses import DEEPEST, rest_slope, skin_under
from simulation.random_parts import DEPTHS_MM, FACE_MM, FLANKS, KINDS, random_part
from simulation.skin import gel_view

WIDEST_MM = 8.0
PITCH_MM = 0.02
X_MM, Y_MM = np.meshgrid(*(np.arange(-6, 6, PITCH_MM),) * 2)
SAMPLED_MM = 0.03
"""How far above its lowest point a sharp part may lie at the nearest sample."""


def heights_mm(kind: str, seed: int) -> np.ndarray:
    return random_part(np.random.default_rng(seed), kind, WIDEST_MM).profile(X_MM, Y_MM)


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=8, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_part_stands_on_its_lowest_point_and_is_as_wide_as_it_says(kind: str, seed: int) -> None:
    part = random_part(np.random.default_rng(seed), kind, WIDEST_MM)
    height = part.profile(X_MM, Y_MM)
    inside = np.isfinite(height)
    assert inside.any() and not np.isnan(height).any()
    assert 0 <= height[inside].min() < SAMPLED_MM
    assert height[inside].max() <= FACE_MM
    farthest, half = np.hypot(X_MM, Y_MM)[inside].max(), max(part.size_mm) / 2
    assert farthest <= np.sqrt(2) * half + PITCH_MM
    assert farthest >= 0.9 * half or kind not in ("comb", "plate", "grooved")
    assert max(part.size_mm) <= WIDEST_MM
    assert DEPTHS_MM[0] <= part.depth_mm <= DEPTHS_MM[1]
    np.testing.assert_array_equal(height, heights_mm(kind, seed))


@pytest.mark.parametrize("seed", range(6))
def test_a_ridge_has_two_plane_flanks(seed: int) -> None:
    height = heights_mm("ridge", seed)
    height[np.isinf(height)] = np.nan
    bends = [np.diff(height, n=2, axis=axis) for axis in (0, 1)]
    plane = np.concatenate([bend[np.isfinite(bend)] for bend in bends])
    assert np.mean(np.abs(plane) < 1e-9) > 0.9
    steepness = np.hypot(*np.gradient(height, PITCH_MM))
    flanks = steepness[steepness > 1e-6]
    middle = np.quantile(flanks, (0.1, 0.9))
    assert FLANKS[0] - 1e-6 <= middle[0] and middle[1] <= FLANKS[1] + 1e-6


def test_each_octave_of_depths_is_as_likely() -> None:
    rng = np.random.default_rng(0)
    depths = np.array([random_part(rng, "plate", WIDEST_MM).depth_mm for _ in range(400)])
    middle = np.sqrt(DEPTHS_MM[0] * DEPTHS_MM[1])
    assert np.mean(depths < middle) == pytest.approx(0.5, abs=0.06)
    assert np.mean(depths < DEPTHS_MM[0] * (middle / DEPTHS_MM[0]) ** 0.5) == pytest.approx(
        0.25, abs=0.06
    )


def test_about_half_of_the_lattices_stand_on_a_plate() -> None:
    plates = []
    for seed in range(60):
        profile, _ = KINDS["lattice"](np.random.default_rng(seed), WIDEST_MM / 2)
        height = profile(X_MM, Y_MM)
        rows, columns = np.nonzero(np.isfinite(height))
        whole = height[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
        if np.isfinite(whole).all():
            plates.append(whole.max())
    assert 15 < len(plates) < 45 and all(0.1 < plate <= 2 for plate in plates)


def test_parts_differ_by_kind_and_seed() -> None:
    every = [heights_mm(kind, seed) for kind in KINDS for seed in (1, 2)]
    for index, one in enumerate(every):
        assert not any(np.array_equal(one, other) for other in every[index + 1 :])


@pytest.mark.parametrize("design", [STANDARD, FINGER], ids=lambda design: design.name)
def test_every_kind_is_pressed_as_often_and_dents_the_gel_as_deep_as_it_says(design) -> None:
    view, presses = gel_view(design, 160), part_presses(design, 2 * len(KINDS), seed=5)
    assert set(Counter(press.indenter.name for press in presses).values()) == {2}
    for press, again in zip(presses, part_presses(design, 2 * len(KINDS), seed=5), strict=True):
        skin = skin_under(design, view, press)
        assert skin.contact.any()
        # Pixels miss sharp tips, and gel falls away under parts whose lowest points lie far out.
        assert 0.7 * press.depth_mm < skin.depth_mm.max() <= press.depth_mm + 1e-9
        thickest_mm = design.gel.thickness_at_mm(*press.center_mm)
        assert press.depth_mm <= DEEPEST * thickest_mm
        np.testing.assert_array_equal(skin.depth_mm, skin_under(design, view, again).depth_mm)


def test_a_plate_touches_curved_gel_where_it_is_pressed_not_downhill() -> None:
    presses = [p for p in part_presses(STANDARD, 10 * len(KINDS), 6) if p.indenter.name == "plate"]
    view = gel_view(STANDARD, 160)
    for press in presses:
        rows, columns = np.nonzero(skin_under(STANDARD, view, press).contact)
        middle = view.x_mm[columns].mean(), view.y_mm[rows].mean()
        assert np.hypot(*(np.array(middle) - press.center_mm)) < 0.5


def test_the_slope_of_untouched_gel_is_that_of_its_ellipsoid() -> None:
    gel = STANDARD.gel
    assert gel.curved
    x, y = 9.0, -6.0
    a, b, c = gel.semi_axis_along_mm, gel.semi_axis_across_mm, gel.semi_axis_normal_mm
    root = np.sqrt(1 - (x / a) ** 2 - (y / b) ** 2)
    expected = (-c * x / a**2 / root, -c * y / b**2 / root)
    assert rest_slope(gel, x, y) == pytest.approx(expected, rel=1e-4)
    assert rest_slope(replace(gel, curved=False), x, y) == (0, 0)
