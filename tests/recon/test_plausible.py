# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames that are mirrored, or have red and blue swapped, are told from touches."""

import cv2
import numpy as np
import pytest

from recon.ball import ball_cap
from recon.estimators import fit_estimator, lesson_of
from recon.follower import KeptTouch
from recon.integration.poisson import integrate
from recon.pipeline import Reconstruction, reconstruct
from recon.plausible import (
    CUT_TWICE,
    MOST_OFF,
    cut_word,
    is_implausible,
    slopes_of_no_surface,
)
from recon.presses import press_reader, read_presses
from recon.quarters import in_quarters
from sensor.dataset import read_dataset
from tests.recon.fast.units import make_unit, random_mlp
from validation.contact import blank_frames
from validation.datasets import dataset_folder

PITCH_MM = (0.1, 0.08)
RED_AND_BLUE = {
    "channels": "RB",
    "missing_axis": "network",
    "lights_deg": {"R": 90.0, "B": -90.0},
}


def touch_of(gradient, depth_mm, disturbed=None):
    return Reconstruction(
        difference=np.zeros((*depth_mm.shape, 3), np.float32),
        gradient=gradient.astype(np.float32),
        depth_mm=depth_mm,
        disturbed=depth_mm > 0.05 if disturbed is None else disturbed,
        boundary="dirichlet",
        mm_per_px=PITCH_MM,
    )


@pytest.fixture(scope="module")
def cap():
    return ball_cap((200, 160), (110.0, 70.0), 2.0, 3.0, PITCH_MM)


def test_slopes_of_one_surface_have_none_and_a_turned_field_nearly_all(cap):
    depth_mm = integrate(cap.gradient, PITCH_MM, "dirichlet")
    assert slopes_of_no_surface(touch_of(cap.gradient, depth_mm))[1] < 0.05
    turned = np.stack([-cap.gradient[..., 1], cap.gradient[..., 0]], -1)  # curls, and is no slope
    spun_mm = integrate(turned, PITCH_MM, "dirichlet")
    assert slopes_of_no_surface(touch_of(turned, spun_mm, cap.contact))[1] > 0.8
    flat = np.zeros_like(cap.gradient)
    assert slopes_of_no_surface(touch_of(flat, np.zeros((160, 200)))) == (0, 0)


def test_what_is_deeper_than_a_gel_is_implausible_and_an_axis_set_to_zero_is_not(cap):
    depth_mm = integrate(cap.gradient, PITCH_MM, "dirichlet")
    assert not is_implausible(touch_of(cap.gradient, depth_mm), None)
    assert is_implausible(touch_of(6 * cap.gradient, 6 * depth_mm), None)
    one = np.where([True, False], 1.5 * cap.gradient, 0)
    half_mm = integrate(one, PITCH_MM, "dirichlet")
    assert is_implausible(touch_of(one, half_mm), None)
    assert not is_implausible(touch_of(one, half_mm), "y")


def test_gel_that_bulges_as_far_as_it_may_be_pressed_in_is_implausible(cap):
    depth_mm = integrate(cap.gradient, PITCH_MM, "dirichlet")
    deep = 2.0 / depth_mm.max()
    assert not is_implausible(touch_of(deep * cap.gradient, deep * depth_mm), None)
    assert is_implausible(touch_of(-deep * cap.gradient, -deep * depth_mm), None)


@pytest.mark.parametrize(
    ("height", "card", "word"),
    [
        (36, RED_AND_BLUE, CUT_TWICE),
        (120, RED_AND_BLUE, ""),
        (36, RED_AND_BLUE | {"missing_axis": "zero"}, ""),
        (36, {}, ""),
    ],
    ids=["both edges", "none", "zero", "all lights"],
)
def test_a_contact_over_both_edges_of_an_inferred_axis_is_told(height, card, word):
    cut = ball_cap((160, height), (80.0, height / 2), 2.4, 3.0, (0.1, 0.1))
    estimator = random_mlp(channels=card.get("channels", "RGB"))
    unit = make_unit((160, 120), estimator=estimator, **card)
    assert cut_word(touch_of(cut.gradient, cut.depth_mm), unit) == word


def test_errors_of_single_pixels_are_no_reason(cap):
    noise = np.random.default_rng(0).normal(0, 0.2, cap.gradient.shape)
    gradient = np.where(cap.gradient.any(-1)[..., None], cap.gradient + noise, 0)
    depth_mm = integrate(gradient, PITCH_MM, "dirichlet")
    touch = touch_of(gradient, depth_mm)
    along_y, along_x = np.gradient(depth_mm, PITCH_MM[1], PITCH_MM[0])
    off = np.stack([along_x, along_y], -1)[gradient.any(-1)] - gradient[gradient.any(-1)]
    assert np.square(off).sum() > 0.15 * np.square(gradient).sum()
    assert not is_implausible(touch, None)


def test_noise_of_no_surface_is_no_reason_where_slopes_are_small():
    rng = np.random.default_rng(0)
    for noise, wrong in ((0.02, False), (0.2, True)):
        gradient = cv2.GaussianBlur(rng.normal(0, 1, (160, 200, 2)), (0, 0), 3)
        gradient *= noise / gradient.std()
        depth_mm = integrate(gradient, PITCH_MM, "dirichlet")
        touch = touch_of(gradient, depth_mm, disturbed=depth_mm > np.median(depth_mm))
        blank = touch_of(gradient, depth_mm, disturbed=np.zeros(depth_mm.shape, bool))
        assert not is_implausible(blank, None)
        assert slopes_of_no_surface(touch)[1] > 0.3
        assert is_implausible(touch, None) == wrong


