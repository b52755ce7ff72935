# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Units over dates: what has not moved is not accused, what has is named, and nothing else."""

import json
import shutil
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from recon.calibration import load_calibration
from recon.presses import read_presses
from sensor.dataset import read_dataset, write_labels
from sensor.errors import WedgeError
from tests.app.commands import run
from tests.synthetic import KEYSTONE_PX, make_dataset
from tests.validation.sensors import PRESSES, change_frames, good_set, unit_of
from validation import drift
from validation.depth import rmse_interval_mm
from validation.drift import DEPTH_ERRORS, ERRORS, evaluate_on, moves
from validation.evaluation import learnt_presses
from validation.figures.drift import drift_figure
from validation.report.drift import (
    drift_document,
    drift_sections,
    sentences,
    summary,
    verdict,
)


@pytest.fixture(scope="module")
def dates(tmp_path_factory):
    """A unit, and its sensor on three days; on the third its red light has aged."""
    folder = tmp_path_factory.mktemp("dates")
    unit_of(good_set(folder / "taught")).save(folder / "unit")
    days = [good_set(folder / name, seed) for seed, name in enumerate(("may", "june", "july"), 1)]
    change_frames(days[2], lambda frame, _: frame * [0.8, 1, 1])
    return folder


@pytest.fixture(scope="module")
def evaluations(dates):
    calibration = load_calibration(dates / "unit")
    return [
        evaluate_on(calibration, read_dataset(dates / name), seed=0)
        for name in ("may", "june", "july")
    ]


def test_days_alike_have_not_moved(evaluations):
    assert moves(evaluations[:2]) == []
    assert sentences([]) == []


def test_a_light_that_ages_is_named_and_no_other(evaluations):
    found = {move.name: move for move in moves(evaluations)}
    assert {"brightness_R", "answer_R"} <= set(found)
    assert not {name for name in found if name.endswith(("_G", "_B"))}
    assert found["brightness_R"].now / found["brightness_R"].before == pytest.approx(0.8, rel=0.01)
    assert found["answer_R"].now / found["answer_R"].before == pytest.approx(0.8, rel=0.1)


def relabelled(source, folder, change, *, extra=()):
    """The same frames under other names and labels, and those of another set."""
    names = {label.file: f"other-{index}.png" for index, label in enumerate(source.labels)}
    shutil.copytree(source.folder, folder)
    for old, new in names.items():
        (folder / old).rename(folder / new)
    labels = [replace(change(label), file=names[label.file]) for label in source.labels]
    for index, (set_, label) in enumerate(extra):
        shutil.copy(set_.folder / label.file, folder / f"more-{index}.png")
        labels.append(replace(label, file=f"more-{index}.png"))
    write_labels(folder / "labels.csv", labels)
    return read_dataset(folder)


def test_presses_that_were_learnt_from_are_known_again_by_their_pixels(dates, tmp_path):
    unit, taught = load_calibration(dates / "unit"), read_dataset(dates / "taught")
    june = read_dataset(dates / "june")
    moved = relabelled(
        taught, tmp_path / "moved", lambda x: replace(x, center_x_px=x.center_x_px + 0.5)
    )
    mixed = relabelled(june, tmp_path / "mixed", lambda x: x, extra=[(taught, taught.labels[3])])
    counts = {}
    for dataset in (taught, moved, mixed, june):
        presses = read_presses(dataset)
        counts[dataset.folder.name] = learnt_presses(unit.card, dataset, presses)
    assert counts == {"taught": PRESSES, "moved": PRESSES, "mixed": 1, "june": 0}
    before = replace(unit.card, learnt_frames=None)  # units of before know their dataset alone
    assert learnt_presses(before, taught, read_presses(taught)) == PRESSES
    assert learnt_presses(before, moved, read_presses(moved)) == 0


def test_errors_are_not_compared_with_those_on_presses_learnt_from(evaluations):
    first, *_ = evaluations
    worse = {name: replace(x, sums=10 * x.sums) for name, x in first.numbers.items()}
    later = replace(first, numbers=worse)
    named = {move.name for move in moves([first, later])}
    assert set(ERRORS) - {"depth_bias_mm"} <= named
    learnt = {move.name for move in moves([replace(first, learnt=1), later])}
    assert learnt == named - set(ERRORS) and learnt


