# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""One light and two beside three, on a rendered set that knows the depth of one shape."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from benchmarks.few_lights import HELD_OUT, _answers, _shapes
from recon.ball import ball_cap, offsets_mm
from recon.estimators import fit_estimator, lesson_of
from recon.estimators.effort import Effort
from recon.estimators.lookup_table import LookupTable
from recon.presses import read_presses
from recon.still import REACH
from sensor.dataset import read_dataset
from tests.synthetic import (
    BALL_RADIUS_MM,
    MM_PER_PX,
    SIZE_PX,
    digitized,
    gradient_of,
    make_dataset,
    shaded,
)
from validation.datasets import dataset_folder
from validation.few_lights import WAYS, measure_touches
from validation.figures.few_lights import few_lights_figure
from validation.folds import fit_presses
from validation.report.few_lights import few_lights_section

NETWORK = "two lights, network"
CHANCY = {"ball_array", "screw_cap"}
"""Shapes of the twin that leave little margin on some processors."""


@pytest.fixture(scope="module")
def touches(tmp_path_factory):
    dataset = make_dataset(tmp_path_factory.mktemp("few") / "set")
    folder = dataset.folder
    (folder / "truth").mkdir()
    press = dataset.labels[3]
    place = (press.center_x_px, press.center_y_px, 14.0)
    for name, dent in (("dome", place), ("other", (30.0, 30.0, 12.0))):
        frame = digitized(shaded(gradient_of(dent)))
        cv2.imwrite(str(folder / f"{name}.jpg"), frame[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, 98])
    cap = ball_cap(SIZE_PX, place[:2], 1.4, BALL_RADIUS_MM, MM_PER_PX)
    for name in ("dome", "other"):
        np.save(folder / "truth" / f"{name}.npy", cap.depth_mm.astype(np.float32))
    return measure_touches(folder, "table", ("dome",))


def test_a_ball_and_the_shapes_asked_for_are_measured_every_way(touches):
    assert [touch.name for touch in touches] == ["ball", "dome"]
    for touch in touches:
        assert set(touch.depth_mm) == set(touch.rmse_mm) == {way for way, _, _ in WAYS}
        assert touch.doubt.shape == touch.truth_mm.shape and touch.doubt.max() > 0


def test_the_network_beats_zero_and_is_nowhere_negative(touches):
    for touch in touches:
        assert touch.rmse_mm[NETWORK] < 0.6 * touch.rmse_mm["two lights, zero"]
        assert touch.lowest(NETWORK) >= 0 and touch.lowest("one light, network") >= 0
        assert touch.lowest("two lights, zero") < 0


class Reaching(LookupTable):
    """As ``default``, it takes gel far from all that moved for flat."""

    reach = REACH


def test_three_lights_are_compared_as_a_unit_has_them(tmp_path):
    dataset = make_dataset(tmp_path / "set", presses=4, noise_gray_levels=2)
    presses = read_presses(dataset).presses
    few, whole = (
        fit_presses(presses, (1, 2, 3), "table", lights, seed=0) for lights in ("RB", "RGB")
    )
    answers = _answers(few, Reaching(**vars(whole)), presses[0], dataset.card.lights_deg)
    x_mm, y_mm = offsets_mm(SIZE_PX, presses[0].center_px, MM_PER_PX)
    far = np.hypot(x_mm, y_mm) > 3 * presses[0].contact_radius_mm
    assert far.any() and not answers["three lights"][far].any()
    assert answers["zero"][far].any()


def test_two_lights_have_at_most_one_and_a_half_times_the_depth_error_of_three():
    dataset = read_dataset(dataset_folder("twin-finger"))
    presses = read_presses(dataset).presses
    taught = [index for index in range(len(presses)) if index % HELD_OUT]
    lesson = lesson_of("mlp", presses, taught, seed=0)
    few, whole = (
        fit_estimator("mlp", lesson, lights, seed=0, effort=Effort.SLOPES)
        for lights in ("RB", "RGB")
    )
    shapes, _ = _shapes(dataset, few, whole)
    assert len(shapes) == 8
    for name in sorted(shapes.keys() - CHANCY):
        error_mm = shapes[name]
        assert error_mm["network"] <= 1.5 * error_mm["three lights"] < error_mm["zero"], name


def test_the_section_says_every_number_and_shows_every_touch(touches):
    section = few_lights_section({"made": touches})
    for touch in touches:
        assert f"{touch.name}, made" in section.html
        for rmse in touch.rmse_mm.values():
            assert f"{rmse:.3f}" in section.html
        least = round(100 * touch.lowest("two lights, zero"))
        assert f"<td>−{-least} %</td><td>0 %</td>" in section.html
    maps = [axes for axes in few_lights_figure(touches).axes if axes.images]
    assert len(maps) == len(touches) * (len(WAYS) + 2)


def test_every_column_has_a_heading_and_every_row_the_name_that_tables_use(touches):
    named = [replace(touches[0], name="m2_screw"), replace(touches[1], name="ball_array")]
    maps = [axes for axes in few_lights_figure(named).axes if axes.images]
    lefts = {axes.get_position().x0 for axes in maps}
    headed = {
        axes.get_position().x0: axes.get_title("left") for axes in maps if axes.get_title("left")
    }
    assert set(headed) == lefts and headed[min(lefts)] == "truth"
    firsts = [axes for axes in maps if axes.get_position().x0 == min(lefts)]
    assert [axes.get_ylabel() for axes in firsts] == ["M2 screw", "ball array"]


@pytest.mark.parametrize("deepest_mm", [0.06, 0.58, 1.2, 12.0])
def test_the_bars_words_run_into_no_map(touches, deepest_mm):
    scale = deepest_mm / max(depth.max() for depth in touches[0].depth_mm.values())
    deep = {way: np.float32(scale) * depth for way, depth in touches[0].depth_mm.items()}
    truth_mm = touches[0].truth_mm * (0.9 * deepest_mm / touches[0].truth_mm.max())
    figure = few_lights_figure([replace(touches[0], depth_mm=deep, truth_mm=truth_mm)])
    FigureCanvasAgg(figure).draw()
    maps = [axes.get_window_extent() for axes in figure.axes if axes.images]
    bars = [axes for axes in figure.axes if not axes.images]
    words = [text.get_window_extent() for axes in bars for text in axes.findobj(Text)
             if text.get_text() and text.get_visible()]  # fmt: skip
    assert len(bars) == 2 and len(words) > 6
    assert not [word for word in words for place in maps if word.overlaps(place)]
    assert max(word.x1 for word in words) <= figure.bbox.x1
