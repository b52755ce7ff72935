# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recon.ball import ball_cap, normals, offsets_mm

SIZE, CENTER, PITCH = (120, 90), (57.3, 41.8), (0.1, 0.12)


@st.composite
def caps(draw):
    contact_mm = draw(st.floats(0.8, 3.5))
    ball_mm = contact_mm / draw(st.floats(0.2, 0.9))
    return ball_cap(SIZE, CENTER, contact_mm, ball_mm, PITCH), contact_mm, ball_mm


def test_the_gradient_is_the_derivative_of_the_depth_at_second_order():
    errors = []
    for refinement in (1, 2, 4):
        size, pitch = (40 * refinement, 40 * refinement), (0.1 / refinement, 0.12 / refinement)
        cap = ball_cap(size, (20.0 * refinement, 19.0 * refinement), 1.8, 3.0, pitch)
        numeric = np.stack(np.gradient(cap.depth_mm, pitch[1], pitch[0])[::-1], -1)
        x, y = offsets_mm(size, (20.0 * refinement, 19.0 * refinement), pitch)
        inner = np.hypot(x, y) < 1.4
        errors.append(np.abs(numeric - cap.gradient)[inner].max())
    assert np.log2(np.divide(errors[:-1], errors[1:])).min() >= 1.8, errors


@given(caps())
def test_depth_is_a_sphere_that_starts_at_the_rim(made):
    cap, contact_mm, ball_mm = made
    x, y = offsets_mm(SIZE, CENTER, PITCH)
    below_rim = cap.depth_mm[cap.contact] + np.sqrt(ball_mm**2 - contact_mm**2)
    np.testing.assert_allclose((x**2 + y**2)[cap.contact] + below_rim**2, ball_mm**2)
    assert (cap.depth_mm[cap.contact] > 0).all()
    assert not cap.depth_mm[~cap.contact].any() and not cap.gradient[~cap.contact].any()
    np.testing.assert_array_equal(cap.contact, np.hypot(x, y) < contact_mm)


@given(caps())
def test_normals_are_unit_vectors_across_both_tangents(made):
    cap = made[0]
    normal = cap.normal
    np.testing.assert_allclose(np.linalg.norm(normal, axis=-1), 1)
    along_x, along_y = np.zeros((2, *normal.shape))
    along_x[..., 0] = along_y[..., 1] = 1  # a skin point is (x, y, -depth)
    along_x[..., 2], along_y[..., 2] = -cap.gradient[..., 0], -cap.gradient[..., 1]
    np.testing.assert_allclose((normal * along_x).sum(-1), 0, atol=1e-12)
    np.testing.assert_allclose((normal * along_y).sum(-1), 0, atol=1e-12)
    assert (normal[..., 2] > 0).all()


@given(caps())
def test_inside_the_contact_normals_point_to_the_balls_centre(made):
    cap, contact_mm, ball_mm = made
    x, y = offsets_mm(SIZE, CENTER, PITCH)
    up = np.sqrt(ball_mm**2 - contact_mm**2) + cap.depth_mm  # the centre, above a skin point
    toward = np.stack([-x, -y, up], -1) / ball_mm
    np.testing.assert_allclose(cap.normal[cap.contact], toward[cap.contact], atol=1e-12)


@pytest.mark.parametrize(("contact_mm", "ball_mm"), [(2.0, 2.2), (3.0, 4.0), (1.5, 10.0)])
def test_the_volume_is_that_of_a_spherical_cap(contact_mm, ball_mm):
    pitch = (0.02, 0.025)
    cap = ball_cap((400, 320), (201.2, 160.7), contact_mm, ball_mm, pitch)
    depth_mm = ball_mm - np.sqrt(ball_mm**2 - contact_mm**2)
    volume_mm3 = np.pi * depth_mm**2 * (3 * ball_mm - depth_mm) / 3
    assert cap.depth_mm.sum() * pitch[0] * pitch[1] == pytest.approx(volume_mm3, rel=1e-3)


@pytest.mark.parametrize("contact_mm", [4.0, 4.5, 0.0, -1.0, float("nan")])
def test_a_contact_circle_that_is_no_circle_of_the_ball_is_refused(contact_mm):
    with pytest.raises(ValueError, match="contact circle"):
        ball_cap(SIZE, CENTER, contact_mm, 4.0, PITCH)


def test_flat_gel_has_upright_normals():
    np.testing.assert_array_equal(normals(np.zeros((2, 3, 2)))[1, 2], [0, 0, 1])


def test_offsets_grow_along_columns_and_rows():
    x, y = offsets_mm((5, 4), (1.0, 2.0), (0.5, 0.25))
    assert x.shape == y.shape == (4, 5)
    assert x[0, 3] == 1.0 and y[3, 0] == 0.25 and x[2, 1] == y[2, 1] == 0
