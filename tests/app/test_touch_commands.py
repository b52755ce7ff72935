# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge markers` and `wedge cloud` on a marker gel and on a clear one, and what they refuse."""

import csv
import json
import shlex
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from PIL import Image

import recon.estimators.mlp_training as mlp_training
from recon.calibration import calibrate
from recon.images import read_image, write_image
from recon.pipeline import Reconstructor
from recon.presses import read_presses
from sensor.dataset import read_dataset
from sensor.design import FINGER
from sensor.unit import write_unit_card
from tests.app.commands import refused, run
from tests.dotted import dotted, grid_px
from tests.synthetic import SIZE_PX, make_dataset

SPACING_PX = 12.0
PLACES = grid_px(SPACING_PX, size=SIZE_PX, margin_px=5.0)


def with_dots(image, places=PLACES):
    drawn = dotted(places, 2.0, image / 255, noise=0.0, darkness=0.85)
    return np.rint(255 * drawn).astype(np.uint8)


def make_unit(folder, dots, estimator="mlp"):
    dataset = make_dataset(folder / "set", presses=8)
    if dots:
        for path in (folder / "set").glob("*.png"):
            write_image(path, with_dots(read_image(path)))
        dataset = read_dataset(folder / "set")
    made = calibrate(
        dataset,
        read_presses(dataset),
        estimator=estimator,
        serial="dotted" if dots else "clear",
        created="2026-01-01",
        metrics={"fitted_presses": 8},
        seed=0,
    )
    made.save(folder / "unit")
    return made


@pytest.fixture(scope="module")
def units(tmp_path_factory):
    """Of a marker gel and of a clear one, in folders called so."""
    folder = tmp_path_factory.mktemp("units")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mlp_training, "PIXELS", 8000)
        patch.setattr(mlp_training, "EPOCHS", 20)
        patch.setattr(mlp_training, "BATCH", 128)
        made = {name: make_unit(folder / name, name == "dotted") for name in ("dotted", "clear")}
    return folder, made


def test_a_units_card_says_whether_its_gel_has_dots(units):
    _, made = units
    assert made["clear"].card.markers is None
    card = made["dotted"].card.markers
    assert card["count"] == len(PLACES)
    assert card["spacing_mm"] == pytest.approx(1.2, rel=0.02)


def test_markers_follows_dots_through_a_folder_of_frames(units, tmp_path):
    folder, _ = units
    blank = read_image(folder / "clear" / "unit" / "background.png")
    for step in range(5):
        moved = PLACES + np.array([2.5 * step, 0.0])
        write_image(tmp_path / "clip" / f"{step}.png", with_dots(blank, moved))
    out = tmp_path / "out"
    unit = folder / "dotted" / "unit"
    command = ("markers", unit, tmp_path / "clip", "--out", out, "--json", tmp_path / "m.json")
    assert run(*command) == 0
    frames = json.loads((tmp_path / "m.json").read_text())["frames"]
    assert [frame["word"] for frame in frames] == ["tracked"] * 5
    assert frames[-1]["mean_mm"] == pytest.approx(1.0, abs=0.05)  # ten pixels, most of a spacing
    rows = list(csv.DictReader((out / "markers.csv").read_text().splitlines()))
    assert len(rows) == 5 * len(PLACES)
    last = [row for row in rows if row["frame"] == rows[-1]["frame"] and row["seen"] == "1"]
    np.testing.assert_allclose([float(row["dx_mm"]) for row in last], 1.0, atol=0.15)
    assert read_image(out / "markers.png").ndim == 3
    with Image.open(out / "overlay.webp") as clip:
        assert clip.n_frames == 5
    with (out / "markers.mcap").open("rb") as stream:
        topics = [channel.topic for _, channel, _ in make_reader(stream).iter_messages()]
    assert topics.count("/wedge/markers") == topics.count("/wedge/markers_state") == 5


def test_a_frame_is_named_in_the_table_as_it_is_called(units, tmp_path):
    folder, _ = units
    blank = read_image(folder / "dotted" / "unit" / "background.png")
    names = [str(tmp_path / name) for name in ('b"q.png', "a, b.png", "plain.png")]
    for name in names:
        write_image(Path(name), blank)
    out = tmp_path / "out"
    words = ("--out", out, "--json", tmp_path / "told.json")
    assert run("markers", folder / "dotted" / "unit", *names, *words) == 0
    with (out / "markers.csv").open(newline="") as stream:
        headings, *rows = csv.reader(stream)
    assert {len(row) for row in rows} == {len(headings)}
    assert list(dict.fromkeys((row[0], row[-1]) for row in rows)) == [
        (str(number), name) for number, name in enumerate(names)
    ]
    told = json.loads((tmp_path / "told.json").read_text())["frames"]
    assert [(row["frame"], row["image"]) for row in told] == list(enumerate(names))


