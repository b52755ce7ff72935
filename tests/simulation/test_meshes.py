# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Parts given as triangles are pressed in like what has the same underside in closed form."""

from itertools import pairwise
from multiprocessing.reduction import ForkingPickler

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from recon.pose.mesh import Mesh, render
from recon.pose.rigid import rigid
from sensor.design import FINGER, STANDARD
from sensor.errors import WedgeError
from simulation.dataset import presses_of
from simulation.indenters import calibration_ball
from simulation.meshes import MOST_LAYERS, part_of
from simulation.presses import Press, skin_under
from simulation.skin import SMALLEST_MM, View, gel_view

VIEW = View(size_px=(161, 121), mm_per_px=(0.05, 0.05))  # one pixel's middle is the pad's
X, Y = VIEW.grid_mm
BALL = calibration_ball()
FACES = 256


def turned(profile_mm: np.ndarray, faces: int = FACES) -> np.ndarray:
    """Triangles of what a line of (radius, z) sweeps around z, inside the round thing."""
    azimuth = 2 * np.pi * np.arange(faces + 1) / faces
    around = np.stack([np.cos(azimuth), np.sin(azimuth), np.ones_like(azimuth)], axis=1)
    rings = around[None] * profile_mm[:, [0, 0, 1]][:, None]
    quads = [
        np.stack([[a[:-1], a[1:], b[1:]], [a[:-1], b[1:], b[:-1]]]) for a, b in pairwise(rings)
    ]
    return np.concatenate([quad.transpose(0, 2, 1, 3).reshape(-1, 3, 3) for quad in quads])


def sphere(radius_mm: float) -> np.ndarray:
    polar = np.linspace(0, np.pi, FACES // 2 + 1)
    return turned(radius_mm * np.stack([np.sin(polar), -np.cos(polar)], axis=1))


def box(low: tuple[float, ...], high: tuple[float, ...]) -> np.ndarray:
    places = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))]
    return (np.array(low) + places * np.subtract(high, low))[np.array(triangles)]


def polyhedron(seed: int) -> np.ndarray:
    corners = np.random.default_rng(seed).uniform(-2, 2, (14, 3))
    return corners[ConvexHull(corners).simplices]


@pytest.mark.parametrize("depth_mm", [0.2, 0.7])
def test_a_sphere_dents_the_gel_like_the_ball_but_for_its_facets(depth_mm) -> None:
    # Facets lie inside the ball by no more than two sagittas, upright by 1 / cos of the slope, and
    # the skin moves no farther than what presses it.
    view = gel_view(STANDARD, 320)
    part = part_of(sphere(BALL.round_mm), depth_mm)
    inside_mm = 2 * BALL.round_mm * (1 - np.cos(np.pi / FACES))
    off_mm = inside_mm / (1 - depth_mm / BALL.round_mm)
    skins = [
        skin_under(
            STANDARD,
            view,
            Press(name="it", indenter=thing, center_mm=(0.0, 0.0), depth_mm=depth_mm),
        )
        for thing in (part, BALL)
    ]
    differs = skins[1].depth_mm - skins[0].depth_mm
    assert skins[0].depth_mm.max() == pytest.approx(depth_mm, abs=0.02)
    assert np.abs(differs).max() < off_mm + SMALLEST_MM
    chord_mm = 2 * np.sqrt(2 * BALL.round_mm * depth_mm - depth_mm**2)
    assert part.size_mm == pytest.approx((chord_mm, chord_mm), abs=8 * inside_mm)


def test_a_tilted_face_has_its_height_at_every_pixel_and_ends_at_its_edges() -> None:
    # Its sides, and the diagonal of its face, run through pixels' middles.
    prism = box((-1.5, -1.5, 0.0), (1.5, 1.5, 2.0))
    prism[..., 2] += 0.3 * prism[..., 0] - 0.1 * prism[..., 1]
    part = part_of(prism, 3.0)
    inside = np.maximum(np.abs(X), np.abs(Y)) < 1.5 + 1e-9
    height = part.profile(X, Y)
    assert np.isfinite(height).sum() == inside.sum() == 61**2
    np.testing.assert_allclose(height[inside], (0.3 * X - 0.1 * Y)[inside] + 0.6, atol=1e-9)
    assert part.size_mm == pytest.approx((3.0, 3.0))


def test_what_is_less_than_the_depth_above_the_lowest_point_goes_to_the_middle() -> None:
    # A wedge's edge at x = 40 under a body that no pad has room for.
    body = box((-50.0, -50.0, 1.0), (50.0, 50.0, 60.0))
    edge = np.array([[[40, -2, 0], [42, -2, 1], [38, -2, 1]], [[40, 2, 0], [42, 2, 1], [38, 2, 1]]])
    flanks = [[edge[0, 0], edge[1, 0], edge[1, i]] for i in (1, 2)]
    flanks += [[edge[0, 0], edge[0, i], edge[1, i]] for i in (1, 2)]
    part = part_of(np.concatenate([body, edge, flanks]), 0.4)
    assert part.size_mm == pytest.approx((2 * 0.8, 4.0))
    height = part.profile(X, Y)
    under = (np.abs(Y) < 1.99) & (np.abs(X) < 2)
    np.testing.assert_allclose(height[under], np.abs(X)[under] / 2, atol=1e-9)
    assert (height[np.abs(Y) > 2.01] == 1).all()
    (press,) = presses_of(FINGER, part, count=1, seed=0)
    assert (press.name, press.center_mm, press.depth_mm) == ("part", (0, 0), 0.4)


