# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The error table: the paper's rows, whatever runs them, judged on presses never learnt from."""

import json
import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

import app.table
import recon.estimators.mlp_training as mlp_training
from recon.estimators import lesson_of
from recon.estimators.effort import Effort
from recon.estimators.lesson import FEW
from recon.presses import read_presses
from sensor.dataset import read_dataset, write_card, write_labels
from tests.app.commands import run
from tests.synthetic import make_dataset
from validation import error_table as module
from validation.contact import ball_overlaps
from validation.error_table import configurations, error_table, widest
from validation.evaluation import hold_out
from validation.metrics import METRICS
from validation.report.error_tables import table_section
from validation.splits import Split
from validation.table_text import (
    caption,
    column_headings,
    error_table_html,
    table_document,
    table_markdown,
)


@pytest.fixture(autouse=True, scope="module")
def quick_training():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mlp_training, "PIXELS", 4000)
        patch.setattr(mlp_training, "EPOCHS", 20)
        patch.setattr(mlp_training, "BATCH", 128)
        yield


@pytest.fixture(scope="module")
def one_thread():
    with ThreadPoolExecutor(1) as executor:
        yield executor


def measured(tmp_path, executor, *, folds=1, estimators=("table",), **options):
    dataset = make_dataset(tmp_path / "set", presses=10, **options)
    return error_table(dataset.folder, estimators, folds=folds, seed=0, executor=executor)


@pytest.fixture(scope="module")
def table(tmp_path_factory, one_thread):
    """Of a sensor lit like the Wedge."""
    return measured(tmp_path_factory.mktemp("table"), one_thread)


@pytest.fixture(scope="module")
def network_errors(tmp_path_factory, one_thread):
    """The same with the network, by lights."""
    measured_by = measured(tmp_path_factory.mktemp("mlp"), one_thread, estimators=("mlp",))
    return errors_by_lights(measured_by)


def errors_by_lights(table):
    return {
        (row.configuration, row.missing_axis): row.errors.values
        for row in table.rows
        if row.pixels == "contact"
    }


def test_a_sensor_lit_like_the_wedge_has_the_papers_six_rows(table):
    rows = [(row.configuration, row.missing_axis) for row in table.rows if row.pixels == "contact"]
    assert rows == [
        ("R", "zero"),
        ("R", "network"),
        ("RB", "zero"),
        ("RB", "network"),
        ("RG", "none"),
        ("RGB", "none"),
    ]
    assert [row.pixels for row in table.rows].count("contact+5%") == 6


def test_other_sensors_have_every_subset():
    subsets = {"R", "G", "B", "RG", "RB", "GB", "RGB"}
    found = configurations({"R": 115.0, "G": -122.0, "B": -2.0})
    assert set(found) == set(configurations(None)) == subsets
    # Each alone lies on a line of its own; nobody said where the other set's lights sit.
    assert {found[lights] for lights in ("R", "G", "B")} == {("zero", "network")}
    assert {found[lights] for lights in ("RG", "RB", "GB", "RGB")} == {("none",)}
    assert set(configurations(None).values()) == {("none",)}


def test_only_lights_that_a_sensor_has_are_measured_and_as_its_unit_reads_them(
    tmp_path, one_thread
):
    lights = {"R": 90.0, "B": -90.0}
    both = ("zero", "network")
    assert configurations(lights) == {"R": both, "B": both, "RB": both}
    table = measured(tmp_path, one_thread, lights_deg=lights)
    found = errors_by_lights(table)
    assert found["RB", "network"]["gx_mae"] < 0.5 * found["RB", "zero"]["gx_mae"]
    dataset = read_dataset(tmp_path / "set")
    unit = hold_out(dataset, read_presses(dataset), "table", seed=0)
    (missing,) = {row.missing_axis for row in unit.rows}
    assert found["RB", missing] == errors_by_lights(unit)["RB", missing]
    assert table.depth == unit.depth
    assert table.folds_fitted["table"][0].estimator.channels == "RB"


