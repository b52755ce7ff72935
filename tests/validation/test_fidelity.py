# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The comparison of twin and sensor recovers what a synthetic sensor was made with."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.synthetic import LIGHTS_DEG, make_dataset
from validation.fidelity import Transfer, keystone, likeness, near_far, transfer
from validation.metrics import mean_errors, press_errors
from validation.report.fidelity import FIGURES, fidelity_section


@pytest.fixture(scope="module")
def ideal(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_dataset(tmp_path_factory.mktemp("ideal") / "a", presses=10).folder


def test_an_ideal_sensor_is_measured_as_it_was_made(ideal: Path, tmp_path: Path) -> None:
    found = likeness(ideal, corners_px=[(0.0, 0.0), (100.0, 10.0), (100.0, 60.0), (0.0, 70.0)])
    assert found.keystone == pytest.approx(50 / 70)
    assert found.unevenness < 0.02
    assert all(value == pytest.approx(1, abs=0.02) for value in found.near_far.values())
    assert all(share < 0.1 for share in found.off_axis.values())
    levels = list(found.levels_per_slope.values())
    assert max(levels) < 1.15 * min(levels)
    assert 0.4 < found.grain < 1.2  # half a level in each of two frames, and rounding
    noisy = make_dataset(tmp_path / "b", presses=4, noise_gray_levels=3.0).folder
    assert likeness(noisy).grain == pytest.approx(3 * np.sqrt(2), rel=0.15)


def test_near_and_far_are_told_by_the_lights_side() -> None:
    ramp = np.tile(np.linspace(0.2, 0.8, 90, dtype=np.float32)[:, None, None], (1, 120, 3))
    ratios = near_far(ramp, {"R": 90.0, "B": -90.0, "G": 180.0})
    assert ratios["R"] > 3 and ratios["B"] == pytest.approx(1 / ratios["R"])
    assert ratios["G"] == pytest.approx(1)


def test_keystone_of_a_rectangle_is_one() -> None:
    assert keystone([(0.0, 0.0), (9.0, 0.0), (9.0, 4.0), (0.0, 4.0)]) == 1


def test_a_network_crosses_to_the_mirrored_sensor_and_not_to_a_turned_one(
    ideal: Path, tmp_path: Path
) -> None:
    mirrored = {"R": -90.0, "G": LIGHTS_DEG["G"], "B": 90.0}
    turned = {"R": 0.0, "G": 90.0, "B": 180.0}
    own = transfer(ideal, ideal).errors.values["gy_mae"]
    crossed, failed = (
        transfer(ideal, make_dataset(tmp_path / name, presses=6, lights_deg=lights).folder)
        for name, lights in (("m", mirrored), ("t", turned))
    )
    assert crossed.errors.values["gy_mae"] < 2 * own + 0.01
    assert failed.errors.values["gy_mae"] > 3 * crossed.errors.values["gy_mae"]
    section = fidelity_section([likeness(ideal)], [crossed])
    assert all(name.partition("[")[0] in section.html for name in FIGURES if "|" not in name)
    assert "in brackets: press-level bootstrap" in section.html and "<small>[" in section.html


def test_a_cell_of_one_press_has_no_interval_and_one_without_untouched_gel_no_grain(
    ideal: Path,
) -> None:
    rng = np.random.default_rng(0)
    truth = rng.normal(size=(50, 2)).astype(np.float32)
    press = press_errors("a", truth + np.float32(0.1), truth, np.ones(50, bool))
    crossed = Transfer(learnt="a", judged="b", errors=mean_errors([press], 0))
    section = fidelity_section([replace(likeness(ideal), grain=float("nan"))], [crossed])
    assert "1 press, too few for an interval" in section.html
    assert "<td>0.100 / 0.100</td>" in section.html
    assert "nan" not in section.html
