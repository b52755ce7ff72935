# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where an axis is inferred, a long frame says what a short one of the same touch says."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recon.ball import ball_cap
from recon.depth import (
    Depth,
    InferredField,
    beneath_dots,
    depth_of,
    fewer_px,
    infer_gradient,
    inferred_depth,
    untouched_depth,
    weighed_integral,
    without,
)
from recon.integration.poisson import Boundary
from recon.lights import Axis
from recon.missing_axis.inference import LONGEST_SIDE_PX, working_size
from tests.recon.test_depth_error import told


@given(
    height=st.integers(1, 3000),
    width=st.integers(1, 3000),
    pitch=st.tuples(st.floats(0.01, 0.1), st.floats(0.01, 0.1)),
)
def test_a_long_frame_is_shrunk_to_what_the_network_sees(height, width, pitch) -> None:
    rows, columns, fewer_mm = fewer_px(height, width, pitch)
    assert (columns * fewer_mm[0], rows * fewer_mm[1]) == pytest.approx(
        (width * pitch[0], height * pitch[1])
    )
    assert 1 <= rows <= height and 1 <= columns <= width
    if max(height, width) <= LONGEST_SIDE_PX:
        assert (rows, columns, fewer_mm) == (height, width, pitch)
    else:
        assert max(rows, columns) <= LONGEST_SIDE_PX
        # Square, but that each side is a whole number of pixels, and at least one.
        side_mm = max(columns * fewer_mm[0] / LONGEST_SIDE_PX, rows * fewer_mm[1] / LONGEST_SIDE_PX)
        side_mm = max(side_mm, *pitch)
        for count, pitch_mm in ((columns, fewer_mm[0]), (rows, fewer_mm[1])):
            assert abs(count - count * pitch_mm / side_mm) <= 0.5 + 1e-9 or count == 1


@pytest.mark.parametrize("pitch_mm", [(0.1, 0.2), (0.2, 0.1), (0.1, 0.1), (0.01, 0.03)])
def test_the_network_sees_square_pixels_and_none_that_were_stretched(pitch_mm) -> None:
    rows, columns = working_size(100, 100, pitch_mm)
    assert max(rows, columns) == 100
    assert rows / columns == pytest.approx(pitch_mm[1] / pitch_mm[0], rel=0.02)


def of_ball(
    size_px: tuple[int, int],
    size_mm: tuple[float, float],
    center: tuple[float, float],
    unseen: Axis,
) -> tuple[Depth, np.ndarray]:
    """Lights along one axis read a ball as it is, across as nothing; and its depth."""
    width, height = size_px
    pitch_mm = (size_mm[0] / width, size_mm[1] / height)
    place_px = (center[0] * width, center[1] * height)
    cap = ball_cap(size_px, place_px, 2.0, 3.0, pitch_mm)
    seen = without(unseen, cap.gradient.astype(np.float32))
    return inferred_depth(seen, cap.contact, unseen, pitch_mm, hinted=False), cap.depth_mm


@pytest.mark.parametrize("unseen", ["x", "y"])
@pytest.mark.parametrize("size_mm", [(16.0, 12.0), (9.6, 12.0), (20.0, 9.0)])
@pytest.mark.parametrize("center", [(0.5, 0.5), (0.4, 0.1)], ids=["inside", "at the border"])
def test_a_long_frame_s_depth_is_the_short_one_s(center, size_mm, unseen) -> None:
    long, truth = of_ball((640, 480), size_mm, center, unseen)
    short, truth_of_short = of_ball((320, 240), size_mm, center, unseen)
    assert long.gradient.shape == (480, 640, 2)
    assert long.depth_mm.shape == (480, 640) == np.shape(long.doubt)
    assert long.boundary == short.boundary == ("dirichlet" if center[1] == 0.5 else "neumann")
    alike = cv2.resize(long.depth_mm, (320, 240), interpolation=cv2.INTER_AREA)
    assert np.abs(alike - short.depth_mm).max() < 0.1 * truth.max()
    off, off_of_short = (
        np.sqrt(np.mean((found - true) ** 2))
        for found, true in ((long.depth_mm, truth), (short.depth_mm, truth_of_short))
    )
    assert off < 1.1 * off_of_short + 0.005 * truth.max()
    assert off < 0.1 * truth.max()