def test_an_estimator_can_be_spared_all_but_all_lights(tmp_path, one_thread):
    dataset = make_dataset(tmp_path / "set", presses=6)
    table = error_table(
        dataset.folder,
        ("table", "mlp"),
        folds=1,
        seed=0,
        executor=one_thread,
        all_lights_only=("mlp",),
    )
    lights = {
        name: {row.configuration for row in table.rows if row.estimator == name}
        for name in ("table", "mlp")
    }
    assert lights == {"table": {"R", "RB", "RG", "RGB"}, "mlp": {"RGB"}}
    assert {name: len(errors) for name, errors in table.depth.items()} == {"table": 1, "mlp": 1}
    assert [line[0] for line in widest(table.rows)] == ["R", "R", "RB", "RB", "RG", "RGB"]
    page = table_section(table).html
    assert page.count("–</td>") == 2 * 4 * 5  # pixel sets, metrics, configurations without mlp


def test_zero_means_the_slope_itself_is_the_error(table):
    """With the unseen axis at zero, its error is the mean slope of the truth."""
    row = next(row for row in table.rows if row.missing_axis == "zero")
    x_and_y = row.errors.values["gx_mae"], row.errors.values["gy_mae"]
    assert x_and_y[0] == pytest.approx(row.errors.mean_abs_gradient, rel=0.02)
    assert x_and_y[1] < 0.5 * x_and_y[0]


def test_network_infers_most_of_the_axis_that_no_light_sees(network_errors):
    assert network_errors["RB", "network"]["gx_mae"] < 0.5 * network_errors["RB", "zero"]["gx_mae"]
    # Both slopes come out as those of one surface: on clean light the measured one loses a little.
    # Zero's error is the mean slope itself.
    assert network_errors["RB", "network"]["gy_mae"] < 0.1 * network_errors["RB", "zero"]["gx_mae"]


def test_three_lights_beat_opposite_ones_beat_one(network_errors):
    mean = {
        lights: np.mean([errors["theta_x_deg"], errors["theta_y_deg"]])
        for lights, errors in network_errors.items()
    }
    assert mean["RGB", "none"] < mean["RB", "zero"] <= mean["R", "zero"] * 1.05


def test_result_does_not_depend_on_what_runs_the_tasks(tmp_path):
    documents = []
    for workers, name in ((1, "a"), (3, "b")):
        with ThreadPoolExecutor(workers) as executor:
            table = measured(tmp_path / name, executor, folds=2, estimators=("mlp", "table"))
        documents.append(json.dumps(table_document(table)))
    assert documents[0] == documents[1]


def test_no_press_is_judged_by_what_it_taught(tmp_path, one_thread, monkeypatch):
    taught, fit = [], module.fit_estimator

    def spy(name, pixels, channels, seed, **options):
        taught.append(set(pixels.press.tolist()))
        return fit(name, pixels, channels, seed, **options)

    monkeypatch.setattr(module, "fit_estimator", spy)
    table = measured(tmp_path, one_thread, folds=5)
    assert (table.train, table.test) == (8, 10)
    assert all(len(presses) == 8 for presses in taught)


def test_unusable_press_is_named_and_left_out(tmp_path, one_thread):
    dataset = make_dataset(tmp_path / "set", presses=10)
    tiny = replace(dataset.labels[4], contact_radius_px=1.0)
    write_labels(tmp_path / "set" / "labels.csv", [*dataset.labels[:4], tiny, *dataset.labels[5:]])
    table = error_table(dataset.folder, ["table"], folds=5, seed=0, executor=one_thread)
    assert [press.file for press in table.left_out] == [tiny.file]
    assert table.test == 9


def test_document_is_the_plans(tmp_path, one_thread):
    document = json.loads(json.dumps(table_document(measured(tmp_path, one_thread, folds=5))))
    assert document["presses"] == {"train": 8, "test": 10}
    assert set(document["mean_abs_gradient"]) == {"contact", "contact+5%"}
    for row in document["rows"]:
        assert set(METRICS) < set(row)
        assert row["n_pixels"] > 0
        for name, (low, high) in row["ci95"].items():
            assert 0 < low < row[name] < high


def test_markdown_and_html_hold_every_row(table):
    lines = [line for line in table_markdown(table).splitlines() if line.startswith("|")]
    assert len(lines) == len(table.rows) + 2
    unescaped = [line.replace("\\|", "") for line in lines]
    assert {line.count("|") for line in unescaped} == {len(column_headings()) + 1}

    tags = []
    parser = HTMLParser()
    parser.handle_starttag = lambda tag, _: tags.append(tag)
    parser.feed(error_table_html(table))
    assert tags.count("tr") == len(table.rows) + 1
    assert tags.count("caption") == 1