def test_a_frame_of_a_folder_keeps_the_name_of_its_file(units, tmp_path, capsys):
    folder, _ = units
    unit, clip = folder / "dotted" / "unit", tmp_path / "clip"
    names = ["press.bmp", "press.png", "touch 2.png"]
    clip.mkdir()
    for name in names:
        Image.open(unit / "background.png").save(clip / name)
    out, told = tmp_path / "out", tmp_path / "told.json"
    for command, key in (("markers", "frames"), ("track", "poses"), ("cloud", "clouds")):
        words = (command, unit, clip, "--out", out / command, "--json", told)
        assert run(*words) == 0
        rows = json.loads(told.read_text())[key]
        assert [row["image"] for row in rows] == names
        assert [row["frame"] for row in rows] == [0, 1, 2]
        said = capsys.readouterr().out
        assert command == "track" or all(f"0000{i} {name}" in said for i, name in enumerate(names))
        tables = list((out / command).glob("*.csv"))
        assert bool(tables) == (command != "cloud")
        for table in tables:
            with table.open(newline="") as stream:
                assert list(dict.fromkeys(row["image"] for row in csv.DictReader(stream))) == names
    written = ["press.ply", "press-00001.ply", "touch 2.ply"]
    assert [Path(row["file"]).name for row in rows] == written
    assert sorted(path.name for path in (out / "cloud").iterdir()) == sorted(written)


def test_cloud_writes_what_was_asked_for(units, tmp_path, capsys):
    folder, _ = units
    press = folder / "dotted" / "set" / "press00.png"
    out = tmp_path / "clouds"
    command = ("cloud", folder / "dotted" / "unit", press, "--out", out)
    assert run(*command, "--form", "npz", "--mesh", "--json", tmp_path / "c.json") == 0
    (row,) = json.loads((tmp_path / "c.json").read_text())["clouds"]
    assert row["markers"] == "tracked" and row["touching"] > 100
    assert row["contact"].startswith("1 patch") and 0 <= row["in_shadow"] <= 1
    assert row["patches"][0]["deepest_mm"] == pytest.approx(row["deepest_mm"], rel=0.05)
    with np.load(out / "press00.npz") as read:
        assert len(read["points_mm"]) == SIZE_PX[0] * SIZE_PX[1] == row["points"]
        assert read["points_mm"][:, 2].min() == pytest.approx(-row["deepest_mm"], rel=1e-5)
        touching = int(read["contact"].sum())
        assert np.isnan(read["sigma_mm"]).all()  # which mlp does not know
    assert row["sigma_mm"] is None and " – " in capsys.readouterr().out
    assert run(*command, "--form", "pcd", "--part", "contact") == 0
    assert f"POINTS {touching}\n".encode() in (out / "press00.pcd").read_bytes()


def test_a_blank_frame_is_a_cloud_that_says_no_contact(units, tmp_path, capsys, monkeypatch):
    folder, _ = units
    usual = Reconstructor.__call__

    def sunk(reconstruct, frame):
        found = usual(reconstruct, frame)
        return replace(found, depth_mm=np.full_like(found.depth_mm, -1e-4))

    monkeypatch.setattr(Reconstructor, "__call__", sunk)
    blank = folder / "clear" / "set" / "background.png"
    assert run("cloud", folder / "clear" / "unit", blank, "--out", tmp_path) == 0
    said = capsys.readouterr().out
    assert "no contact" in said and " 0.000 " in said


def test_a_skin_laid_on_another_design_s_gel_than_the_unit_s_is_told(units, tmp_path, capsys):
    folder, made = units
    unit = shutil.copytree(folder / "clear" / "unit", tmp_path / "unit")
    card, told = replace(made["clear"].card, design_sha256=FINGER.sha256), tmp_path / "c.json"
    write_unit_card(unit, card)
    words = ("cloud", unit, unit / "background.png", "--out", tmp_path / "out", "--json", told)
    for design, remarks in (("finger", 0), ("standard", 1)):
        assert run(*words, "--design", design) == 0
        assert capsys.readouterr().err.count(f"another design than {design}") == remarks
        assert len(json.loads(told.read_text())["remarks"]) == remarks
    (right, bottom), pitch = np.subtract(SIZE_PX, 1.0), card.mm_per_px
    corners = ((0.0, 0.0), (right, 0.0), (right, bottom), (0.0, bottom))
    pad = (SIZE_PX[0] * pitch[0], SIZE_PX[1] * pitch[1])
    write_unit_card(unit, replace(card, corners_px=corners, pad_size_mm=pad))
    assert "the design standard one of 34 x 25.5 mm" in refused(
        capsys, *words, "--design", "standard"
    )


