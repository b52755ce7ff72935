# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Pixels that are far from square, or do not fit the pad, are said; what is proposed mends them."""

import re
from dataclasses import replace

import pytest

from app._pitch import pitch_remarks
from recon.presses import read_presses
from sensor.dataset import read_dataset, write_card
from tests.app.commands import run
from tests.synthetic import BALL_RADIUS_MM, KEYSTONE_PX, MM_PER_PX, make_dataset


@pytest.fixture(scope="module")
def dataset(tmp_path_factory):
    return make_dataset(tmp_path_factory.mktemp("pitch") / "set", presses=5)


def stating(dataset, mm_per_px, pad_size_mm=None):
    corners_px = None if pad_size_mm is None else KEYSTONE_PX
    card = replace(
        dataset.card, mm_per_px=mm_per_px, pad_size_mm=pad_size_mm, corners_px=corners_px
    )
    return replace(dataset, card=card)


@pytest.mark.parametrize("shape", [1.21, 1 / 1.21, 2.0, 0.5])
def test_pixels_that_are_far_from_square_are_said(dataset, shape):
    (said,) = pitch_remarks(stating(dataset, (0.05, 0.05 * shape)))
    assert "far from square" in said and "resize the frames" in said
    assert "errors of depth" in said and "fine shapes" not in said  # balls suffer as much
    (said,) = pitch_remarks(stating(dataset, (0.05, 0.05 * shape), (6.0, 5.0 * shape)))
    assert "one number twice" in said and f"`wedge label {dataset.folder}`" in said


@pytest.mark.parametrize("pitch_mm", [(0.06, 0.096), (0.2, 0.05)])
def test_it_is_said_how_many_mm_a_radius_counts_there(dataset, pitch_mm):
    oblong = stating(dataset, pitch_mm)
    (said,) = pitch_remarks(oblong)
    counted_mm = float(re.search(r"contact_radius_px .* = (\S+) mm\.$", said)[1])
    press = replace(read_presses(dataset).presses[0], mm_per_px=pitch_mm)
    assert press.contact_radius_mm == pytest.approx(press.contact_radius_px * counted_mm, rel=1e-3)
    narrow, wide = (
        replace(dataset.labels[0], contact_radius_px=share * BALL_RADIUS_MM / counted_mm)
        for share in (0.99, 1.01)
    )
    assert oblong.is_within_ball(narrow) and not oblong.is_within_ball(wide)


@pytest.mark.parametrize("shape", [1.0, 1.19, 1 / 1.19])
def test_nothing_is_said_of_pixels_that_are_nearly_square(dataset, shape):
    assert pitch_remarks(stating(dataset, (0.05, 0.05 * shape))) == []


@pytest.mark.parametrize(
    ("pad_size_mm", "pitch_mm", "off"),
    [((13.0, 9.4), 0.15, "0.5 %"), ((5.0, 4.0), 0.3, "2.6 %"), ((9.4, 13.0), 0.15, "0.5 %")],
)
def test_a_pitch_is_proposed_that_the_pad_is_a_whole_number_of(dataset, pad_size_mm, pitch_mm, off):
    rounded = stating(dataset, (pitch_mm, pitch_mm), pad_size_mm)
    (said,) = pitch_remarks(rounded)
    assert off in said
    x, y = map(float, re.search(r"mm_per_px = \[(\S+), (\S+)\]", said).groups())
    mended = stating(dataset, (x, y), pad_size_mm)
    assert mended.card.unwarped_size_px == rounded.card.unwarped_size_px  # circles stay in place
    for pixels, pitch, side in zip(mended.card.unwarped_size_px, (x, y), pad_size_mm, strict=True):
        assert pixels * pitch == pytest.approx(side, rel=1e-5)
    assert pitch_remarks(mended) == []


def test_a_pitch_that_is_off_by_less_than_a_caliper_is_passed_over(dataset):
    assert pitch_remarks(stating(dataset, (0.11, 0.11), (35.0, 25.5))) == []


def test_calibrate_says_it(dataset, tmp_path, capsys):
    x, y = MM_PER_PX
    write_card(dataset.folder / "dataset.toml", replace(dataset.card, mm_per_px=(x, 1.3 * y)))
    words = ["calibrate", str(dataset.folder), "--out", str(tmp_path / "u"), "--estimator", "table"]
    assert run(*words) == 0
    (said,) = pitch_remarks(read_dataset(dataset.folder))
    assert said in capsys.readouterr().out.splitlines()
