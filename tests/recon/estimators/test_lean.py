# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The lean of a domed gel, found from labelled pixels alone."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from recon.estimators.default_fit import LEANING, dents
from recon.estimators.lean import FEWEST_PRESSES, FLAT, fit_lean, lean_at
from recon.estimators.shown import shown_axes
from recon.pixels import Pixels

ROOM = st.floats(-0.3, 0.3)
BOTH = [0, 1]


def domed(lean, presses=24, per_press=300, seed=0):
    """Pixels of balls on a gel with a lean: colour follows the dent, labels the ball."""
    rng = np.random.default_rng(seed)
    press = np.repeat(np.arange(presses, dtype=np.int32), per_press)
    middle = rng.uniform(-0.8, 0.8, (presses, 2))[press]
    ball = rng.uniform(-0.5, 0.5, (len(press), 2))
    position = (middle + 0.1 * ball).astype(np.float32)
    dent = ball + lean_at(np.float32(lean), position)
    gain = 1 + 0.3 * position[:, :1] - 0.2 * position[:, 1:] ** 2
    lights = np.array([[1.0, 0.2, -0.9], [0.1, -1.0, 0.8]])
    color = 0.3 * gain * (dent @ lights) + 0.05 * (dent**2).sum(1, keepdims=True)
    color += 0.003 * rng.standard_normal(color.shape)
    count = len(press)
    return Pixels(
        color=color.astype(np.float32),
        position=position,
        gradient=ball.astype(np.float32),
        contact=np.ones(count, bool),
        press=press,
        place=np.arange(count, dtype=np.int32),
        hidden=np.zeros(count, bool),
        blank=np.full((count, 3), 0.5, np.float32),
        collar=np.full(count, np.nan, np.float32),
        cap=np.zeros(count, np.float32),
    )


@given(ROOM, ROOM)
@settings(max_examples=8, deadline=None)
def test_the_lean_that_was_put_in_comes_out(along_x, along_y):
    lean = np.array([[0.0, along_x], [0.0, along_y]])
    np.testing.assert_allclose(fit_lean(domed(lean), [0, 1, 2], BOTH), lean, atol=0.02)


def test_a_dome_whose_top_is_off_the_middle_is_found():
    lean = np.array([[0.05, -0.2], [-0.04, -0.1]])
    np.testing.assert_allclose(fit_lean(domed(lean), [0, 1, 2], BOTH), lean, atol=0.02)


def test_what_presses_do_not_agree_on_is_taken_as_flat():
    pixels = domed(FLAT)
    shifts = np.random.default_rng(1).normal(0, 0.05, (24, 2)).astype(np.float32)
    rough = pixels.gradient + shifts[pixels.press]  # circles drawn a little off
    found = fit_lean(Pixels(**{**vars(pixels), "gradient": rough}), [0, 1, 2], BOTH)
    assert np.abs(found).max() < 0.06


def test_few_presses_say_nothing():
    lean = np.array([[0.0, 0.2], [0.0, 0.2]])
    assert (fit_lean(domed(lean, presses=FEWEST_PRESSES - 1), [0, 1, 2], BOTH) == 0).all()


@pytest.mark.parametrize("columns", [[0, 1, 2], [0, 2]])
def test_colours_that_are_not_lit_are_not_looked_at(columns):
    lean = np.array([[0.0, -0.1], [0.0, -0.2]])
    pixels = domed(lean)
    blind = pixels.color.copy()
    blind[:, [c for c in range(3) if c not in columns]] = np.nan
    seen = fit_lean(Pixels(**{**vars(pixels), "color": blind}), columns, BOTH)
    assert np.isfinite(seen).all()


@pytest.mark.parametrize("axis", [0, 1])
def test_the_lean_along_an_axis_that_is_not_seen_is_not_fitted(axis):
    lean = np.array([[0.1, -0.2], [0.1, -0.2]])
    found = fit_lean(domed(lean), [0, 1, 2], [axis])
    assert (found[1 - axis] == 0).all()
    np.testing.assert_allclose(found[axis], lean[axis], atol=0.02)


def test_with_as_many_colours_as_axes_the_middle_is_taken_as_level():
    """A dent takes light from all of its pixels, which one light alone takes for a slope."""
    lean = np.array([[0.0, 0.0], [0.0, -0.2]])
    pixels = domed(lean)
    shaded = Pixels(**{**vars(pixels), "color": pixels.color - np.float32(0.02)})
    assert (fit_lean(shaded, [1], [1])[:, 0] == 0).all()


@pytest.mark.parametrize("columns", [[0, 1, 2], [0, 2], [0]])
def test_labels_lean_by_a_share_of_what_colours_tell_and_in_contact_alone(columns):
    pixels = domed([[0.0, -0.12], [0.0, 0.3]])
    contact = np.arange(len(pixels)) % 3 > 0
    pixels = Pixels(**{**vars(pixels), "contact": contact})
    taught, _, gel = dents(pixels, columns)
    told = fit_lean(pixels, columns, shown_axes(pixels, columns))
    np.testing.assert_allclose(gel, LEANING * told, rtol=1e-6)
    assert np.abs(told).max() > 0.05
    np.testing.assert_array_equal(taught.slopes[~contact], pixels.gradient[~contact])
    leaned = pixels.gradient[contact] + lean_at(gel, pixels.position[contact])
    np.testing.assert_allclose(taught.slopes[contact], leaned, atol=1e-6)
