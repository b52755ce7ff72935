# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The commands as a person runs them: a folder in the dataset format to a unit, errors, depth.

And with bad input: one sentence that names the file and the fault, status 2, nothing written.
"""

import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest

import recon.estimators.default_training as default_training
import recon.estimators.mlp_training as mlp_training
from recon.calibration import calibrate, load_calibration
from recon.images import read_image, write_image
from recon.presses import read_presses
from tests.app.commands import refused, run
from tests.synthetic import KEYSTONE_PX, SIZE_PX, make_dataset, true_depth_mm


@pytest.fixture(autouse=True)
def quick_training(monkeypatch):
    monkeypatch.setattr(mlp_training, "PIXELS", 4000)
    monkeypatch.setattr(mlp_training, "EPOCHS", 20)
    monkeypatch.setattr(mlp_training, "BATCH", 128)
    monkeypatch.setattr(default_training, "STEPS", 600)
    monkeypatch.setattr(default_training, "BATCH", 128)


@pytest.fixture(scope="module")
def workplace(tmp_path_factory):
    """A dataset and a unit calibrated on it, shared and not to be changed."""
    folder = tmp_path_factory.mktemp("workplace")
    make_dataset(folder / "set", presses=12)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(default_training, "STEPS", 60)
        patch.setattr(default_training, "BATCH", 128)
        assert run("calibrate", folder / "set", "--out", folder / "unit") == 0
    return folder


def contents(folder):
    return {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({}, ()),
        ({"corners_px": KEYSTONE_PX}, ("--estimator", "table")),
        ({"in_npz": True}, ("--estimator", "table")),
    ],
)
def test_presses_to_depth(tmp_path, capsys, options, words):
    dataset = make_dataset(tmp_path / "set", presses=12, **options)
    assert run("calibrate", dataset.folder, *words, "--out", tmp_path / "unit") == 0
    assert sorted(p.name for p in (tmp_path / "unit").iterdir()) == [
        "background.png",
        "gradients.safetensors",
        "unit.toml",
    ]
    numbers = tmp_path / "numbers.json"
    assert run("evaluate", tmp_path / "unit", dataset.folder, "--json", numbers) == 0
    assert "was calibrated on all" in capsys.readouterr().err
    rows = json.loads(numbers.read_text())["rows"]
    assert max(row["theta_x_deg"] for row in rows) < 4

    frame = dataset.folder / dataset.labels[0].file
    assert run("reconstruct", tmp_path / "unit", frame, "--out", tmp_path / "depth") == 0
    (depth_file,) = (tmp_path / "depth").glob("*.npy")
    depth, truth = np.load(depth_file), true_depth_mm(dataset.labels[0])
    assert depth.dtype == np.float32
    assert depth.shape == SIZE_PX[::-1]
    assert depth.max() == pytest.approx(truth.max(), rel=0.15)
    assert np.unravel_index(depth.argmax(), depth.shape) == pytest.approx(
        (dataset.labels[0].center_y_px, dataset.labels[0].center_x_px), abs=3
    )
    picture = read_image(depth_file.with_suffix(".png"))
    assert picture.std() > 10


def test_what_is_fitted_beside_is_what_one_would_fit_alone(tmp_path, monkeypatch):
    monkeypatch.setattr(default_training, "STEPS", 60)
    dataset = make_dataset(tmp_path / "set", presses=6)
    words = ["--estimator", "default", "--seed", 3, "--out", tmp_path / "unit"]
    assert run("calibrate", dataset.folder, *words) == 0
    kept = load_calibration(tmp_path / "unit")
    here = calibrate(
        dataset,
        read_presses(dataset),
        estimator="default",
        serial="unit",
        created=kept.card.created,
        metrics=kept.card.metrics,
        seed=3,
    )
    assert here.card == kept.card
    fitted = kept.estimator.tensors()
    assert all(
        np.array_equal(fitted[key], value) for key, value in here.estimator.tensors().items()
    )


@pytest.mark.parametrize("lights_deg", [{"R": 90.0, "B": -90.0}, None], ids=["two", "three"])
def test_a_unit_that_sees_one_slope_says_so_and_shows_its_doubt(tmp_path, lights_deg):
    options = {} if lights_deg is None else {"lights_deg": lights_deg}
    dataset = make_dataset(tmp_path / "set", presses=8, **options)
    words = ["calibrate", dataset.folder, "--estimator", "table", "--out", tmp_path / "unit"]
    assert run(*words) == 0
    missing = "none" if lights_deg is None else "network"
    assert f'missing_axis = "{missing}"' in (tmp_path / "unit" / "unit.toml").read_text()
    frame, numbers = dataset.folder / dataset.labels[0].file, tmp_path / "numbers.json"
    words = ["reconstruct", tmp_path / "unit", frame, "--out", tmp_path / "depth"]
    assert run(*words, "--json", numbers) == 0
    (image,) = json.loads(numbers.read_text())["images"]
    pictures = list((tmp_path / "depth").glob("*-doubt.png"))
    if lights_deg is None:
        assert image["doubt"] is None and not pictures
    else:
        assert 0 < image["doubt"] < 0.5 and read_image(pictures[0]).std() > 10


def test_table_writes_what_it_prints(workplace, tmp_path, capsys, in_this_process):
    files = [tmp_path / name for name in ("t.json", "t.md", "t.html")]
    words = [word for file in files for word in (f"--{FORMATS[file.suffix]}", file)]
    words += ["--folds", 2]  # of all presses, enough for intervals
    assert run("table", workplace / "set", "--estimator", "table", *words) == 0
    printed = capsys.readouterr().out
    for row in json.loads(files[0].read_text())["rows"]:
        assert f"{row['theta_x_deg']:.2f} [" in printed
        assert f"{row['theta_x_deg']:.2f} [" in files[1].read_text()
        assert f"{row['theta_x_deg']:.2f} [" in files[2].read_text()


FORMATS = {".json": "json", ".md": "markdown", ".html": "html"}


def test_same_seed_same_table_in_whatever_process(workplace, tmp_path, request):
    for name in ("a", "b"):
        words = ["--estimator", "table", "--seed", 3, "--json", tmp_path / name]
        assert run("table", workplace / "set", *words) == 0
        request.getfixturevalue("in_this_process")
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_press_that_cannot_be_used_is_named_and_counted(workplace, tmp_path, capsys):
    shutil.copytree(workplace / "set", tmp_path / "set")
    shutil.copy(tmp_path / "set" / "background.png", tmp_path / "set" / "press05.png")
    numbers = tmp_path / "numbers.json"
    assert run("evaluate", workplace / "unit", tmp_path / "set", "--json", numbers) == 0
    said = capsys.readouterr().err
    assert "left out 1 press" in said
    assert "press05.png: no contact is visible" in said
    assert json.loads(numbers.read_text())["presses"]["test"] == 11


def cut(path, share=0.5):
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])


def edit(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


DAMAGES = {
    "missing image": (lambda s: (s / "press03.png").unlink(), "press03.png"),
    "truncated image": (lambda s: cut(s / "press03.png"), "press03.png"),
    "background of another size": (
        lambda s: write_image(s / "background.png", np.zeros((10, 12, 3), np.uint8)),
        "press00.png",
    ),
    "missing background": (lambda s: (s / "background.png").unlink(), "background.png"),
    "label outside the frame": (
        lambda s: edit(s / "labels.csv", "\npress01.png,", "\npress01.png,9"),
        "press01.png",
    ),
    "label with a NaN": (
        lambda s: (s / "labels.csv").write_text(
            "file,center_x_px,center_y_px,contact_radius_px\npress01.png,nan,20,10\n"
        ),
        "press01.png",
    ),
    "ball smaller than its circle": (
        lambda s: edit(s / "dataset.toml", "ball_radius_mm = 4.0", "ball_radius_mm = 0.5"),
        "labels.csv",
    ),
    "no press": (
        lambda s: (s / "labels.csv").write_text("file,center_x_px,center_y_px,contact_radius_px\n"),
        "labels.csv",
    ),
    "one press": (
        lambda s: (s / "labels.csv").write_text(
            "\n".join((s / "labels.csv").read_text().splitlines()[:2]) + "\n"
        ),
        "1 usable press",
    ),
    "no labels": (lambda s: (s / "labels.csv").unlink(), "labels.csv"),
    "unknown key": (
        lambda s: edit(s / "dataset.toml", "ball_radius_mm", "ball_radius"),
        "dataset.toml",
    ),
    "no licence": (
        lambda s: edit(s / "dataset.toml", 'licence = "CC-BY-4.0"\n', ""),
        "licence",
    ),
    "not TOML": (lambda s: (s / "dataset.toml").write_bytes(b"\xff\x00["), "dataset.toml"),
    "no card": (lambda s: (s / "dataset.toml").unlink(), "dataset.toml"),
    "path out of the folder": (
        lambda s: edit(s / "labels.csv", "press02.png", "../press02.png"),
        "../press02.png",
    ),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_bad_dataset_is_refused_in_one_sentence(workplace, tmp_path, capsys, damage):
    shutil.copytree(workplace / "set", tmp_path / "set")
    spoil, named = DAMAGES[damage]
    spoil(tmp_path / "set")
    before = contents(tmp_path)
    sentence = refused(capsys, "calibrate", tmp_path / "set", "--out", tmp_path / "unit")
    assert named in sentence
    assert contents(tmp_path) == before


UNIT_DAMAGES = {
    "unit.toml": lambda u: edit(u / "unit.toml", "serial", "seriel"),
    "background.png": lambda u: cut(u / "background.png"),
    "gradients.safetensors": lambda u: cut(u / "gradients.safetensors"),
}


@pytest.mark.parametrize("file", UNIT_DAMAGES)
def test_damaged_unit_is_refused_by_the_files_name(workplace, tmp_path, capsys, file):
    shutil.copytree(workplace / "unit", tmp_path / "unit")
    UNIT_DAMAGES[file](tmp_path / "unit")
    frame = workplace / "set" / "press00.png"
    words = ["reconstruct", tmp_path / "unit", frame, "--out", tmp_path / "depth"]
    assert file in refused(capsys, *words)
    assert not (tmp_path / "depth").exists()


def test_one_bad_image_of_several_writes_nothing(workplace, tmp_path, capsys):
    good = workplace / "set" / "press00.png"
    bad = tmp_path / "bad.png"
    shutil.copy(good, bad)
    cut(bad, 0.9)
    words = ["reconstruct", workplace / "unit", good, bad, "--out", tmp_path / "depth"]
    assert "bad.png" in refused(capsys, *words)
    assert not (tmp_path / "depth").exists()


def test_frame_and_background_of_another_size_are_refused(workplace, tmp_path, capsys):
    frame = workplace / "set" / "press00.png"
    small = tmp_path / "small.png"
    write_image(small, np.zeros((12, 16, 3), np.uint8))
    words = ["reconstruct", workplace / "unit", "--out", tmp_path / "depth"]
    assert "small.png" in refused(capsys, *words, small)
    assert "small.png" in refused(capsys, *words, frame, "--background", small)
    assert not (tmp_path / "depth").exists()


def test_two_images_of_one_name_do_not_overwrite_each_other(workplace, tmp_path, capsys):
    frame = workplace / "set" / "press00.png"
    (tmp_path / "other").mkdir()
    twin = shutil.copy(frame, tmp_path / "other" / "press00.png")
    words = ["reconstruct", workplace / "unit", frame, twin, "--out", tmp_path / "depth"]
    assert "press00" in refused(capsys, *words)


def test_an_existing_unit_is_not_overwritten(workplace, capsys):
    before = contents(workplace / "unit")
    words = ["calibrate", workplace / "set", "--out", workplace / "unit"]
    assert "not empty" in refused(capsys, *words)
    assert contents(workplace / "unit") == before


@pytest.mark.parametrize(
    "words",
    [
        ("calibrate", "no-such-set", "--out", "unit"),
        ("table", "no-such-set"),
        ("table", "{set}", "--estimator", "guess"),
        ("table", "{set}", "--folds", "0"),
        ("table", "{set}", "--folds", "99"),
        ("calibrate", "{set}", "--out", "unit", "--design", "round"),
        ("evaluate", "no-such-unit", "{set}"),
        ("reconstruct", "no-such-unit", "{set}/press00.png", "--out", "depth"),
        ("reconstruct", "{unit}", "no-such-image.png", "--out", "depth"),
        ("data", "path", "no-such-set"),
        ("calibrate", "{set}", "--out", "unit", "--estimator", "guess"),
        ("calibrate", "{set}", "--out", "."),
        ("calibrate", "{set}", "--out", ".."),
    ],
)
def test_what_does_not_exist_is_refused_in_one_sentence(
    workplace, tmp_path, monkeypatch, capsys, words
):
    monkeypatch.chdir(tmp_path)
    places = {"set": str(workplace / "set"), "unit": str(workplace / "unit")}
    refused(capsys, *(word.format(**places) for word in words))
    assert not any(tmp_path.iterdir())


def test_disk_full_leaves_nothing_half_written(
    workplace, tmp_path, monkeypatch, capsys, in_this_process
):
    def full(_descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    words = ["calibrate", workplace / "set", "--estimator", "table", "--out", tmp_path / "unit"]
    assert "No space left" in refused(capsys, *words)
    words = ["table", workplace / "set", "--estimator", "table", "--json", tmp_path / "t.json"]
    assert "t.json" in refused(capsys, *words)
    assert not any(Path(tmp_path).iterdir())


@pytest.mark.parametrize("seed", ["-1", "1.5", "x", str(2**63), "9" * 5000])
def test_a_seed_that_is_none_is_refused(workplace, tmp_path, capsys, seed):
    words = ["calibrate", workplace / "set", "--out", tmp_path / "unit", "--seed", seed]
    assert run(*words) == 2
    assert "--seed" in capsys.readouterr().err


def test_an_evaluation_of_nothing_says_what_it_needs(capsys):
    assert "name a unit folder" in refused(capsys, "evaluate")


@pytest.mark.parametrize("estimators", ["table,mpl", "table,"])
def test_estimators_are_all_looked_up_before_the_first_is_fitted(
    workplace, monkeypatch, capsys, estimators
):
    monkeypatch.setattr("app.table.process_pool", lambda: pytest.fail("it began"))
    words = ("table", workplace / "set", "--estimator", estimators)
    assert "no estimator is called" in refused(capsys, *words)


def test_an_estimator_named_twice_is_measured_once(workplace, tmp_path, in_this_process):
    for name, estimators in (("once", "table"), ("twice", "table, table")):
        words = ["--estimator", estimators, "--json", tmp_path / name]
        assert run("table", workplace / "set", *words) == 0
    assert (tmp_path / "once").read_bytes() == (tmp_path / "twice").read_bytes()
