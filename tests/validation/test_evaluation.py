# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Depth against the truth, and units on sets they have not seen."""

from dataclasses import replace

import numpy as np
import pytest

import recon.estimators.mlp_training as mlp_training
from recon.calibration import calibrate
from recon.integration.poisson import integrate
from recon.pixels import BallPress
from recon.presses import read_presses
from sensor.design import STANDARD
from sensor.errors import WedgeError
from simulation.indenters import calibration_ball
from simulation.presses import ball_presses, contact_circle_px, skin_under
from simulation.skin import gel_view, rest_height_mm
from tests.synthetic import MM_PER_PX, SIZE_PX, make_dataset, true_depth_mm
from validation.depth import cap_of, depth_errors, read_truth, true_depth
from validation.drift import evaluate_on
from validation.evaluation import held_out_metrics, hold_out
from validation.report.drift import verdict


@pytest.fixture(autouse=True)
def quick_training(monkeypatch):
    monkeypatch.setattr(mlp_training, "PIXELS", 4000)
    monkeypatch.setattr(mlp_training, "EPOCHS", 20)
    monkeypatch.setattr(mlp_training, "BATCH", 128)


@pytest.fixture
def dataset(tmp_path):
    return make_dataset(tmp_path / "set", presses=12)


def depth_of(gradient):
    return integrate(gradient, MM_PER_PX, "dirichlet")


def unit_of(dataset, **changes):
    options = dict(estimator="mlp", serial="t", created="2026-01-01", metrics={}, seed=0) | changes
    return calibrate(dataset, read_presses(dataset), **options)


RED_AND_BLUE = {"R": 90.0, "B": -90.0}


@pytest.mark.parametrize(
    ("unit_deg", "set_deg", "colors"),
    [
        (RED_AND_BLUE, RED_AND_BLUE, ""),
        (RED_AND_BLUE, {"R": 130.0, "B": -130.0}, ""),
        (RED_AND_BLUE, {"R": 136.0, "B": 224.0}, "RB"),
        ({"R": -170.0, "B": 10.0}, {"R": 170.0, "B": -10.0}, ""),
        (RED_AND_BLUE, {"R": -90.0, "B": 90.0}, "RB"),
        (RED_AND_BLUE, {"R": 90.0, "G": 180.0}, "B"),
        (RED_AND_BLUE, None, ""),
        (None, RED_AND_BLUE, "G"),
        (None, None, ""),
    ],
)
def test_presses_of_other_light_than_a_unit_s_are_told(tmp_path, unit_deg, set_deg, colors):
    dataset = make_dataset(tmp_path / "set", presses=4)
    cards = [replace(dataset.card, lights_deg=lights) for lights in (unit_deg, set_deg)]
    unit = unit_of(replace(dataset, card=cards[0]), estimator="table")
    found = evaluate_on(unit, replace(dataset, card=cards[1]), seed=0, called="june")
    assert found.lit_otherwise == colors
    said = verdict([found], [])[1:]
    assert len(said) == bool(colors)
    named = f"t on june: by lights_deg, the data set has no light of {' and '.join(colors)}, or"
    assert all(sentence.startswith(named) for sentence in said)


def test_true_gradients_give_the_true_depth(dataset):
    press = read_presses(dataset).presses[0]
    cap = cap_of(press)
    errors = depth_errors(depth_of(cap.gradient), press, dataset.folder)
    assert errors.rmse_mm < 0.01 * errors.peak_truth_mm
    assert abs(errors.bias_mm) < 0.01 * errors.peak_truth_mm
    assert errors.peak_mm == pytest.approx(errors.peak_truth_mm, rel=0.02)


def test_the_dent_of_a_ball_in_a_domed_gel_is_its_cap_and_does_not_lean_as_the_gel_does(tmp_path):
    view, off, leant = gel_view(STANDARD, 240), [], []
    dome = rest_height_mm(STANDARD.gel, *view.grid_mm)
    for place in ball_presses(STANDARD, calibration_ball(), 3, seed=0):
        skin = skin_under(STANDARD, view, place)
        *center_px, radius_px = contact_circle_px(skin)
        press = BallPress(
            file="ball.png",
            difference=np.zeros((*dome.shape, 3), np.float32),
            center_px=tuple(center_px),
            contact_radius_px=radius_px,
            ball_radius_mm=place.indenter.round_mm,
            mm_per_px=view.mm_per_px,
        )
        errors = depth_errors(skin.depth_mm, press, tmp_path)
        off.append(errors.rmse_mm / errors.peak_truth_mm)
        leaning = depth_errors(skin.depth_mm + dome, press, tmp_path)
        leant.append(leaning.rmse_mm / errors.peak_truth_mm)
    assert np.mean(off) < 0.05
    assert np.mean(leant) > 2 * np.mean(off)


def test_half_the_slope_is_half_the_depth(dataset):
    press = read_presses(dataset).presses[0]
    cap = cap_of(press)
    errors = depth_errors(depth_of(cap.gradient / 2), press, dataset.folder)
    assert errors.peak_mm == pytest.approx(errors.peak_truth_mm / 2, rel=0.1)
    assert errors.bias_mm < 0


