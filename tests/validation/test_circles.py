# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The measure of found circles: exact where the truth is moved by a known amount."""

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from recon.presses import press_reader
from tests.synthetic import make_dataset
from validation import circles
from validation.circles import COMPARED_AT_PX, Found, area_under_curve, interval, look, summary


def test_a_moved_label_is_seen_as_that_much_off(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=1)
    reader, label = press_reader(dataset), dataset.labels[0]
    here = look(reader, label)
    there = look(reader, replace(label, center_x_px=label.center_x_px - 2))
    assert here.offset_px is not None
    assert there.offset_px is not None
    scale = COMPARED_AT_PX / reader.blank.shape[1]
    assert np.subtract(there.offset_px, here.offset_px) == pytest.approx([2 * scale, 0], abs=1e-9)
    assert any(is_right for _, is_right in here.fits)
    row = summary("set", [here, replace(there, offset_px=None)])
    assert (row.presses, row.missed) == (2, 1)
    assert row.median_px == pytest.approx(np.hypot(*here.offset_px))


def test_radii_are_told_in_shares_of_the_labelled_ones(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=1)
    reader, label = press_reader(dataset), dataset.labels[0]
    here = look(reader, label)
    wide = look(reader, replace(label, contact_radius_px=2 * label.contact_radius_px))
    assert here.radius_ratio == pytest.approx(1, abs=0.15)
    assert wide.radius_ratio == pytest.approx(here.radius_ratio / 2)
    missed = Found(None, ())
    row = summary("set", [here, wide, missed])
    assert row.radius_ratio == pytest.approx(0.75 * here.radius_ratio)
    assert row.radius_ratios == (wide.radius_ratio, here.radius_ratio)
    assert summary("set", [missed]).radius_ratio is None


def test_caps_are_told_in_shares_of_those_on_the_labelled_circles(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=1)
    reader, label = press_reader(dataset), dataset.labels[0]
    ball_px = dataset.ball_radius_mm(label) / dataset.card.mm_per_px[0]
    here = look(reader, label)
    narrow = look(reader, replace(label, contact_radius_px=ball_px * np.sin(np.pi / 6)))
    wide = look(reader, replace(label, contact_radius_px=ball_px * np.sin(np.pi / 3)))
    lower = (1 - np.cos(np.pi / 6)) / (1 - np.cos(np.pi / 3))
    assert wide.cap_ratio == pytest.approx(lower * narrow.cap_ratio)
    assert here.cap_ratio == pytest.approx(here.radius_ratio**2, rel=0.1)
    assert summary("set", [narrow, wide]).cap_ratio == pytest.approx(
        (narrow.cap_ratio + wide.cap_ratio) / 2
    )


def test_the_area_is_the_share_of_pairs_in_the_right_order() -> None:
    fits = [(0.9, True), (0.5, True), (0.6, False), (0.1, False), (0.5, False)]
    pairs = [a - b for a, right in fits if right for b, wrong in fits if not wrong]
    assert area_under_curve(fits) == pytest.approx(np.mean([(d > 0) + (d == 0) / 2 for d in pairs]))


RIGHT, POOR, WRONG = ((0.9, True),), ((0.3, True),), ((0.4, False),)


@pytest.mark.parametrize(
    ("found", "nulls"),
    [
        ([Found((1.0, 0.0), RIGHT), Found((0.0, 1.0), RIGHT)], {"auc", "auc_ci95"}),
        ([Found(None, WRONG), Found(None, WRONG)], {"auc", "auc_ci95", "median_px", "bias_px"}),
        ([Found(None, ())], {"auc", "auc_ci95", "median_px", "bias_px"}),
        ([Found((1.0, 0.0), (*RIGHT, *WRONG)), *3 * [Found((1.0, 0.0), RIGHT)]], {"auc_ci95"}),
        ([Found((1.0, 0.0), (*RIGHT, *WRONG)), *3 * [Found((1.0, 0.0), POOR)]], set()),
    ],
    ids=["all right", "all missed", "no fit", "all told apart", "some of each"],
)
def test_what_cannot_be_told_is_null_and_said(
    found: list[Found],
    nulls: set[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(circles, "labelled", lambda _: (None, found))
    monkeypatch.setattr(circles, "look", lambda _, one: one)
    monkeypatch.setattr(circles, "ProcessPoolExecutor", ThreadPoolExecutor)
    file = tmp_path / "numbers.json"
    monkeypatch.setattr("sys.argv", ["circles", "set", "--json", str(file)])
    circles.main()
    numbers = json.loads(file.read_text(), parse_constant=pytest.fail)
    (row,) = numbers.pop("sets")
    said = numbers | row
    assert nulls == {
        key
        for key in ("auc", "auc_ci95", "median_px", "bias_px")
        if said.get(key) is None and key in said
    }
    printed = capsys.readouterr().out
    assert "nan" not in printed
    assert ("nothing shows how well" in printed) == ("auc" in nulls)


def test_few_presses_have_no_interval_nor_have_those_that_leave_no_doubt() -> None:
    fits = ((0.9, True), (0.1, False), (0.5, True), (0.6, False))
    assert interval([Found(None, fits), Found(None, fits[:3])]) is None
    assert interval(3 * [Found(None, fits[:1])]) is None  # nothing wrong
    assert interval(3 * [Found(None, fits[:2])]) is None  # nothing in doubt
    assert interval([*2 * [Found(None, fits)], Found(None, fits[:3])]) is not None


def test_the_interval_holds_the_area_and_narrows_with_presses() -> None:
    rng = np.random.default_rng(0)
    found = [
        Found(None, ((rng.normal(1.0), True), (rng.normal(0.0), False), (rng.normal(0.0), False)))
        for _ in range(160)
    ]
    width = {}
    for count in (20, 160):
        low, high = interval(found[:count])
        width[count] = high - low
        area = area_under_curve([x for one in found[:count] for x in one.fits])
        assert low < area < high < 1
        assert (1 - low) * (1 - high) == pytest.approx((1 - area) ** 2)  # ratios of what it lacks
    assert width[160] == pytest.approx(width[20] / np.sqrt(8), rel=0.5)