def test_errors_are_compared_with_the_first_set_that_was_not_learnt_from(evaluations):
    may, june, july = (
        replace(item, dataset=name)
        for item, name in zip(evaluations, ("may", "june", "july"), strict=True)
    )
    numbers = {name: replace(x, sums=10 * x.sums) for name, x in june.numbers.items()}
    moved = moves([replace(may, learnt=PRESSES), june, replace(july, numbers=numbers)])
    assert {(move.since, move.dataset) for move in moved if move.name in ERRORS} == {
        ("june", "july")
    }
    assert {move.since for move in moved if move.name not in ERRORS} == {"may"}
    said = drift_sections([replace(may, learnt=PRESSES), june], [])[0].html
    assert f"{june.unit}: its errors were not compared" in said
    assert "were not compared" not in drift_sections([may, june], [])[0].html


def judged_against(item, *truths):
    """The same depths, said to have been judged against these truths in turn."""
    depth = {
        name: tuple(replace(error, truth=truths[i % len(truths)]) for i, error in enumerate(errors))
        for name, errors in item.errors.depth.items()
    }
    return replace(item, errors=replace(item.errors, depth=depth))


def test_depth_errors_are_not_compared_between_two_kinds_of_truth(evaluations):
    first, *_ = evaluations
    worse = {name: replace(x, sums=10 * x.sums) for name, x in first.numbers.items()}
    later = replace(first, dataset="later", numbers=worse)
    named = {move.name for move in moves([first, later])}
    assert "depth_rmse_mm" in named
    files = judged_against(later, "truth file")
    assert {move.name for move in moves([judged_against(first, "truth file"), files])} == named
    for other in (files, judged_against(later, "ball cap", "truth file")):
        moved = moves([first, other])
        assert {move.name for move in moved} == named - set(DEPTH_ERRORS)
        (said,) = [words for words in verdict([first, other], moved) if "depth errors" in words]
        assert f"{other.unit} on later" in said and f"on {first.dataset}" in said
    assert not any("depth errors" in words for words in verdict([first, later], []))


def test_an_error_has_the_interval_of_its_table_and_no_other(evaluations):
    for item in evaluations:
        (row,) = (row for row in item.errors.rows if row.pixels == "contact")
        for name in ("theta_x_deg", "theta_y_deg"):
            assert item.numbers[name].ci95 == row.errors.ci95[name]
            assert item.numbers[name].mean == pytest.approx(row.errors.values[name])
        (depth,) = item.errors.depth.values()
        found = item.numbers["depth_rmse_mm"].ci95
        assert found == rmse_interval_mm(depth, item.errors.seed)


def test_only_the_bias_is_signed(evaluations):
    assert {name for name, x in evaluations[0].numbers.items() if x.signed} == {"depth_bias_mm"}


def test_every_form_says_the_same(evaluations):
    moved = moves(evaluations)
    said = json.loads(json.dumps(drift_document(evaluations, moved), allow_nan=False))
    assert [item["number"] for item in said["moved"]] == [move.name for move in moved]
    assert len(said["evaluations"]) == 3 and len(sentences(moved)) == len(moved)
    pages = "".join(section.html for section in drift_sections(evaluations, moved))
    assert all(f"{item.numbers['noise'].mean:.3g}" in pages for item in evaluations)
    headings, rows = summary(evaluations)
    assert all(len(row) == len(headings) for row in rows)


def alone(item):
    """The same with its first press only."""
    first = {
        name: replace(x, sums=x.sums[:1], counts=x.counts[:1]) for name, x in item.numbers.items()
    }
    return replace(item, errors=replace(item.errors, test=1), numbers=first)


def drawn_spans(figure):
    """Lengths of all error bars."""
    bars = [bars for axes in figure.axes for bars in axes.containers]
    spans = [path for one in bars for lines in one.lines[2] for path in lines.get_segments()]
    return [np.ptp(span[:, 1]) for span in spans if np.isfinite(span).all() and len(span)]


