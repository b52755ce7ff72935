# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Depth by slopes that count by their doubt: its minimum, its limits, what it mends."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse
from scipy.sparse.linalg import spsolve

from recon.ball import ball_cap
from recon.integration.poisson import integrate, midpoint_slopes
from recon.integration.weighed import (
    CELLS,
    MEASURED,
    STILL,
    held_weight,
    inferred_doubts,
    resting,
    shorter_side_mm,
    slope_doubt,
    weighed_depth,
)

BORDERS = ("dirichlet", "neumann")


def pressed_ball(size_px, center_px, radius_px, pitch):
    """Depth and slopes of a ball with half of its radius in the gel."""
    cap = ball_cap(size_px, center_px, radius_px * pitch[0], 1.2 * radius_px * pitch[0], pitch)
    return cap.depth_mm.astype(np.float32), cap.gradient.astype(np.float32)


def both(gradient):
    """The doubts of slopes of which none was inferred."""
    return np.repeat(slope_doubt(gradient)[..., None], 2, -1)


def exact(gradient, pitch, boundary, doubts=None, rests=None):
    """The minimum at full resolution, by a sparse solver."""
    height, width = gradient.shape[:2]
    ring = 1 if boundary == "dirichlet" else 0
    slopes = np.pad(gradient, ((ring, ring), (ring, ring), (0, 0))).astype(float)
    around = ((ring, ring), (ring, ring), (0, 0))
    doubts = np.pad(both(gradient) if doubts is None else doubts, around, constant_values=STILL)
    number = np.pad(np.arange(height * width).reshape(height, width), ring, constant_values=-1)
    rows, columns, values, wanted = [], [], [], []
    for axis in (1, 0):
        cut = np.s_[ring : slopes.shape[1 - axis] - ring]
        before, after = (
            (np.s_[cut, :-1], np.s_[cut, 1:]) if axis else (np.s_[:-1, cut], np.s_[1:, cut])
        )
        variance = doubts[..., 1 - axis].astype(float) ** 2
        root = np.sqrt(2 / (variance[before] + variance[after])).ravel()
        known = (slopes[before] + slopes[after])[..., 1 - axis].ravel() / 2
        start = len(wanted)
        wanted += list(root * known)
        for side, sign in ((before, -1), (after, 1)):
            at = number[side].ravel()
            inside = np.flatnonzero(at >= 0)
            rows += list(start + inside)
            columns += list(at[inside])
            values += list(sign * root[inside] / pitch[1 - axis])
    if rests is not None:
        at = np.flatnonzero(rests)
        rows += list(len(wanted) + np.arange(len(at)))
        columns += list(at)
        values += [np.sqrt(held_weight((height, width), pitch))] * len(at)
        wanted += [0.0] * len(at)
    matrix = sparse.csr_matrix((values, (rows, columns)), (len(wanted), height * width))
    if boundary == "neumann" and rests is None:  # a constant is free: let the first pixel's be zero
        matrix = sparse.vstack(
            [matrix, sparse.csr_matrix(([1.0], ([0], [0])), (1, height * width))]
        )
        wanted.append(0.0)
    depth = spsolve((matrix.T @ matrix).tocsc(), matrix.T @ np.array(wanted)).reshape(height, width)
    return depth if ring or rests is not None else depth - depth.mean()


def lacking(depth, gradient, pitch, boundary):
    """The sum that is to be least, of square pixels."""
    ring = 1 if boundary == "dirichlet" else 0
    slopes = np.pad(gradient, ((ring, ring), (ring, ring), (0, 0)))
    ringed, variance = np.pad(depth.astype(float), ring), np.square(slope_doubt(slopes))
    total = 0.0
    for axis, known in zip((1, 0), midpoint_slopes(slopes), strict=True):
        spread = np.diff(variance, axis=axis) / 2 + np.delete(variance, -1, axis)
        total += float(np.sum((known - np.diff(ringed, axis=axis) / pitch) ** 2 / spread))
    return total


def misread(gradient, rng):
    """A wall read too flat on one side, noise where the gel moved, none where it is still."""
    moved = np.linalg.norm(gradient, axis=-1, keepdims=True) > 0
    found = gradient + moved * rng.normal(0, 0.03, gradient.shape)
    found[..., 0] *= np.where(found[..., 0] > 0, 0.8, 1.0)
    return found.astype(np.float32)