def test_a_truth_file_goes_before_the_ball(dataset):
    press = read_presses(dataset).presses[3]
    (dataset.folder / "truth").mkdir()
    deeper = (true_depth_mm(dataset.labels[3]) + 1.0).astype(np.float32)
    np.save(dataset.folder / "truth" / "press03.npy", deeper)
    cap = cap_of(press)
    errors = depth_errors(depth_of(cap.gradient), press, dataset.folder)
    assert errors.truth == "truth file"
    assert errors.bias_mm == pytest.approx(-1.0, abs=0.02)


def test_gel_that_a_truth_file_knows_beside_the_contact_is_not_the_contact_s_error(dataset):
    press = read_presses(dataset).presses[3]
    (dataset.folder / "truth").mkdir()
    cap, label = cap_of(press), dataset.labels[3]
    x_mm, y_mm = press.offsets_mm
    collar = np.maximum(2 - np.hypot(x_mm, y_mm) / press.contact_radius_mm, 0) * ~cap.contact
    truth = (true_depth_mm(label) + 0.3 * cap.contact + 0.3 * collar).astype(np.float32)
    np.save(dataset.folder / "truth" / "press03.npy", truth)
    assert (truth > 0).sum() > 2 * cap.contact.sum()
    inside = depth_errors(truth - 0.1 * cap.contact, press, dataset.folder)
    assert inside.rmse_mm == pytest.approx(0.1) and inside.bias_mm == pytest.approx(-0.1)
    beside = depth_errors(truth - 0.1 * ~cap.contact, press, dataset.folder)
    assert beside.rmse_mm == beside.bias_mm == 0


def test_a_cap_is_judged_wherever_it_is(dataset):
    for press in read_presses(dataset).presses:
        truth = true_depth(np.zeros(press.difference.shape[:2]), press, dataset.folder)
        assert ((truth.depth_mm > 0) == truth.contact).all()


def test_each_frame_of_an_archive_has_a_truth_of_its_own(tmp_path):
    dataset = make_dataset(tmp_path, presses=3, in_npz=True)
    (tmp_path / "truth").mkdir()
    presses = read_presses(dataset).presses
    for index in (0, 2):
        truth = np.full(SIZE_PX[::-1], 1.0 + index, np.float32)
        np.save(tmp_path / "truth" / f"frames-{index}.npy", truth)
    found = [read_truth(tmp_path, press) for press in presses]
    assert found[0].max() == 1.0
    assert found[1] is None
    assert found[2].max() == 3.0


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\x93NUMPY",
        np.zeros((3, 4), np.float32),
        np.zeros(SIZE_PX[::-1], int),
        np.zeros(SIZE_PX[::-1], np.float32),
        np.full(SIZE_PX[::-1], np.nan, np.float32),
    ],
)
def test_a_damaged_truth_file_is_refused_by_name(dataset, content):
    path = dataset.folder / "truth" / "press00.npy"
    path.parent.mkdir()
    if isinstance(content, bytes):
        path.write_bytes(content)
    else:
        np.save(path, content)
    with pytest.raises(WedgeError, match=r"press00\.npy"):
        read_truth(dataset.folder, read_presses(dataset).presses[0])


def test_a_unit_is_as_good_on_new_presses_of_its_sensor(dataset, tmp_path):
    unit = unit_of(dataset)
    table = evaluate_on(unit, make_dataset(tmp_path / "new", presses=6, seed=9), seed=0).errors
    held_out = hold_out(dataset, read_presses(dataset), "mlp", seed=0)
    for new, old in zip(table.rows, held_out.rows, strict=True):
        assert new.errors.values["theta_x_deg"] < 2 * old.errors.values["theta_x_deg"] + 0.5
    assert table.test == 6


def test_a_unit_refuses_frames_of_another_size(dataset, tmp_path):
    corners = ((20.0, 10.0), (150.0, 18.0), (138.0, 108.0), (32.0, 100.0))
    other = make_dataset(tmp_path / "other", presses=3, corners_px=corners)
    with pytest.raises(WedgeError, match="another sensor"):
        evaluate_on(unit_of(dataset), other, seed=0)


def test_a_unit_with_opposite_lights_alone_infers_the_other_axis(tmp_path):
    dataset = make_dataset(tmp_path / "two", presses=12, lights_deg={"R": 90.0, "B": -90.0})
    unit = unit_of(dataset)
    assert (unit.card.channels, unit.card.missing_axis) == ("RB", "network")
    row = evaluate_on(unit, dataset, seed=0).errors.rows[-1]
    assert row.errors.values["gx_mae"] < 0.5 * row.errors.mean_abs_gradient


def test_metrics_are_those_of_the_presses_held_out(dataset):
    table = hold_out(dataset, read_presses(dataset), "table", seed=0)
    metrics = held_out_metrics(table, fitted_presses=12)
    assert metrics["held_out_presses"] == 2
    assert metrics["contact_gx_mae"] == table.rows[-1].errors.values["gx_mae"]
    assert metrics["contact_curvature"] == table.rows[-1].errors.curvature > 0.8
    hollow = [replace(row, errors=replace(row.errors, curvature=-1.0)) for row in table.rows]
    assert held_out_metrics(replace(table, rows=tuple(hollow)), 12)["contact_curvature"] == 0


def test_one_press_is_not_enough(tmp_path):
    dataset = make_dataset(tmp_path / "one", presses=1)
    with pytest.raises(WedgeError, match="press"):
        hold_out(dataset, read_presses(dataset), "table", seed=0)
