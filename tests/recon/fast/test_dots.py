# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames' dots, of which most rest, are filled as the reference fills all of them."""

import cv2
import numpy as np
import pytest

from recon.fast.dots import FrameDots
from recon.markers.filling import fill_gradients
from recon.markers.tracking import MarkerTracker, marker_tracker
from recon.quarters import SIDE_PX, in_pixels
from tests.dotted import HEIGHT, WIDTH, dotted, grid_px

PLACES, PITCH_MM = grid_px(), (0.1, 0.12)
BLANK = dotted(PLACES)
QUARTERS = (-(-HEIGHT // SIDE_PX), -(-WIDTH // SIDE_PX))
FAR_OFF = 1e6


@pytest.fixture(scope="module")
def tracker() -> MarkerTracker:
    found = marker_tracker(BLANK)
    assert found is not None
    return found


def pressed(shift_px: float) -> np.ndarray:
    """Dots in the frame's middle have moved, as under a finger."""
    middle = np.exp(-np.square((PLACES - [WIDTH / 2, HEIGHT / 2]) / 40).sum(1, keepdims=True))
    return PLACES + shift_px * middle * [1.0, 0.5]


def test_colors_are_filled_as_the_reference_fills_them_however_dots_have_moved(tracker) -> None:
    frames = FrameDots(tracker, BLANK, PITCH_MM)
    for seed, shift_px in enumerate((0.0, 2.0, 6.0, 2.0, -3.0, 0.0)):
        difference = dotted(pressed(shift_px), seed=seed) - BLANK
        planes = np.ascontiguousarray(np.moveaxis(difference, -1, 0))
        _, hidden = frames.followed(planes)
        assert (hidden.sum() > tracker.hidden().sum()) == (shift_px != 0)
        wanted = fill_gradients(difference, hidden, "harmonic", PITCH_MM)
        np.testing.assert_allclose(np.moveaxis(planes, 0, -1), wanted, atol=1e-6)


@pytest.mark.parametrize("corner", [(0, 0), (18, 24), (30, 40)])
@pytest.mark.parametrize("resized", [False, True])
def test_slopes_that_are_not_asked_for_do_not_tell_where_they_are_near(
    tracker, corner, resized
) -> None:
    frames = FrameDots(tracker, BLANK, PITCH_MM)
    near = np.zeros(QUARTERS, bool)
    near[corner[0] : corner[0] + 13, corner[1] : corner[1] + 18] = True
    _, hidden = frames.followed(np.moveaxis(dotted(pressed(4.0)) - BLANK, -1, 0).copy())
    slopes = frames.slopes(hidden)
    asked = slopes.around(near)
    step = 2 if resized else 1  # slopes may be interpolated from half the resolution
    size_px = (WIDTH // step, HEIGHT // step)
    given = cv2.resize(asked.astype(np.uint8), size_px, interpolation=cv2.INTER_NEAREST) > 0
    exact = np.random.default_rng(0).normal(size=(2, HEIGHT // step, WIDTH // step))
    whole, some = (
        np.stack([cv2.resize(plane, (WIDTH, HEIGHT)) for plane in planes]).astype(np.float32)
        for planes in (exact, np.where(given, exact, FAR_OFF))
    )
    slopes(some, near)
    wanted = fill_gradients(np.moveaxis(whole, 0, -1), hidden, "surface", PITCH_MM)
    inner = cv2.erode(near.view(np.uint8), np.ones((3, 3), np.uint8)) > 0 if resized else near
    seen = in_pixels(inner, (WIDTH, HEIGHT))
    np.testing.assert_allclose(np.moveaxis(some, 0, -1)[seen], wanted[seen], atol=1e-5)
    assert hidden[seen].any() and not given.all()


def test_where_dots_hide_all_slopes_are_none(tracker) -> None:
    slopes = FrameDots(tracker, BLANK, PITCH_MM).slopes(np.ones((HEIGHT, WIDTH), bool))
    near, gradient = np.ones(QUARTERS, bool), np.ones((2, HEIGHT, WIDTH), np.float32)
    assert not slopes.around(near).any()
    slopes(gradient, near)
    assert not gradient.any()