@pytest.mark.parametrize("boundary", BORDERS)
@pytest.mark.parametrize("pitch", [(0.05, 0.05), (0.05, 0.065)])
def test_it_comes_close_to_the_minimum_at_full_resolution(boundary, pitch):
    truth, slopes = pressed_ball((160, 122), (60.0, 66.0), 22.0, pitch)
    found = misread(slopes, np.random.default_rng(0))
    free = integrate(found, pitch, boundary)
    wanted = exact(found, pitch, boundary)
    changed = wanted - free
    left = wanted - weighed_depth(free, found, pitch, boundary)
    assert np.abs(changed).max() > 0.02 * truth.max()
    assert np.sqrt(np.mean(left**2)) < 0.2 * np.sqrt(np.mean(changed**2))


@pytest.mark.parametrize("center_px", [(25.0, 22.0), (3.0, 22.0)])
def test_cells_as_small_as_pixels_give_the_minimum_itself(monkeypatch, center_px):
    monkeypatch.setattr("recon.integration.weighed.CELLS", 1000)
    monkeypatch.setattr("recon.integration.weighed.STEPS", 300)
    monkeypatch.setattr("recon.integration.weighed.ENOUGH", 1e-10)  # what lies below is rounding
    pitch = (0.05, 0.06)
    _, slopes = pressed_ball((60, 48), center_px, 14.0, pitch)
    found = misread(slopes, np.random.default_rng(1))
    for boundary in BORDERS:
        free = integrate(found, pitch, boundary)
        depth, wanted = weighed_depth(free, found, pitch, boundary), exact(found, pitch, boundary)
        np.testing.assert_allclose(depth, wanted, atol=2e-3 * wanted.max())


@pytest.mark.parametrize("boundary", BORDERS)
def test_gel_that_rests_is_held_at_zero_as_firmly_as_is_said(monkeypatch, boundary):
    monkeypatch.setattr("recon.integration.weighed.CELLS", 1000)
    monkeypatch.setattr("recon.integration.weighed.STEPS", 600)
    monkeypatch.setattr("recon.integration.weighed.ENOUGH", 1e-10)  # what lies below is rounding
    pitch = (0.05, 0.06)
    truth, slopes = pressed_ball((60, 48), (3.0, 22.0), 14.0, pitch)
    found = misread(slopes, np.random.default_rng(1))
    free, rests = integrate(found, pitch, boundary), truth == 0
    depth = weighed_depth(free, found, pitch, boundary, rests=rests)
    wanted = exact(found, pitch, boundary, rests=rests)
    np.testing.assert_allclose(depth, wanted, atol=2e-3 * wanted.max())
    assert np.abs(wanted - exact(found, pitch, boundary)).max() > 2 * np.abs(depth - wanted).max()


def bars(from_to_px, depths_mm, wall_px=10):
    """Depth and slopes of flat bars that cross a frame of 320 x 240 from top to bottom."""
    columns = np.arange(320.0)
    depth = np.zeros(320)
    for (left, right), deep in zip(from_to_px, depths_mm, strict=True):
        from_edge = np.minimum(columns - left, right - columns)
        depth = np.maximum(depth, deep * np.clip(from_edge / wall_px, 0, 1))
    depth = np.repeat(depth[None].astype(np.float32), 240, 0)
    return depth, np.stack([np.gradient(depth, 0.05, axis=1), np.zeros_like(depth)], -1)


def held_depth(slopes, pitch=(0.05, 0.05)):
    """Depth with a free border and what rests held, and what rests."""
    free = integrate(slopes, pitch, "neumann")
    rests = resting(slopes, free, 240 * pitch[1])
    return weighed_depth(free, slopes, pitch, "neumann", rests=rests), rests


