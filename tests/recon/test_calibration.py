# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import inspect
import re
import shutil
from dataclasses import replace

import numpy as np
import pytest
from safetensors.numpy import load_file, save_file

from recon.calibration import calibrate, lit_channels, load_calibration
from recon.geometry.lens import Lens, write_lens
from recon.images import write_image
from recon.presses import read_presses
from sensor.dataset import LENS_FILE
from sensor.design import FINGER
from sensor.design_file import design_text
from sensor.errors import WedgeError
from sensor.unit import DESIGN_FILE, read_unit_card, write_unit_card
from tests.synthetic import KEYSTONE_PX, RAW_SIZE_PX, SIZE_PX, make_dataset
from tests.written import write_anew

LENS = Lens(
    frame_size_px=RAW_SIZE_PX,
    focal_px=(150.0, 150.0),
    center_px=(80.0, 60.0),
    radial=(-0.1, 0.0, 0.0),
    rms_px=0.1,
)
OWN = replace(FINGER, name="mine", gel=replace(FINGER.gel, thickness_mm=1.25))


def calibrated(dataset, estimator="table", seed=0, **options):
    return calibrate(
        dataset,
        read_presses(dataset),
        estimator=estimator,
        serial="wedge-001",
        created="2026-03-01",
        metrics={"theta_x_deg": 2.5},
        seed=seed,
        **options,
    )


@pytest.fixture(scope="module")
def calibration(tmp_path_factory):
    folder = tmp_path_factory.mktemp("set")
    dataset = make_dataset(folder, presses=4, corners_px=KEYSTONE_PX)
    write_lens(folder / LENS_FILE, LENS)
    return calibrated(dataset)


@pytest.fixture
def unit(tmp_path, calibration):
    calibration.save(tmp_path / "unit")
    return tmp_path / "unit"


def test_a_background_instead_of_the_folder_is_refused_in_a_sentence(calibration):
    unchecked = inspect.unwrap(load_calibration)  # the tests' own check of types comes first, else
    with pytest.raises(WedgeError, match="not ndarray: give it as the first argument"):
        unchecked(calibration.background)


def test_the_card_says_what_was_calibrated_and_from_what(tmp_path):
    dataset = make_dataset(tmp_path, presses=2)
    card = calibrated(dataset, design=FINGER).card
    assert (card.serial, card.created, card.estimator) == ("wedge-001", "2026-03-01", "table")
    assert card.design_sha256 == FINGER.sha256
    assert calibrated(dataset).card.design_sha256 is None  # as nobody named one
    assert (card.dataset, card.dataset_sha256) == ("synthetic", dataset.sha256)
    assert card.frame_size_px == card.size_px == SIZE_PX
    assert card.metrics == {"theta_x_deg": 2.5}
    assert (card.channels, card.missing_axis) == ("RGB", "none")


@pytest.mark.parametrize("estimator", ["table", "mlp"])
@pytest.mark.parametrize("corners_px", [None, KEYSTONE_PX], ids=["straight", "keystone"])
def test_a_unit_comes_back_as_saved(tmp_path, estimator, corners_px, few_epochs):
    dataset = make_dataset(tmp_path / "set", presses=3, corners_px=corners_px)
    made = calibrated(dataset, estimator)
    made.save(tmp_path / "unit")
    again = load_calibration(tmp_path / "unit")
    assert again.card == made.card and again.lens is None
    np.testing.assert_array_equal(again.background, made.background)
    tensors, stored = made.estimator.tensors(), again.estimator.tensors()
    assert tensors.keys() == stored.keys()
    for key, values in tensors.items():
        np.testing.assert_array_equal(values, stored[key])
    assert {path.name for path in (tmp_path / "unit").iterdir()} == {
        "unit.toml",
        "background.png",
        "gradients.safetensors",
    }


