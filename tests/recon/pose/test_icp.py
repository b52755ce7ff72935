# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""ICP knows how far off it is, though depth has noise that is alike over millimetres."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from typing import Literal, get_args

import cv2
import numpy as np
import pytest

from benchmarks.touches import (
    CONTACT_DEPTH_MM,
    SyntheticTouch,
    cube_corner,
    motions,
    pressed,
    shallow_texture,
)
from recon.integration.poisson import integrate
from recon.pose.gaps import gaps_between
from recon.pose.icp import MOST_POINTS, Icp
from recon.pose.noise import pixels
from recon.pose.registration import PRIOR
from recon.pose.rigid import Transform, inverse, motion, turn_and_shift
from tests.recon.pose.touched import coarse_bead, touch

Kind = Literal["PLANE_ICP", "GICP"]
FRAMES = 28
THINGS = {"cube corner": lambda: cube_corner(2.0), "shallow texture": shallow_texture}
every_kind = pytest.mark.parametrize("kind", get_args(Kind))
every_thing = pytest.mark.parametrize("thing", THINGS)


@cache
def still_and_moved(thing: str) -> tuple[SyntheticTouch, list[tuple[SyntheticTouch, Transform]]]:
    """A touch without noise, and some others of the same object, moved."""
    made = THINGS[thing]()
    moved = motions(np.random.default_rng(7), 4)
    return touch(made, np.eye(4), None), [(touch(made, pose, None), pose) for pose in moved]


def with_noise(exact: SyntheticTouch, noise: float, rng: np.random.Generator) -> SyntheticTouch:
    gradient = exact.gradient + noise * rng.standard_normal(exact.gradient.shape)
    depth = integrate(gradient, exact.mm_per_px, exact.boundary)
    return replace(
        exact,
        gradient=gradient.astype(np.float32),
        depth_mm=depth.astype(np.float32),
        contact=depth > CONTACT_DEPTH_MM,
    )


def errors(kind: Kind, thing: str, noise: float) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Twists by which poses are off, and their covariances."""
    rng = np.random.default_rng(0)
    registration = Icp(kind=kind)
    still, others = still_and_moved(thing)
    for number in range(FRAMES):
        other, pose = others[number % len(others)]
        first, second = (
            registration.prepare(with_noise(exact, noise, rng)) for exact in (still, other)
        )
        found = registration.align(first, second, np.eye(4))
        left = inverse(pose) @ found.T_current_reference
        yield turn_and_shift(left), found.covariance


@every_kind
@every_thing
@pytest.mark.parametrize("noise", [0.05, 0.1])
def test_errors_are_as_large_as_the_covariance_says(kind, thing, noise):
    twists, covariances = map(np.array, zip(*errors(kind, thing, noise), strict=True))
    squares = [
        twist @ np.linalg.solve(covariance, twist)
        for twist, covariance in zip(twists, covariances, strict=True)
    ]
    assert 0.55 < np.sqrt(np.mean(squares) / 6) < 1.5
    variances = np.diagonal(covariances, axis1=1, axis2=2)
    by_axis = np.sqrt(np.mean(twists**2 / variances, 0))
    assert by_axis.min() > 0.4 and by_axis.max() < 1.7


@every_kind
def test_a_third_of_the_points_tells_the_same_covariance(kind):
    rng = np.random.default_rng(3)
    still, _ = still_and_moved("shallow texture")
    first, second = (Icp(kind=kind).prepare(with_noise(still, 0.05, rng)) for _ in range(2))
    whole, third = (
        gaps_between(first, second, np.eye(4), gaussian=kind == "GICP", every=every).covariance(
            first, second, None
        )
        for every in (1, 3)
    )
    np.testing.assert_allclose(np.sqrt(np.diag(third) / np.diag(whole)), 1, atol=0.2)


@every_kind
def test_a_surface_that_is_nowhere_near_leaves_a_motion_as_unknown_as_before(kind):
    cloud = Icp(kind=kind).prepare(still_and_moved("cube corner")[0])
    away = motion(np.array([0, 0, 0, 0, 0, 9.0]))
    found = Icp(kind=kind).align(cloud, cloud, away)
    np.testing.assert_array_equal(found.covariance, PRIOR)
    np.testing.assert_array_equal(found.T_current_reference, away)


def test_of_a_large_contact_as_many_points_are_taken_as_can_be_and_all_over():
    touched = pressed(coarse_bead(), np.eye(4), None, size_px=(180, 75), mm_per_px=(0.1, 0.15))
    large = replace(touched, contact=np.ones_like(touched.contact))  # each third is in a column
    points = Icp(kind="GICP", spacing_mm=0.01).prepare(large).points
    assert MOST_POINTS / 2 < len(points) <= MOST_POINTS
    taken = np.zeros_like(large.contact)
    taken[pixels(points, taken.shape, large.mm_per_px)] = True
    assert taken.any(0).all() and taken.any(1).all()
    around = cv2.blur(taken.astype(np.float32), (15, 15))
    assert np.std(around) < 0.1 * len(points) / taken.size