def test_the_word_tells_when_unit_and_gel_disagree_about_dots(units, tmp_path, capsys):
    folder, _ = units
    dotted_blank = folder / "dotted" / "set" / "background.png"
    clear_blank = folder / "clear" / "set" / "background.png"
    run(
        "cloud", folder / "clear" / "unit", dotted_blank, "--background", dotted_blank,
        "--out", tmp_path, "--json", tmp_path / "c.json",
    )  # fmt: skip
    (row,) = json.loads((tmp_path / "c.json").read_text())["clouds"]
    assert "calibrated without" in row["markers"]
    run(
        "cloud", folder / "dotted" / "unit", clear_blank, "--background", clear_blank,
        "--out", tmp_path, "--json", tmp_path / "c.json",
    )  # fmt: skip
    (row,) = json.loads((tmp_path / "c.json").read_text())["clouds"]
    assert "is this its gel" in row["markers"]


def test_dots_that_come_after_a_clear_frame_are_told(units, tmp_path, capsys):
    folder, _ = units
    names = [folder / name / "set" / "background.png" for name in ("clear", "dotted", "dotted")]
    for index, name in enumerate(names):
        (tmp_path / "clip").mkdir(exist_ok=True)
        (tmp_path / "clip" / f"{index}.png").symlink_to(name)
    words = (folder / "clear" / "unit", tmp_path / "clip", "--background", "first")
    assert run("track", *words, "--out", tmp_path / "out", "--json", tmp_path / "t.json") == 0
    told = [row["markers"] for row in json.loads((tmp_path / "t.json").read_text())["poses"]]
    word = f"{len(PLACES)} dots, but the blank frame has none: is this the unit's gel?"
    assert told == ["none", word, word]
    assert f"The dots on the gel, in 2 of 3 frames: {word}" in capsys.readouterr().out


def test_bad_input_is_one_sentence(units, tmp_path, capsys):
    folder, _ = units
    clear, dotted_unit = folder / "clear" / "unit", folder / "dotted" / "unit"
    press = folder / "dotted" / "set" / "press00.png"
    out = tmp_path / "out"
    assert "shows no grid of dots" in refused(capsys, "markers", clear, press, "--out", out)
    assert "no frames were named" in refused(capsys, "markers", dotted_unit, "--out", out)
    gone = tmp_path / "no.mp4"
    assert "does not exist" in refused(capsys, "markers", dotted_unit, gone, "--out", out)
    assert not list(out.glob("*"))
    assert "does not exist" in refused(capsys, "cloud", clear, tmp_path / "no.mp4", "--out", out)
    assert "--frames 0" in refused(capsys, "cloud", clear, press, "--out", out, "--frames", 0)
    mesh = refused(capsys, "cloud", clear, press, "--out", out, "--mesh", "--form", "pcd")
    assert "--mesh" in mesh
    write_image(tmp_path / "small.png", np.zeros((8, 8, 3), np.uint8))
    sentence = refused(capsys, "cloud", clear, tmp_path / "small.png", "--out", out)
    assert "small.png" in sentence and "8x8" in sentence
    twice = (press, folder / "clear" / "set" / "press00.png")
    assert "would be written" in refused(capsys, "cloud", clear, *twice, "--out", out)
    for bad in (tmp_path / "small.png", tmp_path / "gone.png"):
        sentence = refused(capsys, "cloud", clear, press, bad, "--out", out)
        assert bad.name in sentence
    assert not list(out.glob("*"))


def test_a_cloud_is_not_written_over_a_frame(tmp_path, capsys, units):
    folder, _ = units
    images = folder / "clear" / "set" / "press00.png", folder / "clear" / "set" / "press01.png"
    for name in ("frames.npz", "frames-0.npz"):
        np.savez(tmp_path / name, frames=np.stack([read_image(image) for image in images]))
    before = (tmp_path / "frames-0.npz").read_bytes()
    names = tmp_path / "frames.npz#0", tmp_path / "frames-0.npz#1"
    words = ("cloud", folder / "clear" / "unit", *names, "--form", "npz", "--out", tmp_path)
    assert "frames-0.npz is an input and would be overwritten" in refused(capsys, *words)
    assert (tmp_path / "frames-0.npz").read_bytes() == before