def test_one_press_has_no_interval_and_tells_no_move(evaluations):
    june, july = alone(evaluations[1]), alone(evaluations[2])
    for days in ([evaluations[0], june, july], [alone(evaluations[0]), june]):
        several = sum(item.errors.test > 1 for item in days)
        moved = moves(days)
        numbers = [x for item in drift_document(days, moved)["evaluations"][several:]
                   for x in item["numbers"].values()]  # fmt: skip
        assert numbers and all(x["ci95"] is None for x in numbers)
        page = "".join(section.html for section in drift_sections(days, moved))
        assert page.count("<small>") == several * len(june.numbers)
        assert ("too few for an interval" in page) == (several == 0)
        assert ("there is none for 1 press" in page) == (several > 0)
        assert "Nothing changed" not in page
        assert f"to tell: {june.unit} on {june.dataset}" in page
        spans = drawn_spans(drift_figure(days, moved))
        assert len(spans) == several * len(june.numbers)


def test_nothing_moved_is_said_of_what_could_be_compared(evaluations):
    may, june, july = evaluations
    page = drift_sections([may, june, alone(july)], [])[0].html
    assert "Nothing changed." in page
    assert f"to tell: {july.unit} on {july.dataset}." in page


def test_units_with_other_lights_and_gels_stand_beside_each_other(evaluations):
    may = evaluations[0]
    lit = {name: x for name, x in may.numbers.items() if not name.endswith("_B")}
    short = {name: x for name, x in lit.items() if name != "noise"}  # no gel lay still
    for days in ([may, replace(may, unit="RG", numbers=short)], [replace(may, numbers=short), may]):
        headings, rows = summary(days)
        assert {len(row) for row in rows} == {len(headings)}
        assert sorted(row[-1] == "–" for row in rows) == [False, True]
        titles = [axes.get_title() for axes in drift_figure(days, []).axes if axes.get_visible()]
        assert len(titles) == len(may.numbers)


def test_no_words_of_the_plot_lie_outside_it(evaluations):
    figure = drift_figure(evaluations, moves(evaluations))
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    for axes in figure.axes:
        for text in (axes.title, *axes.get_xticklabels(), *axes.get_yticklabels()):
            if text.get_text() and axes.get_visible() and text.get_visible():
                box = text.get_window_extent(renderer)
                assert box.x0 >= 0 and box.x1 <= canvas.get_width_height()[0]


def test_a_quantity_s_lights_stand_in_one_row_and_no_titles_meet(evaluations):
    figure = drift_figure(evaluations, [])
    figure.canvas.draw()
    titles = {
        text.get_text(): text.get_window_extent()
        for axes in figure.axes
        for text in axes.findobj(Text)
        if axes.get_visible() and text.get_text() and text.get_text() == axes.get_title("left")
    }
    assert len(titles) == len(evaluations[0].numbers)
    rows = {title: round(box.y0) for title, box in titles.items()}
    for quantity in ("error of", "brightness", "response to slope"):
        assert len({row for title, row in rows.items() if title.startswith(quantity)}) == 1
    for one, other in combinations(titles, 2):
        left, right = sorted((titles[one], titles[other]), key=lambda box: box.x0)
        assert rows[one] != rows[other] or left.x1 + left.height < right.x0


def test_the_command_takes_several_days_and_leaves_out_another_sensor(dates, tmp_path, capsys):
    other = make_dataset(tmp_path / "other", presses=3, corners_px=KEYSTONE_PX).folder
    page, numbers = tmp_path / "page", tmp_path / "n.json"
    words = ["evaluate", dates / "unit", dates / "may", dates / "july", other]
    assert run(*words, "--out", page, "--json", numbers) == 2
    printed = capsys.readouterr()
    assert "brightness, R changed" in printed.out and "another sensor" in printed.err
    assert (page / "index.html").stat().st_size > 5000
    said = json.loads(numbers.read_text())
    assert len(said["evaluations"]) == 2
    (left_out,) = said["left_out"]
    assert left_out["dataset"] == f"synthetic ({other})" and "another sensor" in left_out["reason"]
    # One that is left of several that were named is written as of several.
    assert run("evaluate", dates / "unit", dates / "may", other, "--json", numbers) == 2
    said = json.loads(numbers.read_text())
    assert len(said["evaluations"]) == len(said["left_out"]) == 1


