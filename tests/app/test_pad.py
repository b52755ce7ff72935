# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A pad that was measured beside that of the design which somebody names."""

import pytest

from app._importing import _scale_words
from app._pad import (
    NOTED,
    OTHER_PAD,
    assumed_pad_mm,
    pad_remark,
    proportion_remark,
    refuse_other_pad,
)
from recon.geometry.caliper import Scale
from sensor.dataset import DatasetCard
from sensor.design import FINGER, STANDARD
from sensor.errors import WedgeError
from tests.synthetic import KEYSTONE_PX


def pad(along_x, along_y):
    length, width = STANDARD.pad_size_mm
    return length * along_x, width * along_y


@pytest.mark.parametrize("side_mm", [0.9, 1000.0])
def test_a_length_that_no_pad_has_is_refused_by_both_bounds(side_mm):
    with pytest.raises(WedgeError, match=r"two lengths of at least 1 and below 1000 mm\.$"):
        assumed_pad_mm(None, (20.0, side_mm))
    assert assumed_pad_mm(None, (1.0, 999.0)) == (1.0, 999.0)


@pytest.mark.parametrize("share", [1 - OTHER_PAD - 0.01, 1 + OTHER_PAD + 0.01])
@pytest.mark.parametrize("along", [0, 1])
def test_a_pad_of_another_size_along_either_side_is_refused(share, along):
    shares = (share, 1.0) if along == 0 else (1.0, share)
    with pytest.raises(WedgeError, match=r"^here has a pad of .*own design, or mend it\.$"):
        refuse_other_pad(pad(*shares), STANDARD, "here", "mend it")


@pytest.mark.parametrize("share", [1 - NOTED - 0.01, 1 + NOTED + 0.01])
@pytest.mark.parametrize("along", [0, 1])
def test_a_pad_that_is_not_quite_the_designs_is_said_with_both_sizes(share, along):
    shares = (share, 1.0) if along == 0 else (1.0, share)
    refuse_other_pad(pad(*shares), STANDARD, "here")
    said = pad_remark(pad(*shares), STANDARD)
    assert f"{pad(*shares)[along]:.4g}" in said and "34 x 25.5 mm" in said


def test_nothing_is_said_of_a_pad_like_the_designs_or_where_one_is_unknown():
    for shares in ((1.04, 0.96), (1.0, 1.0)):
        assert not pad_remark(pad(*shares), STANDARD)
    for measured, design in ((None, FINGER), (pad(1, 1), None), (None, None)):
        refuse_other_pad(measured, design, "here")
        assert not pad_remark(measured, design)


def test_an_axis_that_a_caliper_could_not_measure_is_said():
    assert not proportion_remark(None)
    assert "along x: the caliper measured y alone, and x follows" in proportion_remark("x")
    assert "along y: the caliper measured x alone, and y follows" in proportion_remark("y")


@pytest.mark.parametrize("corners_px", [None, KEYSTONE_PX])
def test_no_doubt_is_said_of_an_axis_that_was_not_measured(corners_px):
    pad_mm = None if corners_px is None else (12.0, 9.0)
    card = DatasetCard(
        name="here",
        source="test",
        licence="CC0",
        mm_per_px=(0.1, 0.1),
        ball_radius_mm=2.4,
        background=("background.png",),
        corners_px=corners_px,
        pad_size_mm=pad_mm,
    )
    for unseen, doubts in ((None, 2), ("x", 1), ("y", 1)):
        pitch = {"mm_per_px": (0.1, 0.1), "sigma_mm_per_px": (0.001, 0.001)}
        words = _scale_words(card, Scale(**pitch, gaps=2, unseen=unseen), 3)
        assert words.startswith("Scale from 2 of 3 pictures")
        assert words.count(" ± ") == doubts
        assert ("mm long and" in words) == (pad_mm is not None)
