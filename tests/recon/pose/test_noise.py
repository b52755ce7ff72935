# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Errors that neighbouring pixels share: they are measured, and poses state what they do."""

from dataclasses import replace
from functools import cache
from statistics import fmean

import numpy as np
import pytest

from benchmarks.pose_doubt import Step, by_axis, errors_of, smooth_noise, square, with_errors
from benchmarks.touches import SyntheticTouch, cube_corner, motions, shallow_texture
from recon.contact.disturbed import boundary_of
from recon.integration.poisson import integrate
from recon.pose.cells import LENGTHS_MM, cell_px, coarse, noise_between
from recon.pose.noise import depth_variances, pixels, sums_in_waves, wave_variances
from recon.pose.pyramid import Pyramid, still_window
from recon.pose.registration import pixel_grid_mm
from recon.pose.rigid import motion
from recon.pose.tracker import REGISTRATIONS
from tests.recon.pose.touched import MM_PER_PX, coarse_bead, touch

THINGS = {
    "cube corner": lambda: cube_corner(2.0),
    "shallow texture": shallow_texture,
    "bead": coarse_bead,
}
FRAMES, MOTIONS, ALIKE_PX = 8, 4, 4.0
every_length = pytest.mark.parametrize("number", range(len(LENGTHS_MM)))


def length_px(number: int) -> float:
    return LENGTHS_MM[number] / MM_PER_PX[0]


@cache
def steps(thing: str) -> list[Step]:
    first = touch(THINGS[thing](), np.eye(4), None)
    moves = motions(np.random.default_rng(7), MOTIONS)
    return [
        Step(first=first, second=touch(THINGS[thing](), moved, None), moved=moved)
        for moved in moves
    ]


@pytest.mark.parametrize("thing", THINGS)
@pytest.mark.parametrize("tracker", REGISTRATIONS)
def test_errors_that_pixels_share_are_stated(thing, tracker):
    found = list(errors_of(REGISTRATIONS[tracker], steps(thing), ALIKE_PX, FRAMES))
    assert 0.3 < fmean(square(*item) for item in found) < 2
    assert by_axis(found).max() < 4


@pytest.mark.parametrize("shift_mm", [(0.0, 0.0), (0.0, 7.0), (-9.5, -7.0)])
def test_pulls_of_errors_are_stated_also_where_the_frame_cuts_the_contact_off(shift_mm):
    still = touch(coarse_bead(), motion(np.array([0, 0, 0, *shift_mm, 0])), None)
    pyramid, number = Pyramid(still), 2
    template = pyramid.templates[min(pyramid.templates)]
    x_mm, y_mm = pixel_grid_mm(still.contact.shape[::-1], MM_PER_PX)
    column, row = (
        np.rint((template.points[:, axis] - grid[0]) / MM_PER_PX[axis]).astype(int)
        for axis, grid in ((0, x_mm), (1, y_mm))
    )
    window = still_window(still.contact)
    beside = np.ones_like(still.contact[window])
    beside[1:-1, 1:-1] = False
    beside &= ~still.contact[window]
    rng, drawn = np.random.default_rng(0), []
    for _ in range(80):
        errors = smooth_noise(rng, still.contact.shape, length_px(number))
        depth = integrate(errors, MM_PER_PX, boundary_of(still.contact))
        along_y, along_x = np.gradient(depth, MM_PER_PX[1], MM_PER_PX[0])
        height = template.depth_weight * (depth - depth[window][beside].mean())
        parts = [part[row, column] for part in (along_x, along_y, height)]
        drawn.append(np.einsum("cn,kcn->k", parts, template.change))
    stated = np.diag(pyramid.pulls(1.0)[number])
    share = np.mean(np.square(drawn), axis=0) / stated
    assert 0.4 < share.min() and share.max() < 2


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_pulls_are_summed_once_for_every_share_of_the_depths(share, monkeypatch):
    """The share differs from frame to frame, and each sum would stay in memory."""
    still = touch(coarse_bead(), np.eye(4), None)
    pyramid, other = Pyramid(still), Pyramid(still)
    pyramid.pulls(0.7)
    weak = {
        index: replace(item, depth_weight=share * item.depth_weight)
        for index, item in other.templates.items()
    }
    monkeypatch.setattr(other, "templates", weak)
    wanted = other.pulls(1.0)
    monkeypatch.setattr("recon.pose.pyramid.sums_in_waves", None)
    np.testing.assert_allclose(pyramid.pulls(share), wanted, atol=1e-9 * np.abs(wanted).max())


def two(number: int) -> tuple[SyntheticTouch, SyntheticTouch]:
    """The bead and a moved one, with errors of deviation 0.05."""
    rng, step = np.random.default_rng(1), steps("bead")[0]
    first, second = (
        with_errors(exact, 0.05 * smooth_noise(rng, exact.contact.shape, length_px(number)))
        for exact in (step.first, step.second)
    )
    return first, second


def of_long_waves(variances: np.ndarray) -> float:
    """Variance of errors' sum over a wide area, per area, in mm^2."""
    areas = 4 * np.pi * np.square(LENGTHS_MM)
    areas[0] = MM_PER_PX[0] * MM_PER_PX[1]
    return float(variances @ areas)


