# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Estimators side by side: maps, curves and coverage show what was put into them."""

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from recon.presses import read_presses
from tests.synthetic import make_dataset
from validation.examples import held_out
from validation.figures.side_by_side import NO_INTERVAL, side_by_side_figure
from validation.folds import fit_folds
from validation.report.side_by_side import side_by_side_section
from validation.side_by_side import Unseen, by_steepness, covered, error_map_deg, unseen_slopes


def unseen(name="ours", spread=0.1, half_width=None, tilt=0.0, count=60_000):
    rng = np.random.default_rng(0)
    steepness = rng.uniform(0, 1.5, count)
    azimuth = rng.uniform(-np.pi, np.pi, count)
    truth = np.stack([np.cos(azimuth), np.sin(azimuth)], 1) * steepness[:, None]
    error = spread * rng.standard_normal(truth.shape)
    error += tilt * (truth[:, :1] < 0)  # where the skin faces right
    return Unseen(
        estimator=name,
        truth=truth.astype(np.float32),
        estimated=(truth + error).astype(np.float32),
        half_width=None if half_width is None else np.full(truth.shape, half_width, np.float32),
        n_presses=8,
    )


def test_gaussian_errors_are_covered_as_their_quantile_says():
    inside = covered(unseen(half_width=1.6449 * 0.1))
    assert inside.mean() == pytest.approx(0.9, abs=0.005)
    assert covered(unseen()) is None


def test_the_map_is_worse_where_the_skin_faces_the_side_that_errs():
    found = error_map_deg(unseen(spread=0.01, tilt=0.2), 21, 0.8)
    left, right = np.nanmean(found[:, :9]), np.nanmean(found[:, 12:])
    assert right > 5 * left
    upper, lower = np.nanmean(found[:9]), np.nanmean(found[12:])
    assert upper == pytest.approx(lower, rel=0.1)
    assert np.isnan(found[0, 0])  # steeper than anything that was seen


def test_curves_follow_the_slope():
    item = unseen()
    edges = np.linspace(0, 2, 9)
    means = by_steepness(item, item.steepness, edges)
    assert means[:6] == pytest.approx((edges[:6] + edges[1:7]) / 2, abs=0.01)
    assert np.isnan(means[6:]).all()


def test_the_headline_estimators_pixels_are_those_of_the_others(tmp_path):
    dataset = make_dataset(tmp_path / "set", presses=8)
    (fold,) = fit_folds(read_presses(dataset).presses, "table", "RGB", folds=1, seed=0)
    alone = unseen_slopes(dataset.folder, fold, 0)
    beside = held_out(dataset.folder, fold, 0).unseen
    assert (alone.truth == beside.truth).all() and (alone.estimated == beside.estimated).all()
    assert alone.error_deg.mean() < 2 and alone.half_width is None


@pytest.mark.parametrize("half_width", [1e-6, 0.01, 0.1, 9.0])
def test_coverage_is_shown_however_low(half_width):
    plot = side_by_side_figure([unseen(half_width=half_width)]).axes[-1]
    low, high = plot.get_ylim()
    coverage = plot.lines[0].get_ydata()
    assert 0 <= low <= np.nanmin(coverage) and np.nanmax(coverage) <= high == 100


@pytest.mark.parametrize("half_widths", [(None, None), (None, 0.1)])
def test_where_no_estimator_tells_an_interval_the_panel_says_so(half_widths):
    items = [unseen(f"estimator {n}", half_width=x) for n, x in enumerate(half_widths)]
    said = [text.get_text() for text in side_by_side_figure(items).axes[-1].texts]
    assert said == [NO_INTERVAL] * (half_widths == (None, None))


def test_curves_are_told_apart_without_their_colours():
    items = [unseen(f"estimator {n}", half_width=0.1) for n in range(3)]
    for plot in side_by_side_figure(items).axes[-2:]:
        marks = [line.get_marker() for line in plot.lines if "estimator" in line.get_label()]
        assert len(set(marks)) == len(marks) == 3 and "None" not in marks


@pytest.mark.parametrize(("count", "pixels"), [(1, 20_000), (3, 20_000), (2, 30)])
def test_the_figure_clips_no_words_and_the_section_names_all(count, pixels):
    items = [unseen(f"estimator {n}", 0.05 * (n + 1), 0.1, count=pixels) for n in range(count)]
    figure = side_by_side_figure(items)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer, (width, height) = canvas.get_renderer(), canvas.get_width_height()
    for axes in figure.axes:
        for text in (axes.title, axes.xaxis.label, axes.yaxis.label):
            if text.get_text():
                box = text.get_window_extent(renderer)
                assert box.x0 >= 0 and box.x1 <= width and box.y0 >= 0 and box.y1 <= height
    section = side_by_side_section({"set": items})
    assert all(item.estimator in section.html for item in items)