@pytest.mark.parametrize("from_px", [30, 100, 150])
def test_gel_on_both_sides_of_what_crosses_the_frame_rests_alike(from_px):
    truth, slopes = bars([(from_px, from_px + 120)], [0.25])
    slopes[..., 0] *= np.where(slopes[..., 0] > 0, 0.8, 1.0)  # one wall is read too flat
    held, rests = held_depth(slopes)
    assert rests[:, [0, -1]].all() and not rests[truth > 0.1].any()
    loose = weighed_depth(
        integrate(slopes, (0.05, 0.05), "neumann"), slopes, (0.05, 0.05), "neumann"
    )
    loose -= np.median(loose[truth == 0])
    assert np.abs(held[:, [0, -1]]).max() < 0.3 * np.abs(loose[:, [0, -1]]).max()
    off, worse = (np.sqrt(np.mean((depth - truth) ** 2)) for depth in (held, loose))
    assert off < 0.9 * worse


@pytest.mark.parametrize("deep_mm", [0.1, 0.4, 2.0])
@pytest.mark.parametrize("places", [[(20, 130), (180, 300)], [(-50, 90), (180, 300)]])
def test_a_flat_top_does_not_rest_whatever_touches_beside_it(deep_mm, places):
    truth, slopes = bars(places, [0.3, deep_mm])
    held, rests = held_depth(slopes)
    assert rests[truth == 0].mean() > 0.9 and not rests[truth > 0.09].any()
    np.testing.assert_allclose(held, truth, atol=0.03 * truth.max())


@pytest.mark.parametrize("right_px", [120, 200, 270])
def test_a_plate_over_most_of_the_frame_is_pressed_in_and_the_gel_beside_it_rests(right_px):
    truth, slopes = bars([(-50, right_px)], [0.5])
    held, rests = held_depth(slopes)
    assert rests[truth == 0].mean() > 0.97 and not rests[truth > 0.1].any()
    np.testing.assert_allclose(held, truth, atol=0.03 * truth.max())


def test_a_speck_that_is_read_out_of_the_gel_does_not_say_where_it_rests():
    plate, _ = bars([(-50, 160)], [0.5])
    rows, columns = np.indices(plate.shape)
    away_px = np.maximum(np.abs(rows - 100), np.abs(columns - 60))
    read = plate - 0.9 * np.clip((13 - away_px) / 10, 0, 1).astype(np.float32)
    slopes = np.stack(np.gradient(read, 0.05)[::-1], -1)
    speck, bare = (away_px < 2), (plate == 0)
    assert (slopes[speck] == 0).all() and read[speck].max() < -0.3
    held, rests = held_depth(slopes)
    assert not rests[speck].any() and rests[bare].mean() > 0.97
    assert np.abs(held[bare]).max() < 0.03


def test_nothing_rests_where_no_gel_is_still():
    slopes = np.full((30, 40, 2), 0.1, np.float32)
    assert not resting(slopes, slopes[..., 0], 3.0).any()
    nothing = np.zeros((30, 40), bool)
    loose = weighed_depth(slopes[..., 0], slopes, (0.1, 0.1), "neumann")
    held = weighed_depth(slopes[..., 0], slopes, (0.1, 0.1), "neumann", rests=nothing)
    np.testing.assert_array_equal(held, loose)


@pytest.mark.parametrize("inferred", ["x", "y"])
def test_an_inferred_slope_counts_less_where_it_is_doubted(monkeypatch, inferred):
    monkeypatch.setattr("recon.integration.weighed.CELLS", 1000)
    monkeypatch.setattr("recon.integration.weighed.STEPS", 600)
    monkeypatch.setattr("recon.integration.weighed.ENOUGH", 1e-10)  # what lies below is rounding
    pitch = (0.05, 0.06)
    truth, slopes = pressed_ball((60, 48), (25.0, 22.0), 14.0, pitch)
    found, axis = slopes.copy(), "xy".index(inferred)
    found[..., axis] *= np.where(found[..., axis] > 0, 0.6, 1.0)
    doubt = np.float32(0.5) * (truth > 0)
    doubts = inferred_doubts(found, inferred, doubt)
    for boundary in BORDERS:
        free = integrate(found, pitch, boundary)
        depth = weighed_depth(free, found, pitch, boundary, doubts)
        wanted = exact(found, pitch, boundary, doubts)
        np.testing.assert_allclose(depth, wanted, atol=5e-3 * wanted.max())
    alike = weighed_depth(free, found, pitch, "neumann")
    off, worse = (np.abs(z - z.mean() - truth + truth.mean()).mean() for z in (depth, alike))
    assert off < 0.6 * worse


