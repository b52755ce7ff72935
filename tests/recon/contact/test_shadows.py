# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from recon.contact.shadows import GRAZING, cast_shadows

SIZE, PITCH = (100, 140), (0.1, 0.1)
DARK = np.full((*SIZE, 3), -0.1, np.float32)


def block(depth_mm=0.6):
    depth = np.zeros(SIZE)
    depth[40:60, 60:80] = depth_mm
    return depth


@pytest.mark.parametrize("depth_mm", [0.3, 0.6])
def test_a_shadow_lies_behind_what_casts_it_as_long_as_the_light_is_low(depth_mm):
    found = cast_shadows(DARK, block(depth_mm), {"G": 180.0}, PITCH)
    rows, columns = np.nonzero(found[..., 1])
    assert not found[..., [0, 2]].any()
    assert (rows.min(), rows.max()) == (40, 59)
    assert columns.min() >= 80  # green comes from the left
    assert columns.max() - 79 == pytest.approx(depth_mm / GRAZING / 0.1, abs=2)


def test_shadows_turn_with_their_lights():
    lights = {"R": 0.0, "G": 180.0}
    found = cast_shadows(DARK, block(), lights, PITCH)
    np.testing.assert_array_equal(found[..., 0], found[:, ::-1, 1])
    turned = cast_shadows(DARK.transpose(1, 0, 2), block().T, {"R": 90.0}, PITCH)
    np.testing.assert_array_equal(turned[..., 0].T, found[..., 0])


def test_neither_bright_nor_flat_nor_gentle_skin_is_in_shadow():
    lights = {"R": 90.0, "G": 180.0, "B": -90.0}
    assert not cast_shadows(-DARK, block(), lights, PITCH).any()
    assert not cast_shadows(DARK, 0 * block(), lights, PITCH).any()
    rows, columns = np.indices(SIZE)
    gentle = np.maximum(1 - 0.8 * GRAZING * np.hypot(rows - 50, columns - 70) * 0.1, 0)
    assert not cast_shadows(DARK, gentle, lights, PITCH).any()
    assert not cast_shadows(DARK, block(), {}, PITCH).any()


def test_uneven_pixels_give_the_same_shadow_in_millimetres():
    fine = cast_shadows(DARK, block(), {"R": 0.0}, (0.05, 0.1))[..., 0].sum() * 0.05
    coarse = cast_shadows(DARK, block(), {"R": 0.0}, (0.1, 0.1))[..., 0].sum() * 0.1
    assert fine == pytest.approx(coarse, rel=0.1)


@pytest.mark.parametrize("pitch", [(0.05, 0.1), (0.1, 0.05)])
@pytest.mark.parametrize("azimuth_deg", [0.0, 90.0])
def test_a_shadow_is_as_long_along_either_axis_of_oblong_pixels(pitch, azimuth_deg):
    rows, columns = np.indices((round(12 / pitch[1]), round(12 / pitch[0])))
    x_mm, y_mm = (columns + 0.5) * pitch[0] - 6, (rows + 0.5) * pitch[1] - 6
    depth = np.where((abs(x_mm) < 1) & (abs(y_mm) < 1), 0.6, 0.0)
    dark = np.full((*depth.shape, 3), -0.1, np.float32)
    found = cast_shadows(dark, depth, {"R": azimuth_deg}, pitch)[..., 0]
    along_mm = (x_mm if azimuth_deg == 0 else y_mm)[found]
    assert along_mm.max() < -0.9  # the light comes from the other side
    assert -1 - along_mm.min() == pytest.approx(0.6 / GRAZING, abs=2 * max(pitch))


@pytest.mark.parametrize(("pitch", "azimuth_deg"), [((0.05, 0.1), 0.0), ((0.1, 0.05), 90.0)])
def test_a_blade_as_thin_as_a_pixel_casts_a_shadow_without_gaps(pitch, azimuth_deg):
    depth = np.zeros(SIZE)
    line = np.s_[:, 70] if azimuth_deg == 0 else np.s_[50]
    depth[line] = 0.6
    found = cast_shadows(DARK, depth, {"R": azimuth_deg}, pitch)[..., 0]
    shadow = np.flatnonzero(found[50] if azimuth_deg == 0 else found[:, 70])
    assert len(shadow) > 10 and (np.diff(shadow) == 1).all()