def test_a_tube_leaves_its_hole_open() -> None:
    tube = turned(np.array([[2.0, 0], [2, 3], [1, 3], [1, 0], [2, 0]]))
    height = part_of(tube).profile(X, Y)
    away = np.hypot(X, Y)
    sagitta_mm = 2 * (1 - np.cos(np.pi / FACES))
    assert (height[(away > 1) & (away < 2 - sagitta_mm)] == 0).all()
    assert (height[(away < 1 - sagitta_mm) | (away > 2)] == np.inf).all()


def test_through_a_hole_in_a_face_the_next_one_is_pressed_in() -> None:
    part = part_of(np.concatenate([box((-2, -1, 0), (-1, 1, 2)), box((1, -1, 0), (2, 1, 2)),
                                   box((-2, -1, 0.3), (2, 1, 2))]), 0.5)  # fmt: skip
    height = part.profile(X, Y)
    within = np.abs(Y) < 0.99
    assert np.allclose(height[within & (np.abs(X) < 0.99)], 0.3)
    assert np.allclose(height[within & (np.abs(X) > 1.01) & (np.abs(X) < 1.99)], 0)


@pytest.mark.parametrize("seed", range(3))
def test_winding_and_order_and_open_backs_and_places_do_not_matter(seed) -> None:
    rng = np.random.default_rng(seed)
    triangles = polyhedron(seed)
    height = part_of(triangles).profile(X, Y)
    mixed = rng.permutation(triangles)[:, rng.permutation(3)]
    np.testing.assert_allclose(part_of(mixed).profile(X, Y), height, atol=1e-9)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    outward = np.sign((normals * triangles.mean(axis=1)).sum(axis=1)) * normals[:, 2]
    np.testing.assert_allclose(part_of(triangles[outward < 0]).profile(X, Y), height, atol=1e-9)
    far = part_of(triangles + np.array([700.0, -300.0, 50.0])).profile(X, Y)
    np.testing.assert_allclose(far, height, atol=1e-6)


def test_a_part_lies_in_the_pose_whose_axes_are_the_gel_s() -> None:
    tip, rim = np.zeros(3), np.array([[-1.0, -2, 2], [4, -1, 2], [1, 3, 2]])
    corners = np.array([tip, *rim]) + np.array([5.0, -3, 7])
    mesh = Mesh(
        vertices_mm=corners, triangles=np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 2, 3]])
    )
    # Two fifths of the way up, x goes from -0.4 to 1.6 and y from -0.8 to 1.2.
    pose = rigid(np.eye(3), -np.array([5 + 0.6, -3 + 0.2, 7 + 0.8]))
    part = part_of(corners[mesh.triangles], 0.8)
    drawn = render(mesh, pose, VIEW.size_px, VIEW.mm_per_px)
    assert drawn.depth_mm.max() > 0.7
    reach = np.maximum(0.8 - part.profile(X, Y), 0)
    np.testing.assert_allclose(drawn.depth_mm, reach, atol=1e-6)


@pytest.mark.parametrize(
    ("triangles", "depth_mm", "words"),
    [
        (box((0, 0, 0), (14, 4, 1)), 0.5, "part of 14 x 4 mm is larger than the pad"),
        (box((0, 0, 0), (0, 4, 1)), 0.5, "part of 0 x 4 mm must be larger than zero"),
        (box((0, 0, 0), (4, 4, 9)), 2.0, "goes through the gel, which is 2 mm thick"),
        (polyhedron(0), 0.0, "deeper than zero"),
        (polyhedron(0), -1.0, "deeper than zero"),
        (polyhedron(0), np.nan, "deeper than zero"),
        (polyhedron(0), np.inf, "finite"),
        (polyhedron(0), 1e-5, "does not reach 0.001 mm"),
        (np.repeat(box((0, 0, 0), (9, 9, 9)), MOST_LAYERS, axis=0), 0.5, "simplify it"),
    ],
)
def test_a_part_that_cannot_be_pressed_in_is_refused(triangles, depth_mm, words) -> None:
    with pytest.raises(WedgeError, match=words):
        presses_of(FINGER, part_of(triangles, depth_mm), count=1, seed=0)


def test_other_processes_can_press_it_toward_the_corners_too() -> None:
    presses = presses_of(FINGER, part_of(polyhedron(1)), count=1, seed=0, off_center=0.5)
    assert len({press.name for press in presses}) == len(presses) == 4
    ForkingPickler.dumps(presses)