def test_what_is_disturbed_may_be_known_by_quarters(cap):
    turned = np.stack([-cap.gradient[..., 1], cap.gradient[..., 0]], -1).astype(np.float32)
    spun_mm = integrate(turned, PITCH_MM, "dirichlet")
    found = [
        slopes_of_no_surface(
            KeptTouch(
                gradient=turned,
                depth_mm=spun_mm,
                contact=cap.contact,
                disturbed=disturbed,
                boundary="dirichlet",
                mm_per_px=PITCH_MM,
                slope_error=None,
            )
        )
        for disturbed in (cap.contact, in_quarters(cap.contact))
    ]
    np.testing.assert_allclose(*found, rtol=1e-3)


@pytest.mark.parametrize("place_px", [(5, 5), (20, 33), (44, 54)])
def test_the_worst_place_of_those_that_changed_is_told_of(place_px):
    """Of a frame with no more pixels than cells, by the whole frame's squares."""
    rng = np.random.default_rng(0)
    dent, changed = np.zeros((50, 60, 2)), np.zeros((50, 60), bool)
    for field, half_px in ((dent, 5), (changed, 4)):
        field[tuple(slice(x - half_px, x + half_px) for x in place_px)] = True
    dent *= rng.normal(0, 1, dent.shape)
    depth_mm = np.cumsum(rng.normal(0, 0.1, changed.shape), 1)  # of still gel too
    along_y, along_x = np.gradient(depth_mm, *PITCH_MM[::-1])
    off = np.where(dent.any(-1)[..., None], np.stack([along_x, along_y], -1) - dent, 0)
    off2, slopes2 = (
        cv2.GaussianBlur(np.square(cv2.GaussianBlur(field, (0, 0), 1.0)).sum(-1), (0, 0), 50 / 20)
        for field in (off, dent)
    )
    worst = np.unravel_index((off2 * changed).argmax(), changed.shape)
    np.testing.assert_allclose(
        slopes_of_no_surface(touch_of(dent, depth_mm, changed)),
        (np.sqrt(off2[worst]), off2[worst] / slopes2[worst]),
        rtol=1e-5,
    )
    blank = touch_of(dent, depth_mm, np.zeros_like(changed))
    assert slopes_of_no_surface(blank) == (0, 0)


def test_gentle_slopes_of_a_surface_hide_no_contact_whose_slopes_are_of_none(cap):
    """As of a mirrored picture whose blank one was not."""
    y, x = np.indices(cap.depth_mm.shape)
    broad_mm = np.sin(np.pi * y / 159) * np.sin(np.pi * x / 199)
    broad = np.stack(np.gradient(broad_mm, *PITCH_MM[::-1])[::-1], -1)
    turned = np.stack([-cap.gradient[..., 1], cap.gradient[..., 0]], -1)
    spun_mm = integrate(turned, PITCH_MM, "dirichlet")
    everywhere = np.ones_like(cap.contact)
    wrong = touch_of(broad + 0.3 * turned, broad_mm + 0.3 * spun_mm, everywhere)
    lack2 = np.square(0.3 * turned).sum()
    assert lack2 < MOST_OFF * np.square(wrong.gradient).sum()  # of the whole frame it is little
    assert is_implausible(wrong, None)
    cap_mm = integrate(cap.gradient, PITCH_MM, "dirichlet")
    right = touch_of(broad + cap.gradient, broad_mm + cap_mm, everywhere)
    assert not is_implausible(right, None)


@pytest.mark.parametrize("size", [(1, 20), (20, 1), (1, 1)])
def test_a_line_of_pixels_is_of_some_surface(size):
    gradient = np.random.default_rng(0).normal(0, 1, (*size, 2))
    touch = touch_of(gradient, np.zeros(size))
    assert slopes_of_no_surface(touch) == (0, 0) and not is_implausible(touch, None)


def test_presses_are_plausible_and_their_mirror_images_are_not():
    dataset = read_dataset(dataset_folder("taxim-gelsight"))
    presses, reader = read_presses(dataset).presses, press_reader(dataset)
    lesson = lesson_of("mlp", presses, range(0, len(presses), 4), 0)
    fitted = fit_estimator("mlp", lesson, "RGB", 0)

    def implausible(frame):
        touch = reconstruct(
            (frame - reader.blank).astype(np.float32),
            fitted,
            missing="none",
            lights_deg=dataset.card.lights_deg,
            mm_per_px=dataset.card.mm_per_px,
        )
        return is_implausible(touch, None)

    frames = [press.difference + reader.blank for press in presses[1::8]]
    assert not any(implausible(frame) for frame in frames)
    assert all(implausible(frame[:, ::-1]) for frame in frames)
    assert all(implausible(frame[..., ::-1]) for frame in frames)
    assert implausible(np.full_like(frames[0], 100 / 255))
    assert not any(implausible(reader.blank + blank) for blank, _ in blank_frames(reader, 3))
