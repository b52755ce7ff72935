# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recon.ball import ball_cap
from recon.contact import mask
from recon.contact.mask import (
    BORDER_PX,
    COLLAR_MM,
    LEAST_CHANGE,
    LEVEL_SMOOTHING,
    LEVELS,
    boundary_of,
    contact_mask,
    disturbed_mask,
    edge_levels,
    pressure_mm,
    with_crests,
)
from recon.fast import disturbance
from recon.fast.disturbance import FrameDisturbance, in_pixels
from tests.synthetic import digitized, gradient_of, shaded

seeds = st.integers(0, 2**32 - 1)
WIDTH, HEIGHT = 160, 120
LEVEL_STEP = LEVELS[1] - LEVELS[0]


def disc(x, y, radius, shape=(HEIGHT, WIDTH)):
    rows, columns = np.indices(shape)
    return np.hypot(columns - x, rows - y) < radius


def pressed(touched, change=(0.12, -0.1, 0.05), noise=0.004, seed=0):
    noisy = noise * np.random.default_rng(seed).standard_normal((*touched.shape, 3))
    return (touched[..., None] * np.array(change) + noisy).astype(np.float32)


def overlap(one, two):
    return (one & two).sum() / (one | two).sum()


@given(seeds, st.floats(0, 0.2))
def test_blank_gel_is_never_in_contact_however_noisy(seed, noise):
    blank = np.zeros((HEIGHT, WIDTH), bool)
    assert not disturbed_mask(pressed(blank, noise=noise, seed=seed)).any()


@given(seeds)
def test_two_digitized_frames_of_blank_gel_do_not_differ(seed):
    rng = np.random.default_rng(seed)
    light = shaded(gradient_of(None))
    frames = [digitized(light + 0.01 * rng.standard_normal(light.shape)) / 255 for _ in range(2)]
    assert not disturbed_mask((frames[1] - frames[0]).astype(np.float32)).any()


@pytest.mark.parametrize("channels", ["RGB", "RB", "G"])
def test_grain_is_as_large_in_fewer_colours_as_in_three(channels, monkeypatch):
    """Colours without a light are zero, which says nothing of the others' noise."""
    lit = np.array([channel in channels for channel in "RGB"])
    noise = 0.05 * np.random.default_rng(0).standard_normal((240, 320, 3)).astype(np.float32)
    told = []
    for module in (mask, disturbance):
        monkeypatch.setattr(
            module, "least_change", lambda spread, grain: told.append(grain) or LEAST_CHANGE
        )
    disturbed_mask(noise * lit)
    FrameDisturbance((320, 240), channels)(noise.transpose(2, 0, 1).copy())
    white = 0.05 / (2 * np.sqrt(np.pi) * mask.SMOOTHING_PX)
    assert told == [pytest.approx(white, rel=0.05)] * 2


@pytest.mark.parametrize("channels", ["RB", "R"])
def test_a_grip_of_most_of_the_pad_is_seen_by_fewer_colours_too(channels):
    lit = np.array([channel in channels for channel in "RGB"])
    wide = np.zeros((240, 320, 3), np.float32)
    wide[30:-30, 30:-30] = 0.07 * np.where(np.arange(260) < 130, 1, -1)[:, None]
    assert disturbed_mask(wide * lit)[60:-60, 60:-60].mean() > 0.95


@given(st.floats(30, 45), st.floats(50, 110), st.floats(50, 70), seeds)
def test_a_disc_is_found_with_its_outline(radius, x, y, seed):
    touched = disc(x, y, radius)
    assert overlap(disturbed_mask(pressed(touched, seed=seed)), touched) >= 0.9


@pytest.mark.parametrize("radius", [60, 75, 90])
def test_a_ball_that_covers_most_of_the_pad_is_found(radius):
    """Its slopes differ everywhere, so that most of the pad has another colour than the median."""
    cap = ball_cap((WIDTH, HEIGHT), (80.0, 60.0), radius / 10, 15.0, (0.1, 0.1))
    change = 0.5 * cap.gradient @ np.array([[0.0, -1.0, 0.0], [1.0, 0.0, -1.0]])
    noise = 0.004 * np.random.default_rng(0).standard_normal(change.shape)
    found = disturbed_mask((change + noise).astype(np.float32))
    assert overlap(found, cap.contact) >= 0.75
    assert boundary_of(found) == "neumann"