def test_the_lens_goes_with_the_unit(unit, calibration):
    again = load_calibration(unit)
    assert again.lens == LENS
    for one, other in zip(calibration.unwarp.maps, again.unwarp.maps, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("design", [None, FINGER, OWN], ids=["none", "finger", "own"])
def test_a_unit_knows_the_design_that_it_was_built_from(tmp_path, design):
    calibrated(make_dataset(tmp_path / "set", presses=2), design=design).save(tmp_path / "unit")
    assert load_calibration(tmp_path / "unit").design == design
    assert (tmp_path / "unit" / DESIGN_FILE).exists() == (design is OWN)


def test_another_design_beside_a_unit_counts_for_nothing(unit):
    text = design_text(OWN)
    (unit / DESIGN_FILE).write_text(text)
    assert load_calibration(unit).design is None  # as its unit.toml names none
    write_unit_card(unit, replace(read_unit_card(unit), design_sha256=OWN.sha256))
    assert load_calibration(unit).design == OWN
    (unit / DESIGN_FILE).write_text(text.replace("thickness_mm", "thick", 1))
    with pytest.raises(WedgeError, match=r"design\.toml: unknown"):
        load_calibration(unit)
    (unit / DESIGN_FILE).write_text(design_text(FINGER))
    assert load_calibration(unit).design is None


def test_the_same_seed_writes_the_same_bytes(tmp_path, few_epochs):
    dataset = make_dataset(tmp_path / "set", presses=2)
    made = calibrated(dataset, "mlp")
    for name in ("one", "two"):
        calibrated(dataset, "mlp").save(tmp_path / name)
    for index in range(20):  # what a writer keeps in a hash map differs now and then only
        made.save(tmp_path / f"again {index}")
    for path in (tmp_path / "one").iterdir():
        for folder in ("two", *(f"again {index}" for index in range(20))):
            assert path.read_bytes() == (tmp_path / folder / path.name).read_bytes()


@pytest.fixture
def few_epochs(monkeypatch):
    pytest.importorskip("torch")
    from recon.estimators import mlp_training

    monkeypatch.setattr(mlp_training, "EPOCHS", 2)


@pytest.mark.parametrize(
    ("lights_deg", "expected"),
    [
        ({"R": 90.0, "G": 180.0, "B": -90.0}, ("RGB", "none")),
        ({"B": -90.0, "R": 90.0}, ("RB", "network")),
        ({"G": 0.0}, ("G", "network")),
        ({"R": 90.0, "G": 180.0}, ("RG", "none")),
        (None, ("RGB", "none")),
    ],
)
def test_only_lit_colours_are_looked_at(tmp_path, lights_deg, expected):
    dataset = make_dataset(tmp_path, presses=1)
    dataset = replace(dataset, card=replace(dataset.card, lights_deg=lights_deg))
    assert lit_channels(dataset) == expected
    card = calibrated(dataset).card
    assert (card.channels, card.missing_axis) == expected


def test_a_folder_that_is_not_empty_is_left_alone(tmp_path, calibration):
    (tmp_path / "kept").write_text("mine")
    with pytest.raises(WedgeError, match="already exists and is not empty"):
        calibration.save(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["kept"]


def test_a_disk_that_fills_half_way_leaves_no_unit(tmp_path, calibration, monkeypatch):
    import os

    left = [2]  # unit.toml and background.png still fit

    def fsync(_):
        left[0] -= 1
        if left[0] < 0:
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", fsync)
    with pytest.raises(WedgeError, match=r"gradients\.safetensors .* No space left on device"):
        calibration.save(tmp_path / "unit")
    assert not any(tmp_path.iterdir())


FILES = ["unit.toml", "background.png", "gradients.safetensors", LENS_FILE]


@pytest.mark.parametrize("name", FILES)
def test_a_file_cut_anywhere_is_refused_by_name(unit, name):
    path = unit / name
    whole = path.read_bytes()
    lines = whole.splitlines(keepends=True)
    if name.endswith(".toml"):  # cut inside each line: a cut between keys is a missing key
        lengths = [len(b"".join(lines[:i])) + len(lines[i]) // 2 for i in range(len(lines))]
    else:
        lengths = range(0, len(whole) - 4, max(1, len(whole) // 60))
    for length in lengths:
        write_anew(path, whole[:length])
        with pytest.raises(WedgeError, match=re.escape(name)):
            load_calibration(unit)


@pytest.mark.parametrize("name", FILES[:3])
def test_a_missing_file_is_refused_by_name(unit, name):
    (unit / name).unlink()
    with pytest.raises(WedgeError, match=re.escape(name)):
        load_calibration(unit)


def test_any_damage_to_the_arrays_header_is_a_sentence_or_nothing(unit):
    path = unit / "gradients.safetensors"
    whole = path.read_bytes()
    header = 8 + int.from_bytes(whole[:8], "little")
    for place in range(header):
        for flip in (0x01, 0x55):
            changed = bytearray(whole)
            changed[place] ^= flip
            write_anew(path, changed)
            try:
                load_calibration(unit)
            except WedgeError as error:
                assert "gradients.safetensors" in str(error)


def test_arrays_of_another_estimator_or_with_a_hole_are_refused(unit):
    path = unit / "gradients.safetensors"
    tensors, dataset_sha256 = load_file(path), load_calibration(unit).card.dataset_sha256
    save_file(tensors, path, {"fitted": f"mlp on {dataset_sha256}"})
    with pytest.raises(WedgeError, match=r"holds mlp estimator, but unit\.toml names table"):
        load_calibration(unit)
    save_file(tensors, path)
    with pytest.raises(WedgeError, match="holds no estimator"):
        load_calibration(unit)
    tensors["bins"].flat[3] = np.inf
    save_file(tensors, path, {"fitted": f"table on {dataset_sha256}"})
    with pytest.raises(WedgeError, match=r"gradients\.safetensors.* bins .* finite"):
        load_calibration(unit)


def test_an_unknown_estimator_is_refused(unit, calibration):
    write_unit_card(unit, replace(calibration.card, estimator="cnn"))
    with pytest.raises(WedgeError, match=r"unit\.toml names cnn"):
        load_calibration(unit)
    tensors = load_file(unit / "gradients.safetensors")
    learnt = {"fitted": f"cnn on {calibration.card.dataset_sha256}"}
    save_file(tensors, unit / "gradients.safetensors", learnt)
    with pytest.raises(WedgeError, match=r"'cnn' .* may come from an extension or a later version"):
        load_calibration(unit)


def test_another_units_gradients_are_refused(unit, tmp_path):
    other = calibrated(make_dataset(tmp_path / "other", presses=2, seed=5))
    other.save(tmp_path / "other unit")
    shutil.copy(tmp_path / "other unit" / "gradients.safetensors", unit)
    with pytest.raises(WedgeError, match=r"gradients\.safetensors was fitted to other presses"):
        load_calibration(unit)


def test_a_unit_without_corners_has_the_size_of_its_frames(unit, calibration):
    card = replace(calibration.card, corners_px=None, pad_size_mm=None, size_px=(7, 5))
    write_unit_card(unit, card)
    with pytest.raises(WedgeError, match=r"unit\.toml: size_px must be \[160, 120\]"):
        load_calibration(unit)


def test_files_that_do_not_fit_together_are_refused(unit, calibration):
    write_lens(unit / LENS_FILE, replace(LENS, frame_size_px=(161, 120)))
    with pytest.raises(WedgeError, match=r"unit\.toml does not fit .*camera\.toml: the lens was"):
        load_calibration(unit)
    write_lens(unit / LENS_FILE, LENS)
    write_image(unit / "background.png", np.zeros((60, 80, 3), np.uint8))
    with pytest.raises(WedgeError, match=r"background\.png .*: the frame is 80x60 .* not 160x120"):
        load_calibration(unit)


def test_another_folder_is_no_unit(tmp_path):
    with pytest.raises(WedgeError, match="is not a unit folder"):
        load_calibration(tmp_path)
