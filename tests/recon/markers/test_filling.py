# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What every way of filling owes, then what ours promises beyond."""

from collections import Counter
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from recon.ball import ball_cap
from recon.markers.elastic import ElasticFill
from recon.markers.energies import MANY
from recon.markers.filling import METHODS, fill_gradients, prepare_fill
from sensor.errors import WedgeError

WIDTH, HEIGHT = 64, 48
ELASTIC = ("harmonic", "biharmonic", "surface")
X, Y = np.meshgrid(np.linspace(-1, 1, WIDTH), np.linspace(-1, 1, HEIGHT))


def dots(pitch_px=16, radius_px=3.3, at=(8.0, 8.0), size=(WIDTH, HEIGHT)):
    columns, rows = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    away_x = (columns - at[0] + pitch_px / 2) % pitch_px - pitch_px / 2
    away_y = (rows - at[1] + pitch_px / 2) % pitch_px - pitch_px / 2
    return np.hypot(away_x, away_y) < radius_px


HIDDEN = dots()


def spoiled(field, hidden=HIDDEN):
    return np.where(hidden[..., None], 1e3, field)


def random_field(seed, channels=2):
    return np.random.default_rng(seed).normal(size=(HEIGHT, WIDTH, channels))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_what_is_not_hidden_stays_and_what_is_hidden_is_not_looked_at(method, dtype):
    field = random_field(0).astype(dtype)
    kept = spoiled(field).astype(dtype)
    filled = fill_gradients(kept, HIDDEN, method)
    assert filled.dtype == dtype and np.isfinite(filled).all()
    np.testing.assert_array_equal(filled[~HIDDEN], field[~HIDDEN])
    np.testing.assert_array_equal(kept[HIDDEN], 1e3)  # the argument is not written to
    np.testing.assert_allclose(filled, fill_gradients(field, HIDDEN, method), atol=1e-3)


@pytest.mark.parametrize("method", METHODS)
def test_a_flat_field_stays_flat(method):
    value = 0.0 if method == "zero" else 0.7
    flat = np.full((HEIGHT, WIDTH, 2), value)
    np.testing.assert_allclose(fill_gradients(spoiled(flat), HIDDEN, method), flat, atol=2e-3)


@pytest.mark.parametrize("method", METHODS)
def test_nothing_hidden_changes_nothing_and_all_hidden_is_zero(method):
    field = random_field(1)
    nothing, everything = np.zeros((HEIGHT, WIDTH), bool), np.ones((HEIGHT, WIDTH), bool)
    np.testing.assert_array_equal(fill_gradients(field, nothing, method), field)
    np.testing.assert_array_equal(fill_gradients(field, everything, method), 0)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("at", [(0.0, 0.0), (1.0, 7.0), (12.0, 15.0)])
def test_dots_cut_by_the_edge_are_filled_too(method, at):
    hidden = dots(at=at)
    smooth = np.stack([X, Y], -1)
    error = fill_gradients(spoiled(smooth, hidden), hidden, method) - smooth
    assert np.abs(error).max() < (1.01 if method == "zero" else 0.2)


@pytest.mark.parametrize("method", ELASTIC)
def test_filling_is_linear(method):
    one, two = random_field(2), random_field(3)
    sum_of = fill_gradients(one, HIDDEN, method) + 3 * fill_gradients(two, HIDDEN, method)
    np.testing.assert_allclose(fill_gradients(one + 3 * two, HIDDEN, method), sum_of, atol=1e-4)


@pytest.mark.parametrize("method", ["linear", "cubic", "biharmonic", "surface"])
def test_a_tilted_plane_is_continued_exactly(method):
    """Slopes of a quadratic surface: both are linear, and their mixed derivatives agree."""
    x_mm, y_mm = 0.1 * np.arange(WIDTH) + 0 * Y, 0.15 * np.arange(HEIGHT)[:, None] + 0 * X
    gradient = np.stack([0.2 * x_mm - 0.1 * y_mm, 0.3 * y_mm - 0.1 * x_mm], -1)
    filled = fill_gradients(spoiled(gradient), HIDDEN, method, (0.1, 0.15))
    np.testing.assert_allclose(filled, gradient, atol=2e-3)


