# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recon.contact.mask import (
    COLLAR_MM,
    LEVEL_SMOOTHING,
    LEVELS,
    contact_mask,
    edge_levels,
    pressure_mm,
    with_crests,
)
from validation.contact import iou

seeds = st.integers(0, 2**32 - 1)
WIDTH, HEIGHT = 160, 120
LEVEL_STEP = LEVELS[1] - LEVELS[0]


def disc(x, y, radius, shape=(HEIGHT, WIDTH)):
    rows, columns = np.indices(shape)
    return np.hypot(columns - x, rows - y) < radius


def slopes(depth, pitch_mm=0.1):
    along_y, along_x = np.gradient(depth, pitch_mm)
    return np.stack([along_x, along_y], -1)


def skin_over(floor_mm, pitch_mm=0.1, collar_mm=0.4):
    """Smallest skin above an object that springs back over the collar's length, by relaxation."""
    skin = np.maximum(floor_mm, 0)
    pull = (collar_mm / pitch_mm) ** 2
    for _ in range(600):
        ring = np.pad(skin, 1, mode="edge")
        around = ring[:-2, 1:-1] + ring[2:, 1:-1] + ring[1:-1, :-2] + ring[1:-1, 2:]
        skin = np.maximum(floor_mm, pull * around / (1 + 4 * pull))
    return skin


def object_mm(shape):
    rows, columns = np.indices((HEIGHT, WIDTH))
    x, y = (columns - 80.3) / 10, (rows - 59.6) / 10
    if shape == "ball":
        return 0.8 - (4 - np.sqrt(np.maximum(16 - x**2 - y**2, 0)))
    if shape == "flat punch":
        return np.where(np.hypot(x, y) < 2.5, 0.5, -1.0)
    if shape == "tilted block":
        return np.where((abs(x) < 3) & (abs(y) < 2), 0.5 + 0.06 * x, -1.0)
    return np.where(abs(x) < 3.5, 0.5 - (1.5 - np.sqrt(np.maximum(1.5**2 - y**2, 0))), -1.0)


@pytest.mark.parametrize(
    ("shape", "least"),
    [("ball", 0.9), ("flat punch", 0.9), ("tilted block", 0.9), ("cylinder", 0.85)],
)
@pytest.mark.parametrize("noise", [0.0, 0.03])
def test_the_collar_that_only_follows_is_not_contact(shape, least, noise):
    floor = object_mm(shape)
    depth = skin_over(floor)
    touched = (floor > 0) & (depth - floor < 1e-3)
    gradient = slopes(depth) + noise * np.random.default_rng(0).normal(size=(HEIGHT, WIDTH, 2))
    disturbed = np.hypot(*np.moveaxis(gradient, -1, 0)) > 0.1
    found = contact_mask(disturbed, depth, gradient, (0.1, 0.1))
    assert iou(depth > 0.02, touched) < 0.75
    assert iou(found, touched) >= least


def test_pressure_is_zero_where_gel_only_follows_and_not_where_it_is_held():
    floor = object_mm("ball")
    depth = skin_over(floor)
    pressure = pressure_mm(depth, slopes(depth), (0.1, 0.1))
    rows, columns = np.indices(depth.shape)
    away_mm = np.hypot(columns - 80.3, rows - 59.6) / 10
    touched = (floor > 0) & (depth - floor < 1e-3)
    edge_mm = away_mm[touched].max()
    assert (pressure[away_mm < edge_mm - 0.4] > 0.1).all()
    assert np.abs(pressure[away_mm > edge_mm + 0.5]).max() < 0.02


@pytest.mark.parametrize("pitch_mm", [(0.1, 0.1), (0.1, 0.2), (0.2, 0.1)])
def test_pressure_is_that_of_the_surface_whatever_its_pixels(pitch_mm):
    """Of a bowl that bends by 1/mm along x and 3/mm along y."""
    rows, columns = np.indices((HEIGHT, WIDTH))
    x, y = (columns - 80) * pitch_mm[0], (rows - 60) * pitch_mm[1]
    depth = x**2 / 2 + 3 * y**2 / 2
    pressure = pressure_mm(depth, np.stack([x, 3 * y], -1), pitch_mm)
    inner = np.s_[8:-8, 8:-8]
    np.testing.assert_allclose((depth - pressure)[inner], COLLAR_MM**2 * 4)


def contours(slope_at):
    """A patch whose pressure falls evenly from its middle to its rim, and its slope at each."""
    share = np.linspace(0, 1, 5001)[1:-1] ** 2
    return edge_levels(np.ones(len(share), int), share, slope_at(share), 2)[1]


def test_a_round_contact_ends_where_its_slope_is_largest():
    edge = 0.3
    level = contours(lambda share: np.where(share > edge, np.sqrt(1 - share), share / edge * 0.8))
    assert abs(level - edge) <= LEVEL_SMOOTHING * LEVEL_STEP


