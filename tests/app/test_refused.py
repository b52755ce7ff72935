# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the commands that work for minutes refuse: the place of a result first, then a truth."""

import os
import shutil
from pathlib import Path

import numpy as np
import pytest

from app._sources import refuse_few
from recon.calibration import unit_of_set
from sensor.errors import WedgeError
from tests.app.commands import refused
from tests.synthetic import SIZE_PX, make_dataset


@pytest.fixture(scope="module")
def workplace(tmp_path_factory):
    """A dataset and a unit calibrated on it, shared and not to be changed."""
    folder = tmp_path_factory.mktemp("workplace")
    dataset = make_dataset(folder / "set", presses=12)
    unit_of_set(dataset, "table").save(folder / "unit")
    return folder


@pytest.mark.parametrize(
    "words",
    [
        ("bench", "--json", "{taken}/a.json"),
        ("calibrate", "{set}", "--out", "{taken}/unit"),
        ("calibrate", "{set}", "--out", "unit", "--json", "{taken}/a.json"),
        ("calibrate", "{set}", "--out", "unit", "--json", "{folder}"),
        ("capture", "{set}", "--like", "{set}", "--out", "{taken}/set"),
        ("evaluate", "{unit}", "{set}", "--json", "{taken}/a.json"),
        ("table", "{set}", "--json", "{folder}"),
        ("table", "{set}", "--markdown", "{taken}/a.md"),
        ("table", "{set}", "--html", "{taken}/b/c.html"),
        ("reconstruct", "{unit}", "{set}/press00.png", "--out", "{taken}"),
        ("reconstruct", "{unit}", "{set}/press00.png", "--out", "depth", "--json", "{folder}"),
    ],
)
def test_what_cannot_be_written_is_said_before_the_work(
    workplace, tmp_path, monkeypatch, capsys, words
):
    monkeypatch.chdir(tmp_path)
    for work in (
        "recon.presses.PressReader.__init__",
        "recon.pipeline.Reconstructor.__call__",
        "recon.labels.capture.PressWatcher.__init__",
    ):
        monkeypatch.setattr(work, lambda *_, **__: pytest.fail("it began"))
    (tmp_path / "taken").touch()
    (tmp_path / "folder").mkdir()
    places = {name: str(workplace / name) for name in ("set", "unit")}
    places |= {name: str(tmp_path / name) for name in ("taken", "folder")}
    sentence = refused(capsys, *(word.format(**places) for word in words))
    assert "cannot be written" in sentence
    assert sorted(path.name for path in tmp_path.iterdir()) == ["folder", "taken"]


@pytest.mark.parametrize("estimator", ["default", "mlp"])
def test_a_calibration_without_torch_is_refused_before_the_presses_are_read(
    workplace, tmp_path, monkeypatch, capsys, estimator
):
    monkeypatch.setattr("recon.estimators.find_spec", lambda _: None)
    monkeypatch.setattr(
        "recon.presses.PressReader.__init__", lambda *_, **__: pytest.fail("it began")
    )
    words = (str(workplace / "set"), "--estimator", estimator, "--out", str(tmp_path / "unit"))
    assert "calibration needs torch" in refused(capsys, "calibrate", *words)
    assert not list(tmp_path.iterdir())


def test_a_unit_in_place_of_a_mount_point_is_refused_before_the_work(
    workplace, tmp_path, monkeypatch, capsys
):
    (tmp_path / "unit").mkdir()
    monkeypatch.setattr(os.path, "ismount", lambda path: Path(path) == tmp_path / "unit")
    monkeypatch.setattr(
        "recon.presses.PressReader.__init__", lambda *_, **__: pytest.fail("it began")
    )
    words = ["calibrate", workplace / "set", "--out", tmp_path / "unit"]
    assert "unit cannot be written: it is a link or a mount point" in refused(capsys, *words)


