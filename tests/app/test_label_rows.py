# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge label` names rows that cannot be right, and refuses a folder that takes no table."""

from dataclasses import replace
from pathlib import Path

import pytest

import app.label
import sensor.files
from sensor.dataset import write_labels
from tests.app.commands import refused, run
from tests.synthetic import make_dataset


@pytest.mark.parametrize(("in_npz", "digits"), [(False, 0), (True, 0), (True, 5000)])
def test_rows_without_a_frame_and_circles_outside_it_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], in_npz: bool, digits: int
) -> None:
    dataset = make_dataset(tmp_path / "set", presses=3, in_npz=in_npz)
    first, *others = dataset.labels
    lost = "frames.npz#3" if in_npz else "gone.png"
    if digits:
        lost = "frames.npz#" + digits * "9"  # more than int() takes
    away = replace(first, center_x_px=242500.0)
    write_labels(dataset.folder / "labels.csv", [away, *others, replace(first, file=lost)])
    assert run("label", dataset.folder, "--no-page") == 0
    summary, *odd = capsys.readouterr().out.splitlines()
    assert summary == "Frames with a circle: 3 of 3; doubtful: 0."
    assert len(odd) == 2
    assert f"labels frames that do not exist, {lost}:" in odd[0]
    assert f"outside the 120x90 frame, of {first.file}:" in odd[1]


def test_rows_that_can_be_right_are_not_remarked_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    dataset = make_dataset(tmp_path / "set", presses=2)
    sub = dataset.folder / "more" / dataset.labels[0].file
    sub.parent.mkdir()
    sub.write_bytes((dataset.folder / dataset.labels[0].file).read_bytes())
    edge = replace(dataset.labels[0], file=f"more/{sub.name}", center_x_px=-0.5, center_y_px=89.5)
    write_labels(dataset.folder / "labels.csv", [*dataset.labels, edge])
    assert run("label", dataset.folder, "--no-page") == 0
    assert capsys.readouterr().out == "Frames with a circle: 2 of 2; doubtful: 0.\n"


def test_a_folder_that_takes_no_table_is_refused_before_the_search(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    dataset = make_dataset(tmp_path / "set", presses=2)
    monkeypatch.setattr(sensor.files.os, "access", lambda *_: False)  # root may write anywhere
    monkeypatch.setattr(app.label, "_find", lambda *_: pytest.fail("it searched"))
    unseen = [replace(label, quality=0.5) for label in dataset.labels]
    write_labels(dataset.folder / "labels.csv", unseen)
    assert "labels.csv cannot be written" in refused(
        capsys, "label", dataset.folder, "--no-page", "--again"
    )
