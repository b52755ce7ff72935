# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A wrong ball is noticed where anything can notice it: by its contacts' width, by another ball."""

from dataclasses import replace

import numpy as np
import pytest

from recon.labels.ball_size import answer_to_lean, doubtful_ball, refuse_wrong_ball
from recon.presses import read_presses
from sensor.dataset import BallLabel
from sensor.errors import WedgeError
from tests import synthetic
from tests.synthetic import make_dataset

RADIUS_MM, OTHER_MM = 2.2, 2.8


@pytest.fixture(scope="module")
def balls(tmp_path_factory):
    """Presses of two balls on one sensor, contacts of 1 to 1.8 mm."""
    patch = pytest.MonkeyPatch()
    found = []
    for radius_mm in (RADIUS_MM, OTHER_MM):
        patch.setattr(synthetic, "BALL_RADIUS_MM", radius_mm)
        folder = tmp_path_factory.mktemp("balls") / "set"
        found.append(read_presses(make_dataset(folder, presses=8)).presses)
    patch.undo()
    return found


def wide_label():
    return BallLabel(file="a.png", center_x_px=60.0, center_y_px=45.0, contact_radius_px=20.0)


def stated(presses, radius_mm):
    return [replace(press, ball_radius_mm=radius_mm) for press in presses]


def test_right_radii_raise_no_doubt(balls):
    one, other = balls
    assert doubtful_ball(one) is None
    assert doubtful_ball([*one, *other]) is None
    assert answer_to_lean(one) == pytest.approx(answer_to_lean(other), rel=0.1)


@pytest.mark.parametrize("which", [0, 1])
def test_a_diameter_given_as_the_radius_is_always_noticed(balls, which):
    radius_mm = (RADIUS_MM, OTHER_MM)[which]
    sentence = doubtful_ball(stated(balls[which], 2 * radius_mm))
    assert sentence is not None
    assert "diameter" in sentence
    assert f"{2 * radius_mm:g} mm" in sentence and "is mm_per_px right?" in sentence


@pytest.mark.parametrize("times", [0.7, 1.35])
def test_two_balls_tell_that_one_radius_is_too_small_or_too_large(balls, times):
    one, other = balls
    sentence = doubtful_ball([*stated(one, times * RADIUS_MM), *other])
    assert sentence is not None
    assert "one of the two radii is wrong" in sentence


def test_one_ball_alone_cannot_tell_its_own_radius(balls):
    """Any radius explains one ball's presses as well, all slopes scaled: so nothing is said."""
    one, _ = balls
    assert doubtful_ball(stated(one, 1.3 * RADIUS_MM)) is None


def test_what_dots_hide_does_not_count(balls):
    (press, *_), _ = balls
    hidden = np.random.default_rng(0).random(press.difference.shape[:2]) < 0.2
    dotted = np.where(hidden[..., None], np.float32(-0.4), press.difference)
    seen = answer_to_lean([replace(press, hidden=hidden)])
    assert answer_to_lean([replace(press, difference=dotted, hidden=hidden)]) == seen
    assert seen == pytest.approx(answer_to_lean([press]), rel=0.02)


@pytest.mark.parametrize("mm_per_px", [(0.05, 0.2), (0.1, 0.1), (0.2, 0.05)])
def test_contacts_as_wide_as_their_ball_are_refused_whatever_the_pixels(mm_per_px, tmp_path):
    """A circle of radius 20 px covers as much gel as one of 2 mm."""
    card = replace(make_dataset(tmp_path / "set", presses=1).card, mm_per_px=mm_per_px)
    labels = [
        BallLabel(file=f"{i}.png", center_x_px=60.0, center_y_px=45.0, contact_radius_px=20.0)
        for i in range(3)
    ]
    refuse_wrong_ball(labels, replace(card, ball_radius_mm=2.5))
    with pytest.raises(WedgeError, match=r"2\.00 mm at 0\.1 mm/px"):
        refuse_wrong_ball(labels, replace(card, ball_radius_mm=2.0))


def test_each_contact_is_as_wide_as_its_own_ball_and_most_must_be(tmp_path):
    card = replace(make_dataset(tmp_path / "set", presses=1).card, ball_radius_mm=2.0)
    wide = wide_label()
    narrow, of_its_own = replace(wide, contact_radius_px=10.0), replace(wide, ball_radius_mm=4.0)
    refuse_wrong_ball([of_its_own, of_its_own, wide], card)
    refuse_wrong_ball([narrow, narrow, wide], card)
    for labels in ([narrow, wide, wide], [of_its_own, wide, wide]):
        with pytest.raises(WedgeError, match="as wide as the ball of radius 2 mm"):
            refuse_wrong_ball(labels, card)


def test_contacts_that_are_specks_on_their_ball_are_refused_by_the_widest(tmp_path):
    """As where the scale is in metres or the ball's radius in micrometres."""
    card = make_dataset(tmp_path / "set", presses=1).card
    pitch_mm, label = card.mm_per_px[0], wide_label()
    speck = replace(label, contact_radius_px=0.049 * card.ball_radius_mm / pitch_mm)
    wider = replace(label, contact_radius_px=0.051 * card.ball_radius_mm / pitch_mm)
    refuse_wrong_ball([speck, speck, wider], card)
    refuse_wrong_ball([], card)
    with pytest.raises(WedgeError, match=r"reaches 0\.049 of its .* are ball_radius_mm and mm_per"):
        refuse_wrong_ball([speck, speck], card)
    metres = replace(card, mm_per_px=(pitch_mm / 1000, pitch_mm / 1000))
    with pytest.raises(WedgeError, match=f"{pitch_mm / 1000:g} mm/px"):
        refuse_wrong_ball([label], metres)