@pytest.mark.parametrize("fewer", [2, 3, 4])
@pytest.mark.parametrize("channels", ["RGB", "R"])
def test_a_small_ball_is_found_with_fewer_pixels_too(fewer, channels):
    """Blur and opening, made for 320 x 240, would leave nothing of a contact of a few pixels."""
    cap = ball_cap((320, 240), (150.0, 110.0), 1.5, 3.0, (0.1, 0.1))
    lit = np.array([channel in channels for channel in "RGB"])
    change = lit * (0.3 * cap.gradient @ np.array([[0.0, -1.0, 0.0], [1.0, 0.0, -1.0]]))
    size_px = (320 // fewer, 240 // fewer)
    rng = np.random.default_rng(0)
    coarse = cv2.resize(change, size_px, interpolation=cv2.INTER_AREA)
    coarse += lit * 0.002 * rng.standard_normal(coarse.shape)
    found = disturbed_mask(coarse.astype(np.float32))
    whole = disturbed_mask(change.astype(np.float32)).astype(np.float32)
    assert overlap(found, cv2.resize(whole, size_px, interpolation=cv2.INTER_AREA) > 0.5) >= 0.8


@given(seeds, st.floats(0, 0.2), st.sampled_from([(60, 80), (80, 107), (120, 90)]))
def test_blank_gel_is_not_in_contact_in_small_frames_either(seed, noise, shape):
    grain = noise * np.random.default_rng(seed).standard_normal((*shape, 3))
    assert not disturbed_mask(grain.astype(np.float32)).any()


@given(seeds, st.lists(st.floats(-0.025, 0.025), min_size=3, max_size=3))
def test_colours_that_drift_together_are_no_contact(seed, drift):
    difference = pressed(np.zeros((HEIGHT, WIDTH), bool), seed=seed) + np.float32(drift)
    assert not disturbed_mask(difference).any()
    assert not FrameDisturbance((WIDTH, HEIGHT), "RGB")(difference.transpose(2, 0, 1).copy()).any()


def test_a_harder_grip_never_disturbs_less():
    """A wide contact spreads the colours of the frame, which must not pass for noise."""
    noise = 0.002 * np.random.default_rng(0).standard_normal((HEIGHT, WIDTH, 3))
    areas = []
    for radius in range(15, 90, 5):
        cap = ball_cap((WIDTH, HEIGHT), (80.0, 60.0), radius / 10, 15.0, (0.1, 0.1))
        change = cap.gradient @ np.array([[0.0, -0.6, 0.3], [0.5, 0.0, -0.5]])
        difference = (change + noise).astype(np.float32)
        quarter = FrameDisturbance((WIDTH, HEIGHT), "RGB")(difference.transpose(2, 0, 1).copy())
        quarter = in_pixels(quarter, (WIDTH, HEIGHT))
        areas.append([disturbed_mask(difference).mean(), quarter.mean()])
    assert (np.diff(areas, axis=0) > -0.01).all()


def test_a_ball_is_found_where_it_touches():
    place = (70.0, 45.0, 30.0)
    difference = (shaded(gradient_of(place)) - shaded(gradient_of(None))).astype(np.float32)
    assert overlap(disturbed_mask(difference), disc(*place, difference.shape[:2])) >= 0.85


def test_a_ring_is_filled():
    ring = disc(80, 60, 40) & ~disc(80, 60, 25)
    assert overlap(disturbed_mask(pressed(ring)), disc(80, 60, 40)) >= 0.9


def test_dust_is_not_contact():
    specks = disc(100, 100, 3, (480, 640)) | disc(400, 300, 1, (480, 640))
    touched = disc(300, 200, 60, (480, 640))
    found = disturbed_mask(pressed(specks | touched, noise=0.0))
    assert overlap(found, touched) >= 0.9
    assert not found[:, :200].any() and not found[:, 370:].any()


@pytest.mark.parametrize(("gap_px", "counts"), [(5, True), (20, False)])
def test_a_small_patch_counts_beside_a_larger_one(gap_px, counts):
    """As the farther half of a small contact under one light, which tells no dust from it."""
    shape = (480, 640)
    near, far = disc(300, 200, 12, shape), disc(318 + gap_px, 200, 6, shape)
    found = disturbed_mask(pressed(near | far, noise=0.0))
    assert found[near].all() and found[far].mean() == (1 if counts else 0)
    assert not disturbed_mask(pressed(far, noise=0.0)).any()


def test_two_contacts_are_both_found():
    touched = disc(45, 60, 30) | disc(115, 60, 30)
    assert overlap(disturbed_mask(pressed(touched)), touched) >= 0.9


@pytest.mark.parametrize("channel", range(3))
@pytest.mark.parametrize("sign", [-1, 1])
def test_a_change_of_any_one_colour_either_way_is_contact(channel, sign):
    change = np.zeros(3)
    change[channel] = 0.06 * sign
    touched = disc(80, 60, 35)
    assert overlap(disturbed_mask(pressed(touched, change)), touched) >= 0.9


@pytest.mark.parametrize("place", [(0, 60), (159, 60), (80, 0), (80, 119), (2, 3)])
def test_what_is_cut_by_the_frame_has_a_free_border(place):
    touched = disc(*place, 35)
    found = disturbed_mask(pressed(touched))
    assert overlap(found, touched) >= 0.85
    assert boundary_of(found) == "neumann"


def test_what_lies_inside_has_a_zero_border_and_so_has_blank_gel():
    assert boundary_of(disturbed_mask(pressed(disc(80, 60, 35)))) == "dirichlet"
    assert boundary_of(np.zeros((HEIGHT, WIDTH), bool)) == "dirichlet"


@given(st.integers(0, HEIGHT - 1), st.integers(0, WIDTH - 1))
def test_one_pixel_of_contact_near_the_edge_frees_the_border(row, column):
    contact = np.zeros((HEIGHT, WIDTH), bool)
    contact[row, column] = True
    to_edge = min(row, column, HEIGHT - 1 - row, WIDTH - 1 - column)
    assert boundary_of(contact) == ("neumann" if to_edge < BORDER_PX else "dirichlet")


@pytest.mark.parametrize("shape", [(1, 1), (2, 5), (6, 6)])
def test_frames_smaller_than_the_border_are_answered_too(shape):
    assert boundary_of(np.ones(shape, bool)) == "neumann"
    assert disturbed_mask(np.zeros((*shape, 3), np.float32)).shape == shape


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
    assert overlap(depth > 0.02, touched) < 0.75
    assert overlap(found, touched) >= least


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
    assert overlap(found, deep | shallow) > 0.9


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
    assert overlap(found, touched) > 0.9


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