def test_steep_slopes_are_doubted_most_and_still_gel_least():
    slopes = np.array([[[0, 0], [0.01, 0], [0.3, -0.4], [0, 2]]], np.float32)
    assert (np.diff(slope_doubt(slopes)) > 0).all()


def test_doubts_of_two_axes_are_of_one_unit():
    slopes = np.array([[[0.0, 0.0], [0.3, 0.4], [0.3, 0.4]]], np.float32)
    doubt = np.array([[0.0, 0.0, 7 * MEASURED]], np.float32)
    along_x = inferred_doubts(slopes, "x", doubt)
    np.testing.assert_allclose(along_x[..., 1], slope_doubt(slopes))
    np.testing.assert_allclose(along_x[0, :2], both(slopes)[0, :2])
    assert along_x[0, 2, 0] == pytest.approx(np.hypot(7, slope_doubt(slopes)[0, 2]))
    along_y = inferred_doubts(slopes, "y", doubt)
    np.testing.assert_array_equal(along_y, along_x[..., ::-1])


def test_a_misread_wall_tilts_the_gel_around_it_no_more():
    pitch = (0.05, 0.05)
    truth, slopes = pressed_ball((320, 240), (150.0, 120.0), 50.0, pitch)
    found = slopes.copy()
    found[..., 0] *= np.where(found[..., 0] > 0, 0.8, 1.0)
    free = integrate(found, pitch, "dirichlet")
    weighed = weighed_depth(free, found, pitch, "dirichlet")
    around = truth == 0
    assert np.abs(weighed[around]).mean() < 0.3 * np.abs(free[around]).mean()
    assert np.abs(weighed - truth).mean() < np.abs(free - truth).mean()


@given(
    st.integers(1, 150),
    st.integers(1, 150),
    st.sampled_from(BORDERS),
    st.floats(0.0, 1.0),
)
@settings(max_examples=40, deadline=None)
def test_any_size_has_a_finite_answer_that_lacks_no_more(height, width, boundary, share):
    rng = np.random.default_rng(height)
    slopes = rng.normal(0, 0.5, (height, width, 2)).astype(np.float32)
    slopes *= rng.uniform(size=(height, width, 1)) < share
    free = integrate(slopes, (0.1, 0.1), boundary)
    found = weighed_depth(free, slopes, (0.1, 0.1), boundary)
    assert found.shape == free.shape and found.dtype == free.dtype and np.isfinite(found).all()
    assert lacking(found, slopes, 0.1, boundary) <= lacking(free, slopes, 0.1, boundary)


def test_nothing_beyond_a_free_border_has_weight():
    plane = np.full((101, 131, 2), (0.2, -0.1), np.float32)  # sides are no whole number of cells
    free = integrate(plane, (0.1, 0.1), "neumann")
    found = weighed_depth(free, plane, (0.1, 0.1), "neumann")
    np.testing.assert_allclose(found, free, atol=1e-3)


def test_blank_gel_stays_at_zero():
    flat = np.zeros((CELLS + 7, 90, 2), np.float32)
    for boundary in BORDERS:
        assert not weighed_depth(flat[..., 0], flat, (0.1, 0.1), boundary).any()


def test_one_doubt_everywhere_is_the_plain_integral(monkeypatch):
    monkeypatch.setattr("recon.integration.weighed.STILL", 1.0)
    monkeypatch.setattr("recon.integration.weighed.MORE_PER_SLOPE", 0.0)
    _, slopes = pressed_ball((160, 122), (60.0, 66.0), 22.0, (0.1, 0.1))
    found = misread(slopes, np.random.default_rng(3))
    for boundary in BORDERS:  # a zero border lies a few pixels farther off
        free = integrate(found, (0.1, 0.1), boundary)
        again = weighed_depth(free, found, (0.1, 0.1), boundary)
        np.testing.assert_allclose(again, free, atol=0.01 * free.max())


@pytest.mark.parametrize(("pitch", "side_mm"), [((0.1, 0.25), 12.0), ((0.25, 0.1), 9.0)])
def test_the_shorter_side_is_the_one_of_fewer_mm_not_of_fewer_pixels(pitch, side_mm):
    assert shorter_side_mm((90, 120), pitch) == pytest.approx(side_mm)
