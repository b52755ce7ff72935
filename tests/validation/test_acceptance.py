# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Each limit fails where the one thing that it watches is broken; a good set passes them all."""

import json
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy import ndimage

from app.__main__ import main
from recon.calibration import calibrate
from recon.images import read_image, write_image
from recon.presses import read_presses
from sensor.dataset import read_dataset, write_card, write_labels
from tests.synthetic import make_dataset
from validation.acceptance.certificate import document, junit_xml, page_html, pdf_bytes
from validation.acceptance.limits import LIMITS, Limit, grades, verdict
from validation.acceptance.measurements import accept_unit

TEXTURE = 1 + 0.1 * ndimage.gaussian_filter(
    np.random.default_rng(5).standard_normal((90, 120, 1)), (1.5, 1.5, 0)
)
"""Of a real film: without any, nobody could see that the picture has moved."""


def good_set(folder, seed=0):
    dataset = make_dataset(folder, presses=30, seed=seed)
    change_frames(dataset, lambda frame, _: frame * TEXTURE)
    return read_dataset(folder)


def change_frames(dataset, change, *, blank_too=True):
    """Rewrite frames; ``change`` takes and gives float grey levels, and is told the index."""
    names = [*dataset.card.background, *(label.file for label in dataset.labels)]
    for index, name in enumerate(names[0 if blank_too else 1 :]):
        frame = change(read_image(dataset.folder / name).astype(float), index)
        levels = np.clip(np.round(frame), 0, 255).astype(np.uint8)
        write_image(dataset.folder / name, levels)


@pytest.fixture(scope="module")
def calibration(tmp_path_factory):
    dataset = good_set(tmp_path_factory.mktemp("taught") / "set")
    return calibrate(
        dataset,
        read_presses(dataset),
        estimator="table",
        serial="wedge-007",
        created="2026-01-01",
        metrics={"fitted_presses": 30},
        seed=0,
    )


@pytest.fixture(scope="module")
def accepted(calibration, tmp_path_factory):
    return accept_unit(calibration, good_set(tmp_path_factory.mktemp("today") / "set", 1), seed=0)


def test_a_good_sensor_passes_every_limit(accepted):
    found = grades(accepted.values)
    assert set(found) == {limit.name for limit in LIMITS}
    assert "fail" not in found.values() and verdict(accepted.values) in ("A", "B")


def only_channel(channel, change):
    def changed(frame, index):
        frame = frame.copy()
        frame[..., channel] = change(frame[..., channel])
        return frame

    return changed


def worn(frame, _):
    torn = np.random.default_rng(1).random(frame.shape[:2]) > 0.985
    return np.where(ndimage.binary_dilation(torn, iterations=2)[..., None], 20.0, frame)


def leaking(frame, _):
    mean = frame.mean(-1, keepdims=True)
    return 0.97 * mean + 0.03 * frame


RAMP = np.linspace(0.0, 1.0, 120) ** 2
DARK = np.where(np.arange(120) < 40, 0.02, 1.0)[None, :, None]


@pytest.mark.parametrize(
    ("limit", "change", "blank_too"),
    [
        ("least_contrast_grey_levels", only_channel(0, lambda red: 0 * red + 60), True),
        ("lights_turned_deg", lambda frame, _: frame[..., ::-1], True),
        ("color_balance", only_channel(2, lambda blue: 0.15 * blue), True),
        ("saturated_share", lambda frame, _: 2.5 * frame, True),
        ("least_evenness", only_channel(0, lambda red: red * RAMP), True),
        ("lit_share", lambda frame, _: frame * DARK, True),
        ("worn_share", worn, True),
        ("axes_ratio", leaking, True),
        ("moved_px", lambda frame, _: np.roll(frame, 5, axis=1), True),
        ("drift_grey_levels", lambda frame, _: frame + 16, False),
        (
            "noise_grey_levels",
            lambda frame, i: frame + np.random.default_rng(i).normal(0, 8, frame.shape),
            True,
        ),
    ],
)
def test_one_broken_thing_fails_its_limit(calibration, tmp_path, limit, change, blank_too):
    dataset = good_set(tmp_path / "set", 1)
    change_frames(dataset, change, blank_too=blank_too)
    found = accept_unit(calibration, dataset, seed=0)
    assert grades(found.values)[limit] == "fail"


