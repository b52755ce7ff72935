# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Weights that no training here wrote are one sentence, never a depth that is no number."""

import json
import struct
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import load_file, save_file

from recon.calibration import load_calibration, unit_of_set
from recon.estimators import restore_estimator
from recon.estimators.default import MEMBERS, MEMBERS_OF_FEW, SLOPE_KNOTS
from recon.estimators.lean import FLAT
from recon.estimators.lookup_table import BINS
from recon.estimators.mlp import HIDDEN
from recon.estimators.networks import HIDDEN as HIDDEN_OF_DEFAULT
from recon.estimators.shading import LIGHT_POWERS
from recon.estimators.surroundings import ASPECTS
from recon.still import FARTHEST, REACH
from recon.tensor_files import read_tensors
from recon.unet.weights import MISSING_AXIS, load_weights, save_weights, shipped_weights
from sensor.errors import WedgeError
from tests.synthetic import make_dataset

KINDS = {"BF16": 16, "F8_E4M3": 8, "F8_E5M2": 8, "F8_E8M0": 8, "F4": 4, "C64": 64}
"""Numbers that numpy lacks or that nothing here writes, and their bits."""


def write_kind(path: Path, kind: str, said: dict[str, str]) -> None:
    """Two zeros of a kind of numbers, as others write them."""
    data = bytes(KINDS[kind] * 2 // 8)
    header = {"w": {"dtype": kind, "shape": [2], "data_offsets": [0, len(data)]}}
    text = json.dumps(header | {"__metadata__": said}).encode()
    path.write_bytes(struct.pack("<Q", len(text)) + text + data)


@pytest.mark.parametrize("kind", KINDS)
def test_numbers_that_numpy_lacks_are_named(tmp_path, kind):
    path = tmp_path / "weights.safetensors"
    write_kind(path, kind, {})
    with pytest.raises(WedgeError, match=rf"weights\.safetensors cannot be.*: w is of {kind};"):
        load_weights(path)
    with pytest.raises(WedgeError, match=rf"w is of {kind}; calibrate again\.$"):
        read_tensors(path, "", "calibrate again")


@pytest.fixture(scope="module")
def calibration(tmp_path_factory):
    dataset = make_dataset(tmp_path_factory.mktemp("set"), presses=3)
    return unit_of_set(dataset, "table")


@pytest.mark.parametrize("kind", KINDS)
def test_a_unit_of_such_numbers_is_refused_by_name(tmp_path, calibration, kind):
    calibration.save(tmp_path / "unit")
    path = tmp_path / "unit" / "gradients.safetensors"
    write_kind(path, kind, {"fitted": f"table on {calibration.card.dataset_sha256}"})
    with pytest.raises(WedgeError, match=rf"gradients\.safetensors .* w is of {kind}; calibrate"):
        load_calibration(tmp_path / "unit")


def test_a_unit_of_absurd_numbers_is_refused_by_name(tmp_path, calibration):
    calibration.save(tmp_path / "unit")
    path = tmp_path / "unit" / "gradients.safetensors"
    said = {"fitted": f"table on {calibration.card.dataset_sha256}"}
    tensors = load_file(path)
    for bins in (np.full_like(tensors["bins"], 3e38), np.full_like(tensors["bins"], -1e30)):
        save_file(tensors | {"bins": bins}, path, said)
        with pytest.raises(WedgeError, match=r"gradients\.safetensors: .* bins .* above 1000"):
            load_calibration(tmp_path / "unit")
    save_file({key: np.zeros_like(values) for key, values in tensors.items()}, path, said)
    with pytest.raises(WedgeError, match=r"gradients\.safetensors: .* high - low must be above"):
        load_calibration(tmp_path / "unit")


def tensors_of(name: str) -> dict[str, np.ndarray]:
    """Arrays as an estimator's training leaves them."""
    random = np.random.default_rng(0)
    features = (2 + ASPECTS) * 3 + 2
    if name == "table":
        shapes = {"low": (3,), "high": (3,), "bins": (BINS, BINS, BINS, 2)}
    elif name == "mlp":
        shapes = {"color_scale": (3,)}
        for index, shape in enumerate(pairwise((5, *HIDDEN, 2))):
            shapes |= {f"weight{index}": shape, f"bias{index}": shape[1:]}
    else:
        shapes = {"light": (len(LIGHT_POWERS), 3), "mean": (features,), "spread": (features,)}
        shapes |= {"gel": FLAT.shape, "error90": (len(SLOPE_KNOTS), 2), "reach": (1,)}
        for index, shape in enumerate(pairwise((features, *HIDDEN_OF_DEFAULT, 2))):
            shapes |= {f"weight{index}": (MEMBERS, *shape), f"bias{index}": (MEMBERS, shape[1])}
    made = {key: random.normal(0, 0.3, shape) for key, shape in shapes.items()}
    for key in made.keys() & {"color_scale", "spread", "error90", "high"}:
        made[key] = 0.01 + np.abs(made[key])
    if name == "table":
        made["low"] = -made["high"]
    if name == "default":
        made["reach"] = np.array([REACH])
    return {key: values.astype(np.float32) for key, values in made.items()}


@pytest.mark.parametrize("every", [True, False], ids=["all of it", "one number"])
@pytest.mark.parametrize("value", [0.0, 3e38, -3e38, 1e30, 1e12, 999.0, -999.0, 1e-30, -1.0, 1e-45])
@pytest.mark.parametrize("name", ["default", "mlp", "table"])
def test_an_array_of_any_number_is_refused_or_gives_finite_slopes(name, value, every):
    tensors, width = tensors_of(name), 3 * (1 + ASPECTS) if name == "default" else 3
    steps = np.array([-1, -1e-3, 0, 1e-3, 1], np.float32)
    color = np.repeat(np.stack(np.meshgrid(steps, steps, steps), -1).reshape(-1, 3), 5, 0)
    color = np.tile(color, width // 3)
    position = np.tile(np.array([[-1, -1], [1, -1], [0, 0], [-1, 1], [1, 1]], np.float32), (125, 1))
    plain = restore_estimator(name, tensors, "RGB").slopes(color, position)
    assert np.isfinite(plain).all()
    for key, values in tensors.items():
        odd = values.copy()
        odd[...] = value if every else odd
        odd.flat[0] = value
        try:
            estimator = restore_estimator(name, tensors | {key: odd}, "RGB")
        except WedgeError as error:
            assert key in str(error)
            continue
        assert abs(value) < 1e3 and np.abs(estimator.slopes(color, position)).max() < 1e38


def test_how_far_gel_follows_is_kept_bounded_and_taken_as_usual_of_units_made_before():
    tensors = tensors_of("default") | {"reach": np.array([0.1], np.float32)}
    estimator = restore_estimator("default", tensors, "RGB")
    assert estimator.tensors()["reach"] == tensors["reach"]
    with pytest.raises(WedgeError, match=f"reach is .*not one share from 0 to {FARTHEST}"):
        restore_estimator("default", tensors | {"reach": 2 * tensors["reach"]}, "RGB")
    del tensors["reach"]
    assert restore_estimator("default", tensors, "RGB").reach == pytest.approx(REACH)


@pytest.mark.parametrize("members", [0, 1, MEMBERS, 3, MEMBERS_OF_FEW, 5, 1000])
def test_as_many_networks_are_read_as_many_or_few_presses_teach(members):
    tensors = tensors_of("default")
    for key in tensors:
        if key.startswith(("weight", "bias")):
            tensors[key] = np.resize(tensors[key], (members, *tensors[key].shape[1:]))
    if members in (MEMBERS, MEMBERS_OF_FEW):
        layers = restore_estimator("default", tensors, "RGB").layers
        assert all(len(array) == members for layer in layers for array in layer)
        tensors["bias1"] = tensors["bias1"][1:]  # the others' count is another
    tensors["weight0"] = tensors["weight0"] if members else np.float32(0).reshape(())
    with pytest.raises(WedgeError, match=r"(weight|bias)\d is"):
        restore_estimator("default", tensors, "RGB")


@pytest.mark.parametrize("value", [np.nan, np.inf, 3e38, -1e30])
def test_weights_that_are_no_numbers_or_absurd_are_refused_whatever_their_hash(tmp_path, value):
    weights = {name: values.copy() for name, values in shipped_weights().items()}
    weights["out.bias"][0] = value
    path = tmp_path / "weights.safetensors"
    save_weights(path, weights, "python -m recon.training.missing_axis", 0)
    with pytest.raises(WedgeError, match=r"weights\.safetensors holds out\.bias in sizes nobody"):
        load_weights(path)


@pytest.mark.parametrize("said", ["[" * 100_000, "1" * 5000, "{", "[]", "null", '"3"'])
def test_words_about_weights_that_nobody_writes_are_a_sentence(tmp_path, said):
    path = tmp_path / "weights.safetensors"
    save_file({"out.bias": np.zeros(2, np.float32)}, path, {MISSING_AXIS.name: said})
    with pytest.raises(WedgeError, match=r"weights\.safetensors"):
        load_weights(path)