@pytest.mark.parametrize("method", METHODS[:2] + METHODS[4:])
def test_a_mirror_image_is_filled_as_a_mirror_image(method):
    field = random_field(4)
    if method == "nearest":
        field = np.stack([X, Y], -1)
    mirrored = field[:, ::-1] * [-1, 1]
    filled = fill_gradients(mirrored, HIDDEN[:, ::-1], method)[:, ::-1] * [-1, 1]
    tolerance = 0.2 if method == "nearest" else 1e-3  # equally near pixels: either may be taken
    np.testing.assert_allclose(filled, fill_gradients(field, HIDDEN, method), atol=tolerance)


@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_ours_errs_less_than_seven_tenths_of_nearest_on_balls(noise):
    rng = np.random.default_rng(0)
    errors = {method: [] for method in ("zero", "nearest", "biharmonic", "surface")}
    for x, y in rng.uniform([22, 18], [42, 30], (12, 2)):
        gradient = ball_cap((WIDTH, HEIGHT), (x, y), 2.6, 4.0, (0.1, 0.1)).gradient
        noisy = spoiled(gradient + noise * rng.normal(size=gradient.shape))
        touched = HIDDEN & gradient.any(-1)
        for method, found in errors.items():
            filled = fill_gradients(noisy, HIDDEN, method)
            found.extend(np.abs(filled - gradient)[touched].ravel())
    means = {method: np.mean(found) for method, found in errors.items()}
    assert means["surface"] < 0.7 * means["nearest"] < means["zero"]
    assert means["surface"] < means["biharmonic"]


def test_two_slopes_of_one_surface_help_each_other():
    """Hidden across a ridge, one slope is guessed better where the other is looked at."""
    ridge = np.tanh(8 * (X + 0.4 * Y))
    slopes = np.stack([ridge, 0.4 * ridge], -1)
    pitch = (2 / (WIDTH - 1), 2 / (HEIGHT - 1))
    hidden = dots(radius_px=4.5)
    error = {
        method: np.abs(fill_gradients(spoiled(slopes, hidden), hidden, method, pitch) - slopes)[
            hidden
        ].mean()
        for method in ("biharmonic", "surface")
    }
    assert error["surface"] < 0.8 * error["biharmonic"]


@pytest.mark.parametrize("method", METHODS[1:2] + METHODS[4:])
def test_a_wide_hidden_area_is_filled_from_its_edge_in_bounded_work(method):
    hidden = np.zeros((200, 300), bool)
    hidden[:40] = hidden[:, :8] = True
    field = np.full((200, 300, 2), 0.3)
    filled = fill_gradients(spoiled(field, hidden), hidden, method)
    np.testing.assert_allclose(filled, field, atol=2e-3)


def test_what_is_prepared_once_fills_every_field():
    fill = prepare_fill(HIDDEN)
    for seed in range(3):
        field = random_field(seed)
        np.testing.assert_allclose(fill(field), fill_gradients(field, HIDDEN), atol=1e-6)


@pytest.mark.parametrize("hidden", [HIDDEN, np.ones_like(HIDDEN)], ids=["dots", "all"])
@pytest.mark.parametrize("method", ELASTIC)
def test_planes_are_filled_in_place_as_fields_are(method, hidden):
    field = random_field(7)
    planes = np.ascontiguousarray(np.moveaxis(spoiled(field, hidden), -1, 0))
    ElasticFill(hidden, method, 1.2).in_place(planes)
    wanted = fill_gradients(field, hidden, method, (0.1, 0.12))
    np.testing.assert_array_equal(np.moveaxis(planes, 0, -1), wanted)