@pytest.mark.parametrize("tilt", [-0.06, 0.0, 0.06])
def test_a_plane_flank_ends_at_its_last_steep_contour(tilt):
    """Though its slope, as an estimator has it, grows a little toward the middle."""
    edge = 0.3
    level = contours(lambda share: np.where(share > edge, 1 + tilt * share, share / edge * 0.8))
    assert abs(level - edge) <= LEVEL_SMOOTHING * LEVEL_STEP


@pytest.mark.parametrize("more", [0.2, 0.35])
def test_a_plane_flank_is_not_cut_though_it_is_read_steeper_toward_its_crest(more):
    edge = 0.3
    level = contours(lambda share: np.where(share > edge, 1 + more * share, share / edge * 0.6))
    assert abs(level - edge) <= LEVEL_SMOOTHING * LEVEL_STEP


def test_a_round_contact_ends_where_it_is_steepest_though_its_crown_is_read_too_steep():
    """A crown that is not level is no plane flank while slopes grow toward the edge."""
    edge = 0.3

    def slope_at(share):
        round_one = np.maximum(np.sqrt(1 - share), np.where(share > 0.9, 0.6, 0))
        return np.where(share > edge, round_one, share / edge * 0.8)

    assert abs(contours(slope_at) - edge) <= LEVEL_SMOOTHING * LEVEL_STEP


def test_no_contour_ends_a_contact_without_a_collar():
    assert contours(lambda share: 0.5 + 0.05 * share) == -np.inf


def test_a_shallow_contact_beside_a_deep_one_is_kept():
    deep, shallow = disc(45, 60, 30), disc(115, 60, 30)
    depth = 1.0 * deep + 0.3 * shallow
    found = contact_mask(deep | shallow, depth, slopes(depth), (0.1, 0.1))
    assert iou(found, deep | shallow) > 0.9


@pytest.mark.parametrize("shank", ["bar", "rod"])
@pytest.mark.parametrize("height_mm", [0.2, 0.4])
def test_a_shallow_shank_that_hangs_together_with_its_head_is_kept(shank, height_mm):
    rows, columns = np.indices((HEIGHT, WIDTH))
    x, y = (columns - 80.3) / 10, (rows - 59.6) / 10
    head = np.where(np.hypot(x + 3, y) < 2, 1.0, -1.0)
    falls = 1 - np.sqrt(np.maximum(1 - y**2, 0)) if shank == "rod" else 0
    floor = np.maximum(head, np.where((abs(x - 1) < 4) & (abs(y) < 1), height_mm - falls, -1.0))
    depth = skin_over(floor)
    touched = (floor > 0) & (depth - floor < 1e-3)
    gradient = slopes(depth)
    disturbed = np.hypot(*np.moveaxis(gradient, -1, 0)) > 0.1
    found = contact_mask(disturbed, depth, gradient, (0.1, 0.1))
    assert iou(found, touched) > 0.9


@pytest.mark.parametrize(("more", "kept"), [(0.05, False), (0.4, True)])
def test_a_crest_presses_more_than_its_depth_says(more, kept):
    """A collar that turns out flat, as those of real gels do, is none."""
    head, beside = disc(45, 60, 20), disc(115, 60, 12)
    depth = 1.0 * head + 0.2 * beside
    gradient = np.zeros((HEIGHT, WIDTH, 2))
    gradient[head] = 0.5
    found = with_crests(head, head | beside, gradient, depth, depth * (1 + more * beside))
    assert found[head].all() and found[beside].any() == kept


@pytest.mark.parametrize(("x", "kept"), [(140, True), (150, False)])
def test_a_crest_that_the_frame_cuts_is_not_told_from_a_drift(x, kept):
    head, beside = disc(45, 60, 20), disc(x, 60, 12)
    depth = 1.0 * head + 0.2 * beside
    gradient = np.zeros((HEIGHT, WIDTH, 2))
    gradient[head] = 0.5
    found = with_crests(head, head | beside, gradient, depth, depth * (1 + 0.4 * beside))
    assert found[head].all() and found[beside].any() == kept


def test_a_flat_face_is_contact_though_its_colour_does_not_change():
    """Its slope is zero, as on blank gel: only the rim looks disturbed."""
    depth = skin_over(object_mm("flat punch"))
    rim = np.hypot(*np.moveaxis(slopes(depth), -1, 0)) > 0.1
    middle = disc(80, 60, 15)
    assert not (rim & middle).any()
    assert contact_mask(rim, depth, slopes(depth), (0.1, 0.1))[middle].all()


@given(seeds)
def test_every_patch_of_contact_is_deep_and_near_disturbed_gel(seed):
    rng = np.random.default_rng(seed)
    disturbed = rng.random((12, 15)) < 0.2
    depth = rng.normal(size=disturbed.shape)
    found = contact_mask(disturbed, depth, slopes(depth), (0.1, 0.1))
    assert (depth[found] > 0).all()
    nothing = np.zeros_like(disturbed)
    assert not contact_mask(nothing, depth, slopes(depth), (0.1, 0.1)).any()
    assert not contact_mask(~nothing, -np.abs(depth), slopes(depth), (0.1, 0.1)).any()