def test_one_judged_press_has_no_interval(tmp_path, one_thread):
    dataset = make_dataset(tmp_path / "set", presses=5)
    table = error_table(dataset.folder, ["table"], folds=1, seed=0, executor=one_thread)
    assert table.test == 1
    for text in (table_markdown(table), error_table_html(table), table_section(table).html):
        assert f"{table.rows[0].errors.values['gx_mae']:.3f}" in text
        assert " [0" not in text and "In brackets" not in text and "–0" not in text
        said = re.sub('aria-label="[^"]*"', "", text)
        assert said.count("interval") == said.count("1 press, too few for an interval") > 0
        assert "1 presses" not in text
    for row in table_document(table)["rows"]:
        assert set(row["ci95"].values()) == {None}
    assert "2 presses, too few for an interval" in caption(replace(table, test=2))
    assert "In brackets" in caption(replace(table, test=3))


def test_a_caption_claims_nothing_of_who_was_judged(table):
    assert "trained on 8 presses, tested on 2 presses; seed 0" in caption(table)
    assert "5-fold by press, tested on 10 presses" in caption(replace(table, folds=5, test=10))
    assert "w/o network sets the unseen axis to zero" in caption(table)
    seen = [row for row in table.rows if row.missing_axis != "zero"]
    assert "w/o network" not in caption(replace(table, rows=tuple(seen)))


def test_several_sets_give_a_table_each_and_a_page(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(app.table, "process_pool", lambda: ThreadPoolExecutor(1))
    folders = [str(make_dataset(tmp_path / name, presses=5).folder) for name in ("a", "b")]
    for folder in folders:  # a section each, named like its set
        card = read_dataset(Path(folder)).card
        write_card(Path(folder) / "dataset.toml", replace(card, name=Path(folder).name))
    files = ["--json", str(tmp_path / "t.json"), "--out", str(tmp_path / "page")]
    assert run("table", *folders, "--estimator", "table", *files) == 0
    tables = json.loads((tmp_path / "t.json").read_text())["tables"]
    assert [table["dataset"] for table in tables] == ["a", "b"]
    page = (tmp_path / "page" / "index.html").read_text()
    assert 'id="a"' in page and 'id="b"' in page
    printed = capsys.readouterr().out
    assert all(f"{table['rows'][0]['theta_x_deg']:.2f}" in printed for table in tables)


def test_contact_masks_are_those_of_the_presses_held_out(tmp_path, one_thread):
    dataset = make_dataset(tmp_path / "set", presses=10)
    table = error_table(dataset.folder, ["table"], folds=2, seed=0, executor=one_thread)
    presses = read_presses(dataset).presses
    found = ball_overlaps(dataset, presses, table.folds_fitted["table"])
    assert list(table.contact["table"]) == found
    assert sorted(item.name for item in found) == sorted(press.file for press in presses)


@pytest.mark.parametrize("train", [FEW, FEW + 1])
def test_presses_teach_as_few_or_many_as_a_fold_learns_from_not_as_the_set_holds(
    tmp_path, monkeypatch, train
):
    folder = make_dataset(tmp_path / "set", presses=FEW + 3).folder
    split = Split(train=tuple(range(train)), test=(FEW + 2,))
    told = []
    taught = lesson_of("default", read_presses(read_dataset(folder)).presses, split.train, 0)

    def fitted(estimator, pixels, channels, seed, effort):
        told.append(pixels)
        raise InterruptedError

    monkeypatch.setattr(module, "fit_estimator", fitted)
    task = {"estimator": "default", "channels": "RGB", "missing_axes": ("none",), "seed": 0}
    with pytest.raises(InterruptedError):
        module.run_task(module.Task(folder=folder, split=split, effort=Effort.SLOPES, **task))
    assert told[0].place.tolist() == taught.place.tolist()


def test_doubt_is_measured_of_all_lights_and_of_the_first_split_alone(
    tmp_path, one_thread, monkeypatch
):
    asked, fit = [], module.fit_estimator

    def noted(estimator, pixels, channels, seed, *, effort):
        asked.append((channels, effort))
        return fit(estimator, pixels, channels, seed, effort=effort)

    monkeypatch.setattr(module, "fit_estimator", noted)
    measured(tmp_path, one_thread, folds=2)
    rest = [(channels, Effort.SLOPES) for channels in ("R", "RB", "RG") for _ in range(2)]
    assert asked == [*rest, ("RGB", Effort.WHOLE), ("RGB", Effort.SLOPES)]
