# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A ball stated wrongly, and stated right afterwards; sets not to label; presses few or deep."""

import shlex
from dataclasses import replace

import pytest

from recon.presses import deep_presses, read_presses
from sensor.dataset import read_dataset, write_card, write_labels
from sensor.unit import read_unit_card
from tests.app.commands import refused, run
from tests.synthetic import KEYSTONE_PX, MM_PER_PX, SIZE_PX, make_dataset, make_deeper_set

pytestmark = pytest.mark.usefixtures("in_this_process")


def stated(dataset, ball_radius_mm):
    card = replace(dataset.card, ball_radius_mm=ball_radius_mm)
    write_card(dataset.folder / "dataset.toml", card)


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize(("radius_mm", "why"), [("0.004", "in metres"), ("900", "millimetres")])
@pytest.mark.parametrize(
    "words",
    [
        ("calibrate", "{frames}", "--out", "{out}/unit"),
        ("data", "import", "{frames}", "--out", "{out}/set"),
        ("capture", "{frames}", "--like", "{set}", "--out", "{out}/set"),
        ("label", "{set}", "--no-page", "--again"),
    ],
)
def test_a_ball_in_another_unit_is_one_sentence(tmp_path, capsys, words, radius_mm, why):
    dataset = make_dataset(tmp_path / "set", presses=2)
    places = {name: str(tmp_path / name) for name in ("set", "out", "frames")}
    (tmp_path / "out").mkdir()
    (tmp_path / "frames").mkdir()
    for name, picture in contents(dataset.folder).items():
        if name.endswith(".png"):
            (tmp_path / "frames" / name).write_bytes(picture)
    given = [word.format(**places) for word in words]
    if words[0] == "label":
        found = [replace(label, quality=0.9) for label in dataset.labels]
        write_labels(dataset.folder / "labels.csv", found)
        stated(dataset, float(radius_mm))
    else:
        given += ["--ball-radius-mm", radius_mm]
    before = contents(dataset.folder)
    sentence = refused(capsys, *given)
    assert f"the ball's radius, {radius_mm} mm, is " in sentence and why in sentence
    assert not any((tmp_path / "out").iterdir())
    assert contents(dataset.folder) == before


def test_again_finds_anew_what_the_mended_ball_no_longer_holds(tmp_path, capsys):
    dataset = make_dataset(tmp_path / "set", presses=3)
    wide_px = 1.2 * dataset.card.ball_radius_mm / MM_PER_PX[0]  # as of a ball twice as large
    found = [replace(x, contact_radius_px=wide_px, quality=0.9) for x in dataset.labels]
    table = dataset.folder / "labels.csv"
    for theirs in ({"quality": None}, {"quality": 1.0}, {"ball_radius_mm": 4.0}):
        write_labels(table, [found[0], replace(found[1], **theirs), found[2]])
        before = table.read_bytes()
        sentence = refused(capsys, "label", dataset.folder, "--no-page", "--again")
        assert f"ball, of {found[1].file} (4.80 mm in radius, its ball 4 mm): correct" in sentence
        assert table.read_bytes() == before
    write_labels(table, [*found[:2], dataset.labels[2]])
    sentence = refused(capsys, "label", dataset.folder, "--no-page")
    assert f"of {found[0].file} (" in sentence and f"), {found[1].file}: correct" in sentence
    wedge, *said = shlex.split(sentence.split("`")[1])
    assert wedge == "wedge" and run(*said, "--no-page") == 0
    *again, drawn = read_dataset(dataset.folder).labels
    assert drawn == dataset.labels[2]
    for label, truth in zip(again, dataset.labels, strict=False):
        assert label.contact_radius_px == pytest.approx(truth.contact_radius_px, rel=0.15)


@pytest.mark.parametrize(("presses", "more"), [(5, ""), (7, " and 2 more")])
def test_of_many_circles_larger_than_their_ball_five_are_named(tmp_path, capsys, presses, more):
    dataset = make_dataset(tmp_path / "set", presses=presses)
    stated(dataset, 0.01)
    for words in (("label", dataset.folder), ("calibrate", dataset.folder, "--out", "unit")):
        sentence = refused(capsys, *words)
        assert [x.file in sentence for x in dataset.labels] == [True] * 5 + [False] * (presses - 5)
        assert f"{dataset.labels[4].file}{more}: correct" in sentence