@every_length
def test_how_far_errors_reach_shows_beside_the_contact(number):
    found = noise_between(*map(coarse, two(number)), steps("bead")[0].moved)
    assert found is not None
    true = 2 * 0.05**2 * np.eye(len(LENGTHS_MM))[number]
    assert 0.5 < of_long_waves(found) / of_long_waves(true) < 2


@every_length
def test_it_shows_within_a_contact_where_gel_beside_is_taken_for_flat(number):
    height, width = steps("bead")[0].first.contact.shape
    rows, columns = np.indices((height, width))
    near = np.hypot(rows - height / 2, columns - width / 2) < 38
    flat = [replace(seen, gradient=seen.gradient * near[..., None]) for seen in two(number)]
    assert all(not (seen.contact & ~near).any() for seen in flat)
    found = noise_between(*map(coarse, flat), steps("bead")[0].moved)
    assert found is not None
    true = 2 * 0.05**2 * np.eye(len(LENGTHS_MM))[number]
    assert 1 / 3 < of_long_waves(found) / of_long_waves(true) < 3


def test_the_noisier_of_a_contact_and_the_gel_beside_counts():
    def found(within: float, beside: float) -> float:
        rng, step = np.random.default_rng(1), steps("bead")[0]
        pair = []
        for exact in (step.first, step.second):
            size = np.where(exact.contact, within, beside)[..., None].astype(np.float32)
            errors = smooth_noise(rng, exact.contact.shape, length_px(1))
            pair.append(with_errors(exact, size * errors))
        known = noise_between(*map(coarse, pair), step.moved)
        assert known is not None
        return of_long_waves(known)

    little = found(0.01, 0.01)
    assert found(0.01, 0.05) > 10 * little
    assert found(0.05, 0.01) > 2 * little


def test_without_any_errors_nobody_knows():
    step = steps("bead")[0]
    cells = coarse(step.first)
    assert noise_between(cells, cells, np.eye(4)) is None


@every_length
def test_sums_vary_as_integration_makes_them(number):
    height, width = 60, 80
    x_mm, y_mm = np.meshgrid(*pixel_grid_mm((width, height), MM_PER_PX))
    away = np.hypot(x_mm - 1, y_mm)
    inside = away < 2.5
    points = np.stack([x_mm[inside], y_mm[inside], 0 * x_mm[inside]], -1)
    depths = np.stack([np.ones(len(points)), points[:, 0], np.cos(3 * points[:, 1])], -1)
    slopes = np.stack([points[:, 1], points[:, 0] - 1, np.ones(len(points))], -1)
    fading = np.cos(np.pi / 5 * away[inside])[:, None] ** 2
    shares = np.stack([slopes, slopes[:, ::-1], 0.5 * depths]) * fading
    if number == 0:  # within cells, white noise of slopes is not followed
        shares = shares[2:]
    waves = sums_in_waves(points, shares, (height, width), MM_PER_PX)
    stated = (waves * wave_variances((height, width), MM_PER_PX)[number]) @ waves.T
    rng = np.random.default_rng(0)
    drawn = []
    for _ in range(600):
        errors = smooth_noise(rng, (height, width), length_px(number))
        depth = integrate(errors, MM_PER_PX, "dirichlet")
        along_y, along_x = np.gradient(depth, MM_PER_PX[1], MM_PER_PX[0])
        parts = [part[inside] for part in (along_x, along_y, depth)][-len(shares) :]
        drawn.append(sum(part @ share for part, share in zip(parts, shares, strict=True)))
    scale = np.sqrt(np.diag(stated))
    seen = (np.array(drawn) / scale).T @ (np.array(drawn) / scale) / len(drawn)
    np.testing.assert_allclose(seen, stated / np.outer(scale, scale), atol=0.2)


OBLONG, OBLONG_MM = (24, 30), (0.5, 0.8)


@pytest.mark.parametrize("place", [(3, 4), (12, 20), (23, 29)])
def test_one_depth_varies_as_the_sum_of_it_alone_on_oblong_pixels(place):
    assert cell_px(OBLONG_MM) == (1, 1)
    x_mm, y_mm = pixel_grid_mm(OBLONG[::-1], OBLONG_MM)
    point = np.array([[x_mm[place[1]], y_mm[place[0]], 0.0]])
    wave = sums_in_waves(point, np.ones((1, 1, 1)), OBLONG, OBLONG_MM)[0]
    stated = wave_variances(OBLONG, OBLONG_MM) @ wave**2
    whole = depth_variances(OBLONG, OBLONG_MM)[:, *place]
    np.testing.assert_allclose(stated[1:], whole[1:])


def test_depths_of_the_transposed_frame_vary_as_those_of_the_frame():
    whole, turned = (depth_variances(OBLONG[::n], OBLONG_MM[::n]) for n in (1, -1))
    np.testing.assert_allclose(whole, turned.transpose(0, 2, 1))


def test_points_on_the_frame_s_edge_and_beyond_it_are_of_its_outermost_pixels():
    half_mm = np.multiply(OBLONG[::-1], OBLONG_MM) / 2
    points = np.outer([-2, -1, 1, 2], [*half_mm, 0])
    rows, columns = pixels(points, OBLONG, OBLONG_MM)
    assert (rows.tolist(), columns.tolist()) == ([0, 0, 23, 23], [0, 0, 29, 29])