@pytest.mark.parametrize("unseen", ["x", "y"])
@pytest.mark.parametrize("inside_mm", [-1.0, 0.0, 0.8, 1.4])
@pytest.mark.parametrize("edge", ["left", "right", "top", "bottom"])
def test_a_ball_that_the_frame_cuts_keeps_its_depth(edge, inside_mm, unseen) -> None:
    """Whose contact reaches 2 mm around its middle, which lies inside the edge, or beyond it."""
    size_px = (160, 120)
    across, along = {
        "left": (inside_mm, 6.0),
        "right": (16.0 - inside_mm, 6.0),
        "top": (8.0, inside_mm),
        "bottom": (8.0, 12.0 - inside_mm),
    }[edge]
    cap = ball_cap(size_px, (10 * across, 10 * along), 2.0, 3.0, (0.1, 0.1))
    slopes, truth = cap.gradient.astype(np.float32), cap.depth_mm
    found = inferred_depth(slopes, cap.contact, unseen, (0.1, 0.1), hinted=True)
    assert found.boundary == "neumann"
    assert found.depth_mm.max() == pytest.approx(truth.max(), rel=0.1)
    off = np.sqrt(np.mean((found.depth_mm - truth)[truth > 0] ** 2))
    assert off < 0.08 * truth.max()


@pytest.mark.parametrize("unseen", ["x", "y"])
@pytest.mark.parametrize("inside_px", [0.0, 8.0])
def test_two_balls_that_opposite_edges_cut_keep_theirs(inside_px, unseen) -> None:
    pitch_mm, size_px = (0.1, 0.1), (160, 120) if unseen == "x" else (120, 160)
    caps = []
    for along, across in ((inside_px, 50.0), (119.0 - inside_px, 70.0)):
        center = (across, along) if unseen == "x" else (along, across)
        caps.append(ball_cap(size_px, center, 2.0, 3.0, pitch_mm))
    disturbed = caps[0].contact | caps[1].contact
    slopes = (caps[0].gradient + caps[1].gradient).astype(np.float32)
    found = inferred_depth(slopes, disturbed, unseen, pitch_mm, hinted=True)
    for cap in caps:
        deepest_mm = found.depth_mm[cap.contact].max()
        assert deepest_mm == pytest.approx(cap.depth_mm.max(), rel=0.1)


@pytest.mark.parametrize("unseen", ["x", "y"])
def test_a_slope_that_is_set_to_zero_is_not_looked_at(unseen) -> None:
    gradient = np.ones((4, 5, 2), np.float32)
    gradient[..., "xy".index(unseen)] = np.nan
    zero = without(unseen, gradient)
    assert zero.dtype == np.float32 and zero.sum() == 20


@pytest.mark.parametrize("unseen", ["x", "y"])
def test_the_level_of_a_free_border_s_integral_does_not_matter(unseen) -> None:
    """Slopes do not tell it: the gel that nothing touches does."""
    pitch_mm = (0.1, 0.1)
    cap = ball_cap((160, 120), (64.0, 12.0), 2.0, 3.0, pitch_mm)
    seen = without(unseen, cap.gradient.astype(np.float32))

    def lifted(field: InferredField, boundary: Boundary) -> np.ndarray:
        assert boundary == "neumann"
        return weighed_integral(field, boundary, pitch_mm) + np.float32(0.5)

    plain, other = (
        inferred_depth(seen, cap.contact, unseen, pitch_mm, hinted=False, free_depth=solve)
        for solve in (None, lifted)
    )
    np.testing.assert_allclose(other.depth_mm, plain.depth_mm, atol=1e-4)