@pytest.mark.parametrize("method", ELASTIC)
def test_of_planes_some_dots_alone_are_filled(method):
    fill, field = ElasticFill(HIDDEN, method, 1.0), random_field(9)
    planes = np.ascontiguousarray(np.moveaxis(field, -1, 0))
    few = fill.dots[3:5]
    fill.in_place(planes, few)
    filled, flat = np.moveaxis(planes, 0, -1), np.zeros(HIDDEN.size, bool)
    for dot in few:
        flat[dot.places] = True
    some = flat.reshape(HIDDEN.shape)
    np.testing.assert_array_equal(filled[some], fill(field)[some])
    np.testing.assert_array_equal(filled[~some], field[~some])
    assert 0 < some.sum() < HIDDEN.sum()


@pytest.mark.parametrize("method", ELASTIC)
def test_many_dots_of_one_shape_are_filled_as_each_alone(method):
    fill, field = ElasticFill(dots(pitch_px=8, radius_px=1.9), method, 1.1), random_field(5)
    together, alone = (np.ascontiguousarray(np.moveaxis(field, -1, 0)) for _ in range(2))
    fill.in_place(together)
    for dot in fill.dots:
        fill.in_place(alone, [dot])
    assert max(Counter(dot.shape for dot in fill.dots).values()) > MANY
    np.testing.assert_allclose(together, alone, atol=1e-5)


@pytest.mark.parametrize("method", ELASTIC)
def test_threads_that_fill_at_once_fill_alike(method):
    hidden = dots(at=(6.3, 2.4), radius_px=3.1)  # no other test has cached these shapes
    fill, fields = prepare_fill(hidden, method), [random_field(seed) for seed in range(8)]
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(fill, fields))
    for field, filled in zip(fields, found, strict=True):
        np.testing.assert_array_equal(filled, fill(field))


@pytest.mark.parametrize("method", METHODS)
def test_what_is_filled_is_a_new_field(method):
    planes = np.ascontiguousarray(np.moveaxis(random_field(8), -1, 0))
    kept = planes.copy()
    fill_gradients(np.moveaxis(planes, 0, -1), HIDDEN, method)  # a view of planes in a row
    np.testing.assert_array_equal(planes, kept)


def test_an_unknown_way_is_refused_by_name():
    with pytest.raises(WedgeError, match="no way of filling is called 'telea'"):
        fill_gradients(random_field(0), HIDDEN, "telea")


@pytest.mark.parametrize("method", ELASTIC)
def test_a_dot_is_filled_alike_wherever_it_lies_however_wide_the_frame(method):
    # The same gel in the corner of a narrow frame, then in the midst of wider ones, in one go.
    gel = np.random.default_rng(0).normal(size=(20, 20, 2))
    hidden = dots(size=(20, 20), at=(10.0, 9.0))
    alone = fill_gradients(gel, hidden, method)
    for top, left, width in ((20, 20, WIDTH), (5, 40, WIDTH), (20, 20, WIDTH + 7)):
        field, covered = np.ones((HEIGHT, width, 2)), np.zeros((HEIGHT, width), bool)
        there = np.s_[top : top + 20, left : left + 20]
        field[there], covered[there] = gel, hidden
        found = fill_gradients(field, covered, method)
        np.testing.assert_array_equal(found[there], alone)
        np.testing.assert_array_equal(found[~covered], field[~covered])


@pytest.mark.parametrize("method", METHODS)
def test_what_spans_no_triangle_is_filled_all_the_same(method):
    hidden = np.ones((HEIGHT, WIDTH), bool)
    for known in ([5], [5, 6], slice(5, 20)):
        hidden[7, known] = False
        filled = fill_gradients(np.full((HEIGHT, WIDTH, 2), 0.3), hidden, method)
        assert np.isfinite(filled).all() and (filled[~hidden] == 0.3).all()