def test_a_card_with_half_of_the_markers_is_refused(units, tmp_path):
    from sensor.errors import WedgeError
    from sensor.unit import read_unit_card, write_unit_card

    _, made = units
    card = made["dotted"].card
    write_unit_card(tmp_path, card)
    path = tmp_path / "unit.toml"
    path.write_text(path.read_text().replace("spacing_mm", "spacing"))
    with pytest.raises(WedgeError, match="markers must be a table"):
        read_unit_card(tmp_path)
    with pytest.raises(WedgeError, match="markers must be a table"):
        write_unit_card(tmp_path, replace(card, markers={"count": 3}))


def test_a_frame_that_is_not_the_units_is_said(units, tmp_path, capsys):
    folder, made = units
    write_image(tmp_path / "dark.png", np.zeros_like(made["clear"].background))
    press = folder / "clear" / "set" / "press00.png"
    for command, key in (("reconstruct", "images"), ("cloud", "clouds")):
        told = tmp_path / f"{command}.json"
        words = (folder / "clear" / "unit", press, tmp_path / "dark.png", "--json", told)
        assert run(command, *words, "--out", tmp_path / command) == 0
        said, document = capsys.readouterr().err, json.loads(told.read_text())
        clear, dark = (row["remark"] for row in document[key])
        assert clear is None and dark == "nearly all of the frame differs from the blank gel"
        (remark,) = document["remarks"]
        assert remark.startswith(f"{tmp_path / 'dark.png'}: {dark}") and remark in said


def test_presses_of_a_dataset_are_each_sought_from_rest(units, tmp_path):
    """Ten pixels are most of a spacing: only who follows the dots finds them there."""
    folder, _ = units
    blank = read_image(folder / "clear" / "unit" / "background.png")
    (tmp_path / "set").mkdir()
    shutil.copy(folder / "dotted" / "set" / "dataset.toml", tmp_path / "set")
    shutil.copy(folder / "dotted" / "set" / "background.png", tmp_path / "set")
    lines = (folder / "dotted" / "set" / "labels.csv").read_text().splitlines()
    (tmp_path / "set" / "labels.csv").write_text("\n".join([*lines[:4], ""]))
    for line, shift_px in zip(lines[1:4], (3.0, 6.5, 10.0), strict=True):
        moved = with_dots(blank, PLACES + np.array([shift_px, 0.0]))
        write_image(tmp_path / "set" / line.split(",")[0], moved)
    moved_mm = {}
    for name in ("set", "clip"):  # the same frames as a folder are a clip
        if name == "clip":
            shutil.copytree(tmp_path / "set", tmp_path / "clip")
            (tmp_path / "clip" / "dataset.toml").unlink()
        told = tmp_path / f"{name}.json"
        words = ("markers", folder / "dotted" / "unit", tmp_path / name, "--json", told)
        assert run(*words, "--out", tmp_path / f"{name}-out") == 0
        moved_mm[name] = json.loads(told.read_text())["frames"][-1]["mean_mm"]
    assert moved_mm["set"] < 0.4 and moved_mm["clip"] == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize(
    ("command", "name"),
    [
        *(("track", f"poses.{end}") for end in ("mcap", "csv", "png")),
        *(("markers", f"markers.{end}") for end in ("mcap", "csv", "png")),
        ("track", "overlay.webp"),
        ("cloud", "0.ply"),
    ],
)
def test_numbers_go_over_no_other_result_of_the_run(units, tmp_path, capsys, command, name):
    folder, _ = units
    clip, out = tmp_path / "clip", tmp_path / "out"
    write_image(clip / "0.png", read_image(folder / "dotted" / "unit" / "background.png"))
    words = (command, folder / "dotted" / "unit", clip, "--out", out, "--json", out / name)
    assert str(out / name) in refused(capsys, *words)
    assert not out.exists()


def test_presses_of_an_earlier_run_are_gone_on_with(units, tmp_path, capsys):
    folder, _ = units
    (tmp_path / "raw").mkdir()
    (tmp_path / "u-presses").symlink_to(folder / "clear" / "set")
    (tmp_path / "it's u-presses").symlink_to(folder / "clear" / "set")
    for name in ("u", "it's u"):
        out = tmp_path / name
        words = ("calibrate", tmp_path / "raw", "--ball-radius-mm", "4", "--out", out)
        command = shlex.split(refused(capsys, *words).split("`")[1])  # as a shell takes it
        assert command == ["wedge", "calibrate", f"{out}-presses", "--out", str(out)]
