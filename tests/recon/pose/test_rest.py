# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A curved gel: what its skin is at rest, and objects that travel over it without turning."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from benchmarks.pose_search import polyhedron
from benchmarks.touches import SyntheticTouch, pressed
from recon.integration.poisson import integrate
from recon.pose.joint import Joint
from recon.pose.mesh import averaged, render
from recon.pose.models import MeshModel
from recon.pose.pyramid import Pyramid
from recon.pose.registration import own, pixel_grid_mm
from recon.pose.rest import laid, lifted, rest_at, rest_of, tangent
from recon.pose.rigid import angle_deg, applied, inverse, rigid, shift_mm
from recon.pose.rim import rim
from recon.pose.tracker import REGISTRATIONS, Tracker
from sensor.design import STANDARD, Gel
from sensor.errors import WedgeError
from tests.recon.pose.touched import coarse_bead, corner, touches

GEL = STANDARD.gel
SIZE_PX, MM_PER_PX, FINE = (160, 120), (0.2, 0.19), (0.1268, 0.1268)
FLAT = replace(GEL, curved=False)


@given(x_mm=st.floats(-17, 17), y_mm=st.floats(-12.75, 12.75))
def test_the_skin_at_rest_is_the_design_s_and_its_slopes_are_those_of_its_depth(x_mm, y_mm):
    step_mm = 1e-4
    x, y = np.array([[x_mm, x_mm + step_mm, x_mm], [y_mm, y_mm, y_mm + step_mm]])
    depth_mm, slopes = rest_at(GEL, x, y)
    assert depth_mm[0] == pytest.approx(GEL.thickness_mm - GEL.thickness_at_mm(x_mm, y_mm))
    np.testing.assert_allclose(slopes[0], (depth_mm[1:] - depth_mm[0]) / step_mm, atol=1e-5)
    np.testing.assert_array_equal(rest_at(FLAT, x, y)[0], 0)


def test_what_is_laid_on_a_gel_can_be_lifted_and_is_laid_once():
    touch = own(corner())
    on_gel = laid(touch, GEL)
    height, width = touch.depth_mm.shape
    rest = rest_of(GEL, (width, height), touch.mm_per_px)
    np.testing.assert_allclose(on_gel.depth_mm, touch.depth_mm + rest.depth_mm)
    again = lifted(on_gel)
    np.testing.assert_allclose(again.gradient, touch.gradient, atol=1e-6)
    np.testing.assert_allclose(again.depth_mm, touch.depth_mm, atol=1e-6)
    assert laid(on_gel, GEL) is on_gel
    assert laid(touch, None) is touch and laid(touch, FLAT) is touch and lifted(touch) is touch


@cache
def journey() -> list[tuple[SyntheticTouch, np.ndarray]]:
    """A bead carried from the pad's middle across, always pressed in as deep, and never turned."""
    rng, seen = np.random.default_rng(4), []
    for y_mm in np.linspace(-0.2, 3.8, 5):
        fallen = float(rest_at(GEL, np.zeros(1), np.array([y_mm]))[0][0])
        pose = rigid(np.eye(3), np.array([0.0, y_mm, -fallen]))
        touch = pressed(coarse_bead(), pose, rng, size_px=SIZE_PX, mm_per_px=FINE, gel=GEL)
        seen.append((touch, pose))
    return seen


def left_after(name: str, gel: Gel | None) -> np.ndarray:
    """How far off the bead's pose is at its journey's end."""
    track = Tracker(name, T_sensor_object=journey()[0][1], gel=gel)
    *_, found = (track(touch) for touch, _ in journey())
    assert found.T_sensor_object is not None
    return inverse(journey()[-1][1]) @ found.T_sensor_object


@pytest.mark.parametrize("name", REGISTRATIONS)
def test_what_travels_over_a_curved_gel_does_not_turn(name):
    left = left_after(name, GEL)
    assert angle_deg(left) < 1 and shift_mm(left) < 0.06


def test_on_a_gel_that_is_taken_for_flat_it_seems_to_turn():
    seems_deg = np.degrees(4.0 / 60)  # on the gel's radius across the finger
    assert angle_deg(left_after("joint", None)) == pytest.approx(seems_deg, abs=1.5)


