# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge table` of several datasets, of which some are of no use."""

import json
import os
import sys

import pytest

from tests.app.commands import refused, run
from tests.synthetic import make_dataset

pytestmark = pytest.mark.usefixtures("in_this_process")


def test_a_dataset_that_cannot_be_tabulated_costs_the_others_nothing(tmp_path, capsys):
    good = make_dataset(tmp_path / "good", presses=12)
    few, poor = (make_dataset(tmp_path / name, presses=1).folder for name in ("few", "poor"))
    numbers = tmp_path / "t.json"
    words = ["table", few, good.folder, "--estimator", "table"]
    assert run(*words, "--json", numbers, "--html", tmp_path / "t.html") == 2
    document = json.loads(numbers.read_text())
    assert len(document["tables"]) == 1
    assert document["tables"][0]["dataset"] == f"synthetic ({good.folder})"
    (reason,) = document["left_out"].values()
    assert list(document["left_out"]) == [str(few)] and "1 usable press cannot" in reason
    assert f"left out {few}: {reason}" in capsys.readouterr().err
    assert (tmp_path / "t.html").stat().st_size > 500
    both = refused(capsys, "table", few, poor, "--json", tmp_path / "no.json")
    assert f"{few}: 1 usable press" in both and f"{poor}: 1 usable press" in both
    assert not (tmp_path / "no.json").exists()


def test_a_dataset_that_is_not_on_this_machine_costs_the_others_nothing(
    tmp_path, capsys, monkeypatch
):
    monkeypatch.setenv("WEDGE_DATA", str(tmp_path / "none"))
    good = make_dataset(tmp_path / "good", presses=5)
    numbers = tmp_path / "t.json"
    words = ["table", "marker-balls-a", good.folder, "--estimator", "table", "--json", numbers]
    assert run(*words) == 2
    document = json.loads(numbers.read_text())
    assert len(document["tables"]) == 1 and list(document["left_out"]) == ["marker-balls-a"]
    assert "left out marker-balls-a: the dataset marker-balls-a" in capsys.readouterr().err


def test_datasets_of_one_name_are_told_apart_and_one_folder_is_taken_once(tmp_path, capsys):
    may, june = (make_dataset(tmp_path / name, presses=5, seed=i) for i, name in enumerate("ab"))
    numbers, page = tmp_path / "t.json", tmp_path / "page"
    words = ["table", may.folder, f"{may.folder}/", june.folder, "--estimator", "table"]
    assert run(*words, "--json", numbers, "--out", page) == 0
    sets = [f"synthetic ({dataset.folder})" for dataset in (may, june)]
    tables = json.loads(numbers.read_text())["tables"]
    assert [table["dataset"] for table in tables] == sets
    printed, written = capsys.readouterr().out, (page / "index.html").read_text()
    assert all(name in printed and f">{name}</h2>" in written for name in sets)
    assert f"wedge table {may.folder} {june.folder} --folds=1 --estimator=table --seed=0" in written


def test_no_folds_are_refused_before_a_frame_is_read(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("app.table.process_pool", lambda: pytest.fail("it began"))
    folder = make_dataset(tmp_path / "set", presses=3).folder
    assert "--folds 0 must be at least 1" in refused(capsys, "table", folder, "--folds", "0")


@pytest.mark.skipif(sys.platform == "darwin", reason="macOS has no such names")
def test_folders_whose_names_are_not_utf_8_are_told_apart_in_every_file(tmp_path):
    folders = [tmp_path / os.fsdecode(b"a\xff" + end) for end in (b"b", b"c")]
    for seed, folder in enumerate(folders):
        make_dataset(folder, presses=5, seed=seed)
    words = ["table", *folders, "--estimator", "table", "--out", tmp_path / "page"]
    words += ["--json", tmp_path / "t.json", "--markdown", tmp_path / "t.md"]
    assert run(*words, "--html", tmp_path / "t.html") == 0
    tables = json.loads((tmp_path / "t.json").read_text(encoding="utf-8"))["tables"]
    assert [table["dataset"] for table in tables] == [f"synthetic ({path})" for path in folders]
    for name in ("t.md", "t.html", "page/index.html"):
        text = (tmp_path / name).read_text(encoding="utf-8")
        assert all(f"a\\udcff{end}" in text for end in "bc"), name