def test_a_scale_by_which_most_contacts_are_as_wide_as_the_ball_is_refused(tmp_path, capsys):
    dataset = make_dataset(tmp_path / "set", presses=3)
    clamped_px = 0.95 * dataset.card.ball_radius_mm / MM_PER_PX[0]
    wide = [replace(label, contact_radius_px=clamped_px) for label in dataset.labels[:2]]
    write_labels(dataset.folder / "labels.csv", [*wide, dataset.labels[2]])
    sentence = refused(capsys, "calibrate", dataset.folder, "--out", tmp_path / "unit")
    assert f"{dataset.folder}: most contacts are as wide as the ball of radius 4 mm" in sentence
    assert not (tmp_path / "unit").exists()


def test_a_design_of_another_pad_than_the_card_s_is_refused(tmp_path, capsys):
    dataset = make_dataset(tmp_path / "set", presses=3, corners_px=KEYSTONE_PX)
    words = ("calibrate", dataset.folder, "--out", tmp_path / "unit", "--estimator", "table")
    sentence = refused(capsys, *words, "--design", "standard")
    assert "the design standard one of 34 x 25.5 mm" in sentence and "dataset.toml" in sentence
    assert not (tmp_path / "unit").exists()
    assert run(*words) == 0
    assert read_unit_card(tmp_path / "unit").design_sha256 is None


def test_a_design_of_a_smaller_pad_than_frames_of_the_gel_plane_show_is_refused(tmp_path, capsys):
    dataset = make_dataset(tmp_path / "set", presses=3)
    small, large = tmp_path / "small.toml", tmp_path / "large.toml"
    for path, share in ((small, 0.8), (large, 0.9)):
        length_mm = share * SIZE_PX[0] * MM_PER_PX[0]
        path.write_text(f'base = "finger"\n[gel]\npad_length_mm = {length_mm}\n')
    words = ("calibrate", dataset.folder, "--out", tmp_path / "unit", "--estimator", "table")
    sentence = refused(capsys, *words, "--design", small)
    assert "show gel of" in sentence and "the design small one of" in sentence
    assert not (tmp_path / "unit").exists()
    assert run(*words, "--design", large) == 0


def test_frames_by_an_assumed_scale_are_refused_with_the_assumption(tmp_path, capsys):
    dataset = make_dataset(tmp_path / "set", presses=2)
    (tmp_path / "frames").mkdir()
    for name, picture in contents(dataset.folder).items():
        if name.endswith(".png"):
            (tmp_path / "frames" / name).write_bytes(picture)
    words = ("calibrate", tmp_path / "frames", "--out", tmp_path / "unit", "--ball-radius-mm", "3")
    assert "taken to be 34 x 25.5 mm" in refused(capsys, *words)
    given = ("data", "import", tmp_path / "frames", "--out", tmp_path / "imported")
    scale = ("--ball-radius-mm", "0.9", "--mm-per-px", "0.1")
    assert "taken to be" not in refused(capsys, *given, *scale)


def test_what_is_no_folder_of_one_s_own_is_not_labelled(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    sentence = refused(capsys, "label", "taxim-gelsight", "--no-page")
    assert "copy it first" in sentence and "wedge data path taxim-gelsight" in sentence
    assert "nothing does not exist" in refused(capsys, "label", "nothing", "--no-page")
    (tmp_path / "nothing").mkdir()
    assert "it has no dataset.toml" in refused(capsys, "label", "nothing", "--no-page")


@pytest.mark.parametrize(("presses", "few"), [(9, True), (10, False)])
def test_a_unit_of_few_presses_is_not_to_be_trusted(tmp_path, capsys, presses, few):
    folder = make_dataset(tmp_path / "set", presses=presses).folder
    words = ("calibrate", folder, "--out", tmp_path / "unit", "--estimator", "table")
    assert run(*words) == 0
    assert ("9 presses: too few to trust" in capsys.readouterr().out) == few


def test_a_unit_of_balls_pressed_deep_is_said_to_teach_less(tmp_path, capsys):
    dataset = make_deeper_set(tmp_path / "set", presses=10)
    stated(dataset, 2.4)
    sentence = deep_presses(read_presses(read_dataset(dataset.folder)))
    words = ("calibrate", dataset.folder, "--out", tmp_path / "unit", "--estimator", "table")
    assert run(*words) == 0
    assert sentence is not None and sentence in " ".join(capsys.readouterr().out.split())