def test_a_mesh_touches_a_curved_gel_where_it_reaches_it():
    mesh = polyhedron(np.random.default_rng(5))
    low_mm = applied(rigid(np.eye(3), np.zeros(3)), mesh.vertices_mm)[:, 2].min()
    x_mm, y_mm = np.meshgrid(*pixel_grid_mm(SIZE_PX, MM_PER_PX))
    pose = rigid(np.eye(3), np.array([5.0, 6.0, -1.5 - low_mm]))
    flat, on_gel = (render(mesh, pose, SIZE_PX, MM_PER_PX, gel) for gel in (None, GEL))
    rest_mm, _ = rest_at(GEL, x_mm, y_mm)
    assert on_gel.contact.any() and on_gel.contact.sum() < flat.contact.sum()
    np.testing.assert_allclose(on_gel.depth_mm, np.maximum(flat.depth_mm, rest_mm), atol=1e-5)
    assert not lifted(on_gel).depth_mm[~flat.contact].any()


def test_a_mesh_is_found_away_from_the_middle_of_a_curved_gel():
    mesh = polyhedron(np.random.default_rng(7))
    turn = Rotation.from_euler("xyz", (20, -35, 50), degrees=True).as_matrix()
    low = (mesh.vertices_mm @ turn.T)[(mesh.vertices_mm @ turn.T)[:, 2].argmin()]
    place = np.array([2.0, 6.0])
    fallen = float(rest_at(GEL, place[:1], place[1:])[0][0])
    pose = rigid(turn, np.array([*(place - low[:2]), -1.3 - fallen - low[2]]))
    shown = lifted(averaged(mesh, pose, SIZE_PX, MM_PER_PX, GEL))
    noise = 0.03 * np.random.default_rng(1).standard_normal(shown.gradient.shape)
    gradient = (shown.gradient + noise).astype(np.float32)
    depth_mm = integrate(gradient, MM_PER_PX, "dirichlet").astype(np.float32)
    touch = laid(replace(shown, gradient=gradient, depth_mm=depth_mm), GEL)
    model = MeshModel(mesh=mesh, registration=Joint())
    (_, guess), (_, of_flat) = (next(model.guesses(one)) for one in (touch, lifted(touch)))
    np.testing.assert_allclose(guess, tangent(touch) @ of_flat, atol=1e-3)
    assert model.near(pose, touch).pyramid.touch.gel == GEL
    found = Tracker("joint", model, gel=GEL)(lifted(touch))
    assert found.words == "tracking"
    left = inverse(pose) @ found.T_sensor_object
    assert angle_deg(left) < 1 and shift_mm(left) < 0.15


def test_the_plane_of_a_contact_touches_the_gel_there():
    np.testing.assert_array_equal(tangent(own(corner())), np.eye(4))
    touch = laid(own(journey()[0][0]), GEL)
    points = applied(tangent(touch), np.array([[0, -0.2, 0], [1, -0.2, 0], [0, 0, 0]], float))
    rest_mm, _ = rest_at(GEL, points[:, 0], points[:, 1])
    np.testing.assert_allclose(points[:, 2], -rest_mm, atol=6e-3)


def test_a_model_on_another_gel_is_refused():
    seen = [(corner(), np.eye(4))]
    Tracker("joint", touches(seen, Joint(), GEL), gel=GEL)
    with pytest.raises(WedgeError, match="on another gel"):
        Tracker("joint", touches(seen, Joint()), gel=GEL)
    with pytest.raises(WedgeError, match="on another gel"):
        Tracker("joint", touches(seen, Joint(), GEL))


def test_the_rim_stands_as_high_above_the_middle_wherever_the_bead_is():
    (before, start), *_, (after, end) = journey()
    reference, current = (Pyramid(laid(own(touch), GEL)) for touch in (before, after))
    everywhere = np.ones(len(reference.templates[0].points), bool)
    found = rim(reference, current, everywhere, end @ inverse(start))
    rest_mm, _ = rest_at(GEL, np.zeros(1), end[1:2, 3])
    assert found is not None and abs(np.median(found.residual)) < rest_mm[0] / 5
