# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What is expected of depth's errors against what becomes of slopes that are wrong."""

from types import SimpleNamespace

import numpy as np
import pytest

from recon.cloud import point_cloud
from recon.depth_error import (
    CORRELATED_MM,
    LAPLACE,
    MOST_INFERRED,
    NORMAL90,
    depth_error,
    depth_noise,
    slope_error,
)
from recon.estimators import GradientEstimator
from recon.integration.poisson import integrate
from recon.pipeline import reconstruct
from recon.still import REACH

WIDTH, HEIGHT, PITCH = 40, 30, (0.1, 0.12)
OPPOSED_DEG = {"R": 90.0, "B": 270.0}


def scattered(slopes, count=300, pitch=PITCH, boundary="dirichlet", seed=0):
    """Standard deviation of depth over frames whose slopes ``slopes`` draws."""
    rng = np.random.default_rng(seed)
    depths = np.stack([integrate(slopes(rng), pitch, boundary) for _ in range(count)])
    return depths.std(0)


def told(half_width, channels="RGB"):
    """An estimator that takes colours for slopes, and tells how wrong they are."""

    def like(slopes):
        return None if half_width is None else np.full_like(slopes, half_width)

    return SimpleNamespace(
        name="told",
        reach=REACH,
        looks_around=False,
        channels=channels,
        prepared=lambda difference: difference,
        asked=lambda difference: difference,
        slopes=lambda color, position: color[:, :2],
        lean=np.zeros_like,
        half_width=like,
        tensors=dict,
    )


@pytest.mark.parametrize("boundary", ["dirichlet", "neumann"])
def test_independent_noise_becomes_what_the_closed_form_says_and_no_more_at_a_zero_border(boundary):
    found = scattered(lambda rng: rng.normal(size=(HEIGHT, WIDTH, 2)), 400, boundary=boundary)
    expected = depth_noise((HEIGHT, WIDTH), PITCH, boundary)
    assert np.median(found / expected) == pytest.approx(1, abs=0.03)
    ratio = found / expected
    exact = ratio if boundary == "neumann" else ratio[3:-3, 3:-3]
    assert 0.85 < exact.min() and 0.55 < ratio.min() and ratio.max() < 1.15


@pytest.mark.parametrize("boundary", ["dirichlet", "neumann"])
def test_the_same_error_everywhere_is_a_multiple_of_independent_noise(boundary):
    found = depth_error(np.full((HEIGHT, WIDTH, 2), 0.1), PITCH, boundary)
    pixels = CORRELATED_MM**2 / (PITCH[0] * PITCH[1])
    expected = 0.1 * np.sqrt(pixels) * depth_noise((HEIGHT, WIDTH), PITCH, boundary)
    np.testing.assert_allclose(found, expected, rtol=1e-5)


@pytest.mark.parametrize("boundary", ["dirichlet", "neumann"])
def test_an_error_is_expected_to_grow_a_little_with_the_number_of_pixels(boundary):
    told_mm = [
        np.median(depth_error(np.full((120 * n, 160 * n, 2), 0.1), (0.1 / n,) * 2, boundary))
        for n in (1, 2, 4)
    ]
    grown = np.divide(told_mm[1:], told_mm[:-1])
    assert 1.04 < grown.min() and grown.max() < 1.1


def test_errors_that_go_together_over_squares_scatter_depth_by_no_more_than_expected():
    side_px = 8
    pitch = (CORRELATED_MM / side_px,) * 2
    rows, columns = 12, 15
    shape = (rows * side_px, columns * side_px)

    def blocks(rng):
        # Shifted at random, lest pixels differ by where they lie in their square.
        drawn = rng.normal(0, 0.1, (rows + 1, columns + 1, 2)).repeat(side_px, 0)
        down, right = rng.integers(0, side_px, 2)
        return drawn.repeat(side_px, 1)[down : down + shape[0], right : right + shape[1]]

    ratio = scattered(blocks, pitch=pitch) / depth_error(
        np.full((*shape, 2), 0.1), pitch, "dirichlet"
    )
    inner = ratio[side_px:-side_px, side_px:-side_px]
    # Short waves count in full; beside a zero border this is more cautious still.
    assert 0.65 < np.median(inner) < 0.85 and ratio.max() < 1


def test_depth_is_less_certain_where_slopes_are_and_never_surer_than_it_scatters():
    wrong = np.zeros((90, 120, 2), np.float32)
    wrong[:, :40] = 0.1
    found = scattered(lambda rng: rng.normal(size=wrong.shape) * wrong, pitch=(0.1, 0.1))
    independent = depth_error(wrong, (0.1, 0.1), "dirichlet") * 0.1 / CORRELATED_MM
    ratio = (found / independent)[10:-10, 5:-5]
    assert ratio.max() < 1.25 and ratio[:, :30].min() > 0.75
    assert independent[45, 20] > 3 * independent[45, 100]


def test_an_error_is_expected_at_any_size_of_frame():
    for shape in ((1, 1), (3, 200), (97, 83), (480, 640)):
        found = depth_error(np.full((*shape, 2), 0.1, np.float32), PITCH, "dirichlet")
        assert found.shape == shape and np.isfinite(found).all() and (found > 0).all()


def test_inferred_slopes_are_as_wrong_as_their_doubt_says():
    gradient, doubt = np.zeros((4, 5, 2), np.float32), np.full((4, 5), 0.1, np.float32)
    known = slope_error(told(0.1645, "RB"), gradient, OPPOSED_DEG, doubt)
    np.testing.assert_allclose(known[..., 0], 0.1 * LAPLACE)
    np.testing.assert_allclose(known[..., 1], 0.1)
    assert slope_error(told(None, "RB"), gradient, OPPOSED_DEG, doubt) is None
    assert slope_error(told(None), gradient, None, None) is None
    assert slope_error(None, gradient, None, None) is None