def test_a_folder_that_takes_no_files_is_said_before_the_work(
    workplace, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr(os, "access", lambda *_: False)
    words = ["calibrate", workplace / "set", "--out", tmp_path / "a" / "unit"]
    assert str(tmp_path) in refused(capsys, *words)
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("command", ["reconstruct", "cloud"])
def test_nothing_is_written_into_a_unit_or_through_a_link_that_leads_nowhere(
    workplace, tmp_path, capsys, command
):
    (tmp_path / "link").symlink_to("none")
    unit = shutil.copytree(workplace / "unit", tmp_path / "unit")
    before = sorted(path.name for path in unit.iterdir())
    words = (command, unit, workplace / "set" / "press00.png", "--out")
    assert f"{unit} is a unit folder" in refused(capsys, *words, unit)
    assert sorted(path.name for path in unit.iterdir()) == before
    for out in (tmp_path / "link", tmp_path / "link" / "deep"):
        assert f"{tmp_path / 'link'} is a link that leads nowhere" in refused(capsys, *words, out)


def test_a_folder_or_an_archive_in_place_of_an_image_is_told_what_to_give(
    workplace, tmp_path, capsys
):
    np.savez(tmp_path / "frames.npz", frames=np.zeros((2, *SIZE_PX[::-1], 3), np.uint8))
    words = ("reconstruct", workplace / "unit")
    out = ("--out", tmp_path / "out")
    for folder in (workplace / "set", f"{workplace / 'set'}#1"):
        said = refused(capsys, *words, folder, *out)
        assert f"{workplace / 'set'} is a folder: name the images in it" in said
    bare = tmp_path / "frames.npz"
    assert "name one, such as frames.npz#17" in refused(capsys, *words, bare, *out)
    assert "is missing" in refused(capsys, *words, tmp_path / "none.png", *out)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("words", "takes_images"),
    [
        (("cloud", "{unit}", "{frames}", "--out", "{out}"), True),
        (("track", "{unit}", "{frames}", "--out", "{out}"), True),
        (("accept", "{unit}", "{set}", "--stream", "{frames}"), False),
        (("capture", "{frames}", "--like", "{set}", "--out", "{out}"), False),
        (("live", "{frames}"), False),
        (("record", "{frames}", "--out", "{out}.mcap"), False),
        (("replay", "{frames}"), False),
        (("stream", "{frames}"), False),
        (("tune", "{frames}"), False),
    ],
)
def test_what_gives_no_frames_is_told_all_that_the_command_takes(
    workplace, tmp_path, monkeypatch, capsys, words, takes_images
):
    monkeypatch.setattr("app.pages.live.serve", lambda *_, **__: pytest.fail("it is served"))
    places = {"unit": workplace / "unit", "set": workplace / "set", "out": tmp_path / "out"}
    archive = tmp_path / "frames.npz"
    for fault in ("does not exist", "cannot be read as frames"):
        said = refused(capsys, *(str(word).format(**places, frames=archive) for word in words))
        assert f"{archive} {fault}: name an address" in said
        assert "a dataset folder" in said and "`wedge data list`" in said
        assert ("images or one frame of an archive, as frames.npz#17" in said) == takes_images
        np.savez(archive, frames=np.zeros((2, *SIZE_PX[::-1], 3), np.uint8))
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "words",
    [
        ("calibrate", "{set}", "--out", "unit", "--estimator", "table"),
        ("evaluate", "{unit}", "{set}"),
        ("table", "{set}", "--estimator", "table"),
    ],
)
def test_a_damaged_truth_is_refused_in_one_sentence(
    workplace, tmp_path, monkeypatch, capsys, words
):
    monkeypatch.chdir(tmp_path)
    folder = shutil.copytree(workplace / "set", tmp_path / "set")
    (folder / "truth").mkdir()
    for number in range(12):  # whichever is judged
        with (folder / "truth" / f"press{number:02d}.npy").open("wb") as stream:
            np.savez(stream, np.ones(SIZE_PX[::-1]))
    places = {"set": str(folder), "unit": str(workplace / "unit")}
    sentence = refused(capsys, *(word.format(**places) for word in words))
    assert "npy is not a whole numpy array" in sentence
    assert [path.name for path in tmp_path.iterdir()] == ["set"]


@pytest.mark.parametrize("seconds", [0.0, -1.0, 2e9, float("nan")])
def test_too_few_seconds_and_too_many_are_refused_by_both_bounds(seconds):
    with pytest.raises(WedgeError, match=r"^--seconds .* must be above zero and below 1e\+09\.$"):
        refuse_few("seconds", seconds)
    refuse_few("seconds", 1e8)
    refuse_few("seconds", None)