@pytest.mark.parametrize(("touched", "known"), [(0.0, True), (0.6, True), (0.9995, False)])
def test_gel_that_nothing_touches_tells_the_level_of_a_free_border(touched, known) -> None:
    depth_mm = np.full((100, 100), 5.0)
    disturbed = np.arange(10_000).reshape(100, 100) < touched * 10_000
    depth_mm[~disturbed] = 0.3
    assert untouched_depth(depth_mm, disturbed, "neumann") == (0.3 if known else 0.0)
    assert untouched_depth(depth_mm, disturbed, "dirichlet") == 0.0


@pytest.mark.parametrize("unseen", ["x", "y"])
def test_gel_that_cannot_have_moved_is_flat_whatever_the_lights_and_the_hint_say(unseen) -> None:
    cap = ball_cap((160, 120), (80.0, 60.0), 2.0, 3.0, (0.1, 0.1))
    drifted = (cap.gradient + 0.1).astype(np.float32)
    field = infer_gradient(drifted, cap.contact, unseen, (0.1, 0.1), hinted=True)
    still = ~field.support
    assert still.any() and np.abs(field.gradient[still]).max() < 0.01


@pytest.mark.parametrize("unseen", ["x", "y"])
def test_a_contact_cut_in_half_has_the_depth_of_half_of_the_whole_one(unseen) -> None:
    """Which the frame does not cut: its mirror image beyond the edge ends at a zero border."""
    size_px, center = ((160, 240), (80.0, 119.5)) if unseen == "x" else ((240, 160), (119.5, 80.0))
    cap = ball_cap(size_px, center, 2.0, 3.0, (0.1, 0.1))
    slopes = cap.gradient.astype(np.float32)
    half = np.s_[120:] if unseen == "x" else np.s_[:, 120:]
    whole, cut = (
        inferred_depth(slopes[part], cap.contact[part], unseen, (0.1, 0.1), hinted=True)
        for part in (np.s_[:], half)
    )
    assert (whole.boundary, cut.boundary) == ("dirichlet", "neumann")
    np.testing.assert_allclose(cut.depth_mm, whole.depth_mm[half], atol=1e-5)


def test_gel_that_rests_is_at_zero_though_most_beside_a_contact_followed_it() -> None:
    rows, columns = np.indices((120, 160))
    away_px = np.hypot(rows, columns - 80)  # a cone that the edge cuts
    depth_mm = 0.03 * np.maximum(90 - away_px, 0)
    outward = np.stack([columns - 80, rows], -1) / np.maximum(away_px, 1)[..., None]
    slopes = np.where(depth_mm[..., None] > 0, -0.3 * outward, 0).astype(np.float32)
    disturbed = away_px < 30
    found = depth_of(
        slopes, disturbed, told(None), missing="none", lights_deg=None, mm_per_px=(0.1, 0.1)
    )
    assert found.boundary == "neumann"
    assert np.median(depth_mm[~disturbed]) > 0.2
    np.testing.assert_allclose(found.depth_mm, depth_mm, atol=0.03)


@pytest.mark.parametrize("unseen", ["x", "y"])
def test_under_dots_a_slope_that_no_light_shows_says_nothing_of_the_other(unseen) -> None:
    known = 1 - "xy".index(unseen)
    slopes = ball_cap((80, 60), (40.0, 30.0), 2.0, 3.0, (0.1, 0.1)).gradient.astype(np.float32)
    other = slopes.copy()
    other[..., 1 - known] = np.random.default_rng(0).normal(0, 0.3, other.shape[:2])
    hidden = np.zeros(slopes.shape[:2], bool)
    hidden[::10, ::10] = hidden[1::10, ::10] = hidden[::10, 1::10] = True
    one, two = (
        beneath_dots(field, hidden, unseen, (0.1, 0.1))[..., known] for field in (slopes, other)
    )
    np.testing.assert_array_equal(one, two)
    assert (one != slopes[..., known])[hidden].any()