def test_units_that_meet_each_other_s_sets_are_no_failure(dates, tmp_path, capsys):
    other = make_dataset(tmp_path / "other", corners_px=KEYSTONE_PX)
    taught = unit_of(other)
    card = replace(taught.card, serial="wedge-008")
    replace(taught, card=card).save(tmp_path / "unit")
    numbers = tmp_path / "n.json"
    pairs = [dates / "unit", tmp_path / "unit", dates / "may", other.folder]
    assert run("evaluate", *pairs, "--json", numbers) == 0
    said, printed = json.loads(numbers.read_text()), capsys.readouterr().err
    assert [item["unit"] for item in said["evaluations"]] == ["wedge-007", "wedge-008"]
    assert [line["unit"] for line in said["left_out"]] == ["wedge-007", "wedge-008"]
    assert all(f"left out: {line['reason']}" in printed for line in said["left_out"])
    # A set that fits neither, and a unit that no set fits, are missed.
    poor = make_dataset(tmp_path / "poor", presses=1)
    write_labels(poor.folder / "labels.csv", [])
    assert run("evaluate", *pairs, poor.folder) == 2
    assert run("evaluate", *pairs[:3]) == 2


def test_sets_of_one_name_are_told_apart_and_one_folder_is_taken_once(dates, tmp_path, capsys):
    july, numbers = read_dataset(dates / "july"), tmp_path / "n.json"
    shutil.copytree(july.folder, tmp_path / "july")
    labels = [replace(july.labels[0], contact_radius_px=1.0), *july.labels[1:]]
    write_labels(tmp_path / "july" / "labels.csv", labels)
    words = [dates / "unit", dates / "may", f"{dates / 'may'}/", tmp_path / "july"]
    assert run("evaluate", *words, "--json", numbers) == 0
    said = json.loads(numbers.read_text())
    sets = [f"synthetic ({folder})" for folder in (dates / "may", tmp_path / "july")]
    assert [item["dataset"] for item in said["evaluations"]] == sets
    assert {(move["since"], move["dataset"]) for move in said["moved"]} == {tuple(sets)}
    printed = capsys.readouterr().err
    assert f"{sets[1]}: left out 1 press" in printed and labels[0].file in printed


def test_another_sensor_s_set_is_refused_before_all_of_it_is_read(dates, tmp_path, monkeypatch):
    other = make_dataset(tmp_path / "other", presses=3, corners_px=KEYSTONE_PX)
    monkeypatch.setattr(drift, "read_presses", lambda *_: pytest.fail("read it"))
    with pytest.raises(WedgeError, match="another sensor"):
        evaluate_on(load_calibration(dates / "unit"), other, seed=0)


@pytest.mark.parametrize(("presses", "said"), [(1, "on the 1 press:"), (2, "on all 2 presses")])
def test_how_many_were_learnt_from_is_counted(dates, tmp_path, capsys, presses, said):
    shutil.copytree(dates / "taught", tmp_path / "some")
    write_labels(tmp_path / "some" / "labels.csv", read_dataset(dates / "taught").labels[:presses])
    assert run("evaluate", dates / "unit", tmp_path / "some") == 0
    assert said in capsys.readouterr().err


def test_the_command_does_not_say_that_one_press_shows_no_move(dates, tmp_path, capsys):
    july = read_dataset(dates / "july")
    shutil.copytree(july.folder, tmp_path / "one")
    write_labels(tmp_path / "one" / "labels.csv", july.labels[:1])
    assert run("evaluate", dates / "unit", dates / "may", tmp_path / "one") == 0
    printed = capsys.readouterr().out
    assert "Nothing changed" not in printed and "Too few presses" in printed


def test_two_units_of_one_serial_are_refused_before_anything_is_measured(dates, tmp_path, capsys):
    shutil.copytree(dates / "unit", tmp_path / "unit")
    numbers = tmp_path / "n.json"
    words = ["evaluate", dates / "unit", tmp_path / "unit", dates / "may", "--json", numbers]
    assert run(*words) == 2
    (said,) = capsys.readouterr().err.splitlines()
    assert f"{dates / 'unit'} and {tmp_path / 'unit'} are both unit wedge-007" in said
    assert not numbers.exists()


@pytest.mark.parametrize("words", [[], ["{unit}"], ["{may}"], ["{unit}", "{unit}/nothing"]])
def test_a_unit_or_a_dataset_that_is_missing_is_said(dates, words, capsys):
    named = [word.format(unit=dates / "unit", may=dates / "may") for word in words]
    assert run("evaluate", *named) == 2
    assert len(capsys.readouterr().err.strip().splitlines()[-1]) > 20