@pytest.mark.parametrize(("limit", "shift"), [("theta_x_deg", (7, 0)), ("theta_y_deg", (0, 7))])
def test_labels_beside_the_ball_fail_the_error_along_their_axis(
    calibration, tmp_path, limit, shift
):
    dataset = good_set(tmp_path / "set", 1)
    moved = [
        replace(x, center_x_px=x.center_x_px + shift[0], center_y_px=x.center_y_px + shift[1])
        for x in dataset.labels
    ]
    write_labels(dataset.folder / "labels.csv", moved)
    found = accept_unit(calibration, read_dataset(dataset.folder), seed=0)
    assert grades(found.values)[limit] == "fail"


def test_a_wrong_ball_fails_the_depth(calibration, tmp_path):
    dataset = good_set(tmp_path / "set", 1)
    write_card(dataset.folder / "dataset.toml", replace(dataset.card, ball_radius_mm=1.9))
    found = accept_unit(calibration, read_dataset(dataset.folder), seed=0)
    assert grades(found.values)["depth_rmse_share"] == "fail"


def test_presses_in_one_corner_do_not_cover_the_pad(calibration, tmp_path):
    dataset = good_set(tmp_path / "set", 1)
    first = sorted(dataset.labels, key=lambda x: x.center_x_px + x.center_y_px)[:2]
    write_labels(dataset.folder / "labels.csv", first)
    found = accept_unit(calibration, read_dataset(dataset.folder), seed=0)
    assert grades(found.values)["covered_share"] == "fail"


@pytest.mark.parametrize("limit", LIMITS, ids=lambda limit: limit.name)
def test_grades_follow_their_limits_and_every_limit_has_a_reason(limit: Limit):
    worse = 1 if limit.less_is_better else -1
    assert [limit.grade(limit.grade_a), limit.grade(limit.grade_b)] == ["A", "B"]
    assert limit.grade(limit.grade_b + worse * 1e-6) == "fail"
    assert limit.grade(float("nan")) == "fail"
    assert len(limit.reason) > 20


def test_the_worst_grade_decides(accepted):
    values = dict(accepted.values)
    assert verdict(values | {"moved_px": 2.0}) == "B"
    assert verdict(values | {"moved_px": float("inf"), "noise_grey_levels": 0.1}) == "fail"


def test_every_form_of_the_certificate_says_the_same(calibration, accepted):
    failed = replace(accepted, values={**accepted.values, "moved_px": float("inf")})
    card = calibration.card
    said = json.loads(json.dumps(document(card, "<set>", failed), allow_nan=False))
    assert said["grade"] == "fail"
    suite = ElementTree.fromstring(junit_xml(card, "<set>", failed))
    broken = [case.get("name") for case in suite if case.find("failure") is not None]
    assert (
        broken
        == ["moved_px"]
        == [entry["name"] for entry in said["measurements"] if entry["grade"] == "fail"]
    )
    assert int(suite.get("tests")) == len(suite)
    page = page_html(card, "<set>", failed)
    assert "shift against the calibrated picture is unknown px" in page and "<set>" not in page
    assert pdf_bytes(card, "a set", failed).startswith(b"%PDF")
    assert pdf_bytes(card, "a set", failed) == pdf_bytes(card, "a set", failed)


def test_the_command_exits_zero_only_on_a_pass(calibration, tmp_path, capsys):
    calibration.save(tmp_path / "wedge-007")
    dataset = good_set(tmp_path / "set", 1)
    words = ["accept", str(tmp_path / "wedge-007"), str(dataset.folder)]
    files = ["--out", str(tmp_path / "paper"), "--junit", str(tmp_path / "accept.xml")]
    with pytest.raises(SystemExit) as left:
        main([*words, *files])
    assert left.value.code == 0
    for name in ("paper/index.html", "paper/certificate.pdf", "accept.xml"):
        assert (tmp_path / name).stat().st_size > 500
    change_frames(dataset, lambda frame, _: frame[..., ::-1])
    with pytest.raises(SystemExit) as left:
        main(words)
    assert left.value.code == 1
    assert "swapped colours" in capsys.readouterr().out
