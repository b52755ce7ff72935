# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

from recon.ball import ball_cap
from recon.contact import disturbed
from recon.contact.disturbed import BORDER_PX, LEAST_CHANGE, boundary_of, disturbed_mask
from recon.fast.disturbance import FrameDisturbance
from recon.quarters import in_pixels
from tests.synthetic import digitized, gradient_of, shaded

seeds = st.integers(0, 2**32 - 1)
WIDTH, HEIGHT = 160, 120


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
    monkeypatch.setattr(
        disturbed, "least_change", lambda around, grain: told.append(grain) or LEAST_CHANGE
    )
    disturbed_mask(noise * lit)
    FrameDisturbance((320, 240), channels)(noise.transpose(2, 0, 1).copy())
    white = 0.05 / (2 * np.sqrt(np.pi) * disturbed.SMOOTHING_PX)
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


def flattened(peak, share, seed=0):
    """A face on a domed gel: colours change as the dome was tilted, to the end of the face."""
    rows, columns = np.indices((240, 320))
    x, y = (columns - 159.5) / 160, (rows - 119.5) / 120
    inside = np.clip((share - np.hypot(x, y)) / 0.2, 0, 1)
    change = peak / share * inside[..., None] * np.stack([x, y, -x], -1)
    noise = 0.001 * np.random.default_rng(seed).standard_normal(change.shape)
    return (change + noise).astype(np.float32), inside > 0


@pytest.mark.parametrize("peak", [0.06, 0.1, 0.2])
@pytest.mark.parametrize("share", [0.5, 0.7, 0.9])
def test_a_face_as_wide_as_the_pad_is_found_with_its_gentle_flanks(peak, share):
    difference, dented = flattened(peak, share)
    quarter = FrameDisturbance((320, 240), "RGB")(np.moveaxis(difference, -1, 0).copy())
    for found in (disturbed_mask(difference), in_pixels(quarter, (320, 240))):
        assert found[dented].mean() > 0.75
        assert not found[~cv2.dilate(dented.astype(np.uint8), np.ones((25, 25))).astype(bool)].any()


@given(seeds, st.integers(1, 4))
def test_flanks_no_wider_than_a_rim_are_not_added(seed, rim_px):
    x, y = np.random.default_rng(seed).uniform((30, 30), (130, 90))
    changed = disc(x, y, 20)
    around = disc(x, y, 20 + rim_px)
    np.testing.assert_array_equal(disturbed.with_flanks(changed, around, rim_px), changed)


@given(seeds, st.floats(0.02, 0.7))
def test_patches_and_flanks_are_those_of_the_whole_frame(seed, share):
    """Work is done on a window; SciPy's is on all of it, and beyond the frame flanks go on."""
    random = np.random.default_rng(seed)
    blurred = cv2.GaussianBlur(random.standard_normal((40, 50)), (0, 0), random.uniform(0.3, 4))
    some, more = np.quantile(blurred, [1 - share, max(0, 1 - 1.7 * share)])
    blurred = np.pad(blurred, random.integers(0, 2) * 7, constant_values=-np.inf)
    mask = blurred > some

    parts, _ = ndimage.label(ndimage.binary_fill_holes(mask))
    large = np.bincount(parts.ravel()) >= 20
    large[0] = False
    near = ndimage.binary_dilation(large[parts], iterations=3)
    wanted = np.isin(parts, parts[near]) & (parts > 0)
    changed = disturbed.filled_patches(mask, 3, 20.0)
    np.testing.assert_array_equal(changed, wanted)

    faintly = blurred > more
    wide = ndimage.binary_erosion(faintly & ~changed, iterations=2, border_value=1)
    wide = ndimage.binary_dilation(wide, iterations=2)
    parts, _ = ndimage.label(changed | wide)
    wanted = np.isin(parts, parts[changed]) & (parts > 0)
    np.testing.assert_array_equal(disturbed.with_flanks(changed, faintly, 2), wanted)


def test_flanks_that_hang_together_with_nothing_found_are_not_added():
    changed, flank, alone = disc(40, 60, 10), disc(55, 60, 20), disc(130, 60, 20)
    found = disturbed.with_flanks(changed, flank | alone, 2)
    assert found[changed].all() and found[60, 70]
    assert not found[alone].any()