def test_doubt_is_the_mean_absolute_error_of_laplaces_law():
    errors = np.random.default_rng(0).laplace(scale=0.1, size=100_000)
    gradient, doubt = np.zeros((1, 1, 2), np.float32), np.full((1, 1), np.abs(errors).mean())
    known = slope_error(told(0.1645, "RB"), gradient, OPPOSED_DEG, doubt)
    assert known[0, 0, 0] == pytest.approx(errors.std(), rel=0.01)


def test_a_few_guesses_do_not_make_up_what_is_expected_of_depth():
    gradient, doubt = np.zeros((60, 80, 2), np.float32), np.full((60, 80), 0.03, np.float32)
    doubt[30, 40:48] = 2.0  # a pixel in 600
    known = slope_error(told(0.1645, "RB"), gradient, OPPOSED_DEG, doubt)
    assert known[..., 0].max() == pytest.approx(MOST_INFERRED)
    uncapped = np.stack([LAPLACE * doubt, known[..., 1]], -1)
    capped_mm, uncapped_mm = (
        depth_error(error, PITCH, "dirichlet")[30, 44] for error in (known, uncapped)
    )
    certain = np.broadcast_to(known[0, 0], known.shape)
    assert capped_mm < 2 * depth_error(certain, PITCH, "dirichlet")[30, 44]
    assert capped_mm < 0.3 * uncapped_mm


@pytest.mark.parametrize("missing", ["zero", "none"])
def test_nobody_knows_how_wrong_an_unseen_slope_is_that_was_not_inferred(missing):
    difference = np.zeros((60, 80, 3), np.float32)
    difference[25:35, 30:50] = 0.5
    touches = [
        reconstruct(
            difference,
            told(0.1645, channels),
            missing=missing,
            lights_deg={"R": 90.0, "B": 270.0, "G": 0.0},
            mm_per_px=(0.1, 0.1),
        )
        for channels in ("RB", "RGB")
    ]
    assert touches[0].slope_error is None and np.isnan(point_cloud(touches[0]).sigma_mm).all()
    assert touches[1].slope_error is not None and (point_cloud(touches[1]).sigma_mm > 0).all()


def test_flattened_gel_does_not_make_points_certain():
    """Slopes of still gel are set to zero, in which no noise is left to be read."""
    difference = np.zeros((60, 80, 3), np.float32)
    difference[25:35, 30:50] = 0.5
    estimator = told(0.1645)
    assert isinstance(estimator, GradientEstimator)
    touch = reconstruct(
        difference, estimator, missing="none", lights_deg=None, mm_per_px=(0.1, 0.1)
    )
    assert (touch.gradient[~touch.contact] == 0).mean() > 0.5
    cloud = point_cloud(touch)
    expected = depth_error(np.full((60, 80, 2), 0.1), (0.1, 0.1), touch.boundary)
    np.testing.assert_allclose(cloud.sigma_mm, expected.ravel(), rtol=1e-4)


@pytest.mark.parametrize("pitch", [(0.1, 0.25), (0.25, 0.1)])
def test_variances_are_averaged_by_the_inverse_square_of_the_distance_in_mm(pitch):
    """Summed pixel by pixel, on few enough of them that each is a cell of its own."""
    height, width = 9, 14
    error = np.random.default_rng(0).uniform(0.05, 0.3, (height, width, 2)).astype(np.float32)
    error[2, 11] = 2.0
    rows, columns = np.indices((height, width)).reshape(2, -1)
    x_mm, y_mm = columns * pitch[0], rows * pitch[1]
    square_mm2 = np.subtract.outer(x_mm, x_mm) ** 2 + np.subtract.outer(y_mm, y_mm) ** 2
    weight = 1 / np.maximum(square_mm2, pitch[0] * pitch[1] / 4)  # itself: at half its width
    variance = np.square(error, dtype=float).mean(-1).ravel()
    around = (weight @ variance / weight.sum(1)).reshape(height, width)
    squares = CORRELATED_MM / np.sqrt(pitch[0] * pitch[1])
    expected = squares * depth_noise((height, width), pitch, "neumann") * np.sqrt(around)
    np.testing.assert_allclose(depth_error(error, pitch, "neumann"), expected, rtol=1e-4)


@pytest.mark.parametrize("first", [0, 1])
def test_of_a_frame_with_more_pixels_than_cells_every_pixel_counts(first):
    """One of four that is wrong leaves a quarter of the variance, wherever it lies."""
    every = np.full((120, 160, 2), 0.1, np.float32)
    some = np.zeros_like(every)
    some[first::2, ::2] = 0.1
    whole, quarter = (depth_error(error, (0.1, 0.1), "dirichlet") for error in (every, some))
    inner = np.s_[10:-10, 10:-10]
    np.testing.assert_allclose(quarter[inner], whole[inner] / 2, rtol=0.02)


@pytest.mark.parametrize("line_deg", [45.0, -45.0, 135.0])
def test_of_a_line_between_the_axes_both_slopes_are_doubted_alike(line_deg):
    gradient, doubt = np.zeros((6, 8, 2), np.float32), np.full((6, 8), 0.1, np.float32)
    lights_deg = {"R": line_deg, "B": line_deg + 180}
    known = slope_error(told(0.1645, "RB"), gradient, lights_deg, doubt)
    np.testing.assert_allclose(known[..., 0], known[..., 1], rtol=1e-5)
    across2, along2 = (LAPLACE * 0.1) ** 2, (0.1645 / NORMAL90) ** 2
    np.testing.assert_allclose(np.square(known).sum(-1), across2 + along2, rtol=1e-4)
