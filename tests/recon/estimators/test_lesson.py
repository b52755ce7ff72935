# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the default estimator learns from, and what it says of its own errors."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from recon.ball import offsets_mm
from recon.estimators import default_fit, fit_estimator, gradient_field, training_pixels
from recon.estimators.default import (
    MEMBERS,
    MEMBERS_OF_FEW,
    SLOPE_KNOTS,
    normal_of,
)
from recon.estimators.default_fit import (
    OTHER_SIZES,
    RENDERED,
    RENDERED_BESIDE_FEW,
    UNLIKE,
    collar_of,
    with_some_collars,
)
from recon.estimators.elsewhere import COVERED, MOST, UNTOLD, here_and_elsewhere, times_elsewhere
from recon.estimators.lean import FLAT
from recon.estimators.lesson import (
    DEEP_FLAT_FROM,
    DEEPEST,
    FEW,
    FLAT_FROM,
    PIXELS,
    PIXELS_OF_FEW,
    elastic_fade,
    fit_elastic,
)
from recon.estimators.rendered import SeenPixels
from recon.estimators.surroundings import ASPECTS
from recon.pixels import BallPress, join, label_pixels
from recon.presses import read_presses
from tests.synthetic import make_dataset

MM_PER_PX = (0.1, 0.1)
BALL_MM = 4.0
TRUE_MM = 1.5


def elastic_press(labelled_mm: float, stretch: float = 1.0) -> BallPress:
    """A ball in an elastic gel under three far lights, its circle labelled with some radius.

    The gel rises ``stretch`` times as fast as a half-space.
    """
    x_mm, y_mm = offsets_mm((160, 140), (82.3, 71.4), MM_PER_PX)
    distance = np.hypot(x_mm, y_mm)
    inside = np.minimum(distance, TRUE_MM)
    beyond = stretch * np.maximum(distance / TRUE_MM - 1, 0)
    slope = inside / np.sqrt(BALL_MM**2 - inside**2) * elastic_fade(1 + beyond)
    outward = np.stack([x_mm, y_mm], -1) / np.maximum(distance, 1e-9)[..., None]
    gradient = (-outward * slope[..., None]).astype(np.float32)
    normal = normal_of(gradient.reshape(-1, 2)).reshape(gradient.shape)
    azimuth = np.radians([90, 180, -90])
    lights = np.stack([np.cos(azimuth), np.sin(azimuth)])
    return BallPress(
        file="press.png",
        difference=(-0.4 * normal @ lights).astype(np.float32),
        center_px=(82.3, 71.4),
        contact_radius_px=labelled_mm / MM_PER_PX[0],
        ball_radius_mm=BALL_MM,
        mm_per_px=MM_PER_PX,
    )


@cache
def lessons(presses):
    """What the default estimator is taught by so many presses, all alike."""
    press = elastic_press(TRUE_MM)
    return join([training_pixels("default", press, k, 0, presses) for k in range(presses)])


def test_the_gel_leaves_the_ball_with_its_slope_and_fades_as_the_square_far_away():
    ratio = np.array([0.5, 1.0, 100.0])
    inside, rim, far = elastic_fade(ratio)
    assert inside == rim == pytest.approx(1.0)
    assert far == pytest.approx(4 / (3 * np.pi) / 100.0**2, rel=1e-3)
    assert (np.diff(elastic_fade(np.linspace(1, 9, 200))) < 0).all()


@pytest.mark.parametrize("share", [0.85, 1.0, 1.2])
def test_a_circle_drawn_too_wide_or_too_small_is_mended(share):
    found = fit_elastic(elastic_press(share * TRUE_MM))
    assert found.radius_mm == pytest.approx(TRUE_MM, rel=0.03)
    assert found.stretch == pytest.approx(1, rel=0.15)


def test_a_contact_too_deep_for_the_half_space_keeps_its_label_and_teaches_no_collar():
    press = replace(elastic_press(TRUE_MM), ball_radius_mm=1.1 * TRUE_MM)
    assert fit_elastic(press).stretch is None
    pixels = training_pixels("default", press, 0, 0, 1)
    assert (pixels.gradient[~pixels.contact] == 0).all()


@pytest.mark.parametrize("stretch", [1.0, 2.5])
def test_the_collar_is_a_share_of_the_frame_and_told_by_the_median_press(stretch):
    pixels = [training_pixels("default", elastic_press(share * TRUE_MM, stretch), k, 0, 1)
              for k, share in enumerate((0.9, 1.0, 1.1))]  # fmt: skip
    # A half-space rises on the contact's own radius; the frame is 16 by 14 mm.
    assert collar_of(join(pixels)) == pytest.approx(TRUE_MM / stretch / 14.0, rel=0.2)
    assert np.isnan(collar_of(join(pixels[:2])))
    deep = replace(elastic_press(TRUE_MM), ball_radius_mm=1.1 * TRUE_MM)
    untold = training_pixels("default", deep, 3, 0, 1)
    assert np.isnan(untold.collar).all()
    assert collar_of(join([*pixels, untold])) == collar_of(join(pixels))


def test_rendered_pixels_are_drawn_by_the_collar_that_the_balls_tell(monkeypatch):
    class EnoughError(Exception):
        pass

    def drawn(taught, light, collar, count, seed):
        raise EnoughError(collar)

    monkeypatch.setattr("recon.estimators.default_fit.rendered_pixels", drawn)
    pixels = lessons(3)
    with pytest.raises(EnoughError) as told:
        fit_estimator("default", pixels, "RGB", 0)
    assert told.value.args == (collar_of(pixels),)


def rendered_of(count: int) -> SeenPixels:
    """So many pixels, all ones."""
    columns = dict(zip(SeenPixels.__annotations__, (3, 3 * ASPECTS, 2, 2), strict=True))
    return SeenPixels(**{name: np.ones((count, n), np.float32) for name, n in columns.items()})


@pytest.mark.parametrize(
    ("unexplained", "share"), [(0.0, 0.0), (UNLIKE / 2, 0.25), (UNLIKE, 1), (1.0, 1)]
)
@pytest.mark.parametrize(
    ("presses", "copies", "for_one"), [(3, 1 + MOST, RENDERED_BESIDE_FEW), (FEW + 1, 1, RENDERED)]
)
def test_the_less_a_light_is_like_a_rendered_one_the_more_of_its_own_collars_are_taught(
    monkeypatch, unexplained, share, presses, copies, for_one
):
    """Contacts and still gel always, of few presses several times."""
    rendered, learnt = [], []

    def drawn(taught, light, collar, count, seed):
        rendered.append(count)
        return rendered_of(0), unexplained

    def trained(inputs, wanted, taught, *_):
        learnt.append(wanted[taught[-2]])  # by one of those who learn from everything
        raise InterruptedError

    monkeypatch.setattr("recon.estimators.default_fit.rendered_pixels", drawn)
    monkeypatch.setattr("recon.estimators.default_training.train", trained)
    pixels = lessons(presses)
    with pytest.raises(InterruptedError):
        fit_estimator("default", pixels, "RGB", 0)
    still = ~pixels.gradient.any(1)
    collars = len(pixels) - pixels.contact.sum() - still.sum()
    assert len(learnt[0]) == copies * (len(pixels) - collars + round(share * collars))
    assert (~learnt[0].any(1)).sum() == copies * still.sum()
    # As many rendered pixels as ever take the place of what is left out.
    assert rendered == [round(for_one * copies * len(pixels))]


@pytest.mark.parametrize(
    ("presses", "covered", "number", "here_alone"),
    [
        (5, 0.9 * COVERED, MEMBERS_OF_FEW, 0),
        (5, COVERED, MEMBERS_OF_FEW, MEMBERS_OF_FEW // 2),
        (FEW + 1, COVERED, MEMBERS, 0),
    ],
)
def test_of_the_networks_one_leaves_a_third_out_and_some_all_that_is_elsewhere(
    monkeypatch, presses, covered, number, here_alone
):
    taught = []

    def trained(inputs, wanted, chosen, *_):
        taught.extend(chosen)
        raise InterruptedError

    monkeypatch.setattr(
        "recon.estimators.default_fit.rendered_pixels", lambda *_: (rendered_of(6), 1.0)
    )
    monkeypatch.setattr("recon.estimators.default_training.train", trained)
    monkeypatch.setattr("recon.estimators.default_fit.covered_by", lambda _: covered)
    strengths = []

    def moved_by(*given):
        strengths.extend(given[4].tolist())
        return here_and_elsewhere(*given)

    monkeypatch.setattr("recon.estimators.default_fit.here_and_elsewhere", moved_by)
    pixels = lessons(presses)
    with pytest.raises(InterruptedError):
        fit_estimator("default", pixels, "RGB", 0)
    *members, last = [set(chosen.tolist()) for chosen in taught]
    times = times_elsewhere(presses)
    assert (times > 0) == (presses <= FEW)
    ways = 1 if here_alone else len(UNTOLD)
    assert strengths == [strength for strength in UNTOLD[:ways] for _ in range(times)]
    copies = 1 + times * ways
    press = np.tile(pixels.press, copies)  # elsewhere they are left out as well
    rendered = set(range(len(press), len(press) + 6))  # which come last
    pressed = set(range(len(pixels)))
    # Of the rendered, too, who learns from a part of the balls' pixels learns from as small a part.
    here = [pressed | set(sorted(rendered)[one :: 1 + times]) for one in range(here_alone)]
    at = len(pixels) * (1 + times * np.arange(ways + 1))
    moved = [set(range(a, b)) for a, b in pairwise(at)]
    turns = [pressed | moved[turn % ways] | rendered for turn in range(number - here_alone)]
    assert members == [*here, *turns]
    unseen = {len(press), len(press) + 3}
    assert turns[0] - last == turns[0] & (unseen | set(np.flatnonzero(press % 3 == 0).tolist()))
    assert last < turns[0]
    # The error is measured where balls were pressed, not where they are thought to be elsewhere.
    told = default_fit._told(pixels, "RGB", 0)
    pressed = set(np.flatnonzero(pixels.press % 3 == 0).tolist())
    assert set(told.measured.tolist()) == unseen | pressed


def test_half_of_the_balls_are_taught_as_of_other_sizes_in_nothing_but_what_lies_around(
    monkeypatch,
):
    learnt = []

    def trained(inputs, wanted, chosen, *_):
        learnt.append((inputs, wanted))
        raise InterruptedError

    def told(sizes):
        monkeypatch.setattr("recon.estimators.default_fit.OTHER_SIZES", sizes)
        with pytest.raises(InterruptedError):
            fit_estimator("default", pixels, "RGB", 0)
        return learnt.pop()

    monkeypatch.setattr(
        "recon.estimators.default_fit.rendered_pixels", lambda *_: (rendered_of(7), 1.0)
    )
    monkeypatch.setattr("recon.estimators.default_training.train", trained)
    pixels = lessons(3)
    (inputs, wanted), (own, same) = told(OTHER_SIZES), told((1.0, 1.0))
    np.testing.assert_array_equal(wanted, same)
    np.testing.assert_array_equal(inputs[-7:], own[-7:])  # rendered things stay as they are
    around = slice(-3 * ASPECTS, None)
    beside = np.s_[: -3 * ASPECTS]
    np.testing.assert_array_equal(inputs[:, beside], own[:, beside])
    changed = (inputs[:, around] != own[:, around]).any(1)[:-7]
    assert changed.mean() == pytest.approx(0.5, abs=0.05)


def test_some_collars_are_drawn_by_the_seed_and_from_all_presses():
    pixels = lessons(3)
    one, again, other = (with_some_collars(pixels, 0.3, seed) for seed in (0, 0, 1))
    np.testing.assert_array_equal(one, again)
    assert not np.array_equal(one, other) and len(np.unique(one)) == len(one)
    left_out = np.setdiff1d(np.arange(len(pixels)), one)
    assert not pixels.contact[left_out].any() and pixels.gradient[left_out].any(1).all()
    assert set(pixels.press[left_out]) == {0, 1, 2}


def test_contact_has_the_balls_slope_the_collar_its_own_and_what_is_far_away_none():
    press = elastic_press(TRUE_MM)
    pixels = training_pixels("default", press, 0, 0, FEW + 1)
    x_mm, y_mm = offsets_mm(press.size_px, press.center_px, MM_PER_PX)
    away = np.hypot(x_mm, y_mm).ravel()[pixels.place]
    steep = np.linalg.norm(pixels.gradient, axis=1)
    inside, flat = pixels.contact, ~pixels.contact & (steep == 0)
    collar = ~inside & ~flat
    assert inside.any() and flat.any() and collar.sum() == PIXELS
    assert away[inside].max() < 1.05 * TRUE_MM and away[flat].min() > 0.9 * FLAT_FROM * TRUE_MM
    rim = TRUE_MM / np.sqrt(BALL_MM**2 - TRUE_MM**2)
    fading = rim * elastic_fade(away[collar] / TRUE_MM)
    np.testing.assert_allclose(steep[collar], fading, atol=0.03 * rim)
    np.testing.assert_allclose(
        steep[inside], away[inside] / np.sqrt(BALL_MM**2 - away[inside] ** 2), rtol=1e-5
    )


def test_each_of_few_presses_teaches_more_of_its_contact_its_collar_and_still_gel():
    coarse = elastic_press(TRUE_MM)
    press = replace(
        coarse,
        difference=coarse.difference.repeat(4, 0).repeat(4, 1),
        center_px=(4 * 82.3 + 1.5, 4 * 71.4 + 1.5),
        contact_radius_px=4 * coarse.contact_radius_px,
        mm_per_px=(MM_PER_PX[0] / 4, MM_PER_PX[1] / 4),
    )
    few, many = (training_pixels("default", press, 0, 0, presses) for presses in (FEW, FEW + 1))
    for pixels, most in ((few, PIXELS_OF_FEW), (many, PIXELS)):
        still = (~pixels.gradient.any(1)).sum()
        assert pixels.contact.sum() == still == most and len(pixels) == 3 * most
        assert len(np.unique(pixels.place)) == len(pixels)  # none is taught twice


def test_gel_beside_a_ball_pressed_deep_is_flat_sooner():
    press = elastic_press(1.1 * DEEPEST * BALL_MM)
    pixels = training_pixels("default", press, 0, 0, 1)
    x_mm, y_mm = offsets_mm(press.size_px, press.center_px, MM_PER_PX)
    away = np.hypot(x_mm, y_mm).ravel()[pixels.place]
    flat = ~pixels.contact
    assert np.isnan(pixels.collar).all() and not pixels.gradient[flat].any()
    assert away[flat].min() == pytest.approx(DEEP_FLAT_FROM * press.contact_radius_mm, rel=0.05)


@pytest.mark.parametrize("half_side_px", [26, 21, 15])
def test_nothing_beside_a_ball_that_fills_the_frame_is_called_flat_while_it_is_steep(half_side_px):
    whole = elastic_press(TRUE_MM)
    rows, columns = (slice(c - half_side_px, c + half_side_px) for c in (71, 82))
    center_px = (82.3 - columns.start, 71.4 - rows.start)
    press = replace(whole, difference=whole.difference[rows, columns], center_px=center_px)
    pixels = training_pixels("default", press, 0, 0, FEW + 1)
    assert len(np.unique(pixels.place)) == len(pixels)
    x_mm, y_mm = offsets_mm(press.size_px, press.center_px, MM_PER_PX)
    away = np.hypot(x_mm, y_mm).ravel()
    flat = ~pixels.contact & ~pixels.gradient.any(1)
    nearest_mm = 0.95 * DEEP_FLAT_FROM * TRUE_MM
    assert flat.any() == (away.max() > nearest_mm)
    assert (away[pixels.place[flat]] > nearest_mm).all()


@pytest.mark.parametrize("share", [1.0, 1.1 * DEEPEST * BALL_MM / TRUE_MM])
def test_how_deep_a_ball_goes_is_told_by_its_fitted_circle(share):
    press = elastic_press(share * TRUE_MM)
    cap = training_pixels("default", press, 0, 0, 1).cap
    radius_mm = fit_elastic(press).radius_mm
    rim_mm = np.sqrt(BALL_MM**2 - radius_mm**2)
    np.testing.assert_allclose(cap, (BALL_MM - rim_mm) / 14.0, rtol=5e-3)  # the shorter side


def test_most_unseen_truths_lie_in_their_interval_and_few_in_a_fifth_of_it(tmp_path, monkeypatch):
    pytest.importorskip("torch")
    from recon.estimators import default_training

    monkeypatch.setattr(default_training, "STEPS", 400)
    monkeypatch.setattr(default_training, "BATCH", 128)
    presses = read_presses(make_dataset(tmp_path / "set", presses=48)).presses
    # Noise of the labels is what the interval must know of beside that of the camera.
    taught = [
        replace(press, center_px=(press.center_px[0] + shift, press.center_px[1]))
        for press, shift in zip(presses, np.random.default_rng(3).normal(0, 1.0, 48), strict=True)
    ]
    train = join(
        [training_pixels("default", press, i, 0, 24) for i, press in enumerate(taught[:24])]
    )
    estimator = fit_estimator("default", train, "RGB", 0)
    covered = {1.0: [], 0.2: []}
    for index, press in enumerate(taught[24:]):  # judged by circles as rough as those
        field = gradient_field(estimator, press.difference)
        pixels = label_pixels(press, index, 0)
        found = field.reshape(-1, 2)[pixels.place]
        for share, kept in covered.items():
            within = np.abs(found - pixels.gradient) <= share * estimator.half_width(found)
            kept.append(within[pixels.contact].mean())
    assert np.mean(covered[1.0]) >= 0.85
    assert np.mean(covered[0.2]) < 0.85  # and it is not merely wide


@pytest.mark.parametrize(("others", "steep"), [(4000, 0.4), (0, 0.05)])
def test_how_wrong_steep_slopes_are_is_told_by_what_shows_them(monkeypatch, others, steep):
    """By balls up to their steepest, then by rendered things, then as at the nearest gentler."""
    random = np.random.default_rng(0)
    steepness = np.concatenate([random.uniform(0, 1, 3000), random.uniform(0, 1.9, others)])
    azimuth = random.uniform(0, 2 * np.pi, len(steepness))
    read = np.float32(steepness[:, None] * np.stack([np.cos(azimuth), np.sin(azimuth)], 1))
    of_balls = np.arange(len(read)) < 3000
    off = np.where(of_balls, 0.05, 0.4)[:, None] * random.standard_normal(read.shape)
    unseen = random.random(len(read)) < 0.5
    told = default_fit._Told(
        light=np.zeros((6, 3), np.float32),
        gel=np.zeros_like(FLAT),
        mean=np.zeros(2, np.float32),
        spread=np.ones(2, np.float32),
        inputs=read,
        slopes=np.float32(read + off),
        of_balls=of_balls,
        unseen=unseen,
        measured=np.flatnonzero(unseen),
        measured_inputs=read[unseen],
        times=0,
        ways=1,
        members=MEMBERS,
        unlike=None,
        here_alone=0,
    )
    monkeypatch.setattr(default_fit, "answers", lambda _layers, _member, rows: normal_of(rows))
    table = default_fit._measured_error90(told, ()).mean(1) / 1.645
    gentle = SLOPE_KNOTS <= 1
    np.testing.assert_allclose(table[gentle], 0.05, rtol=0.25)
    np.testing.assert_allclose(table[~gentle], steep, rtol=0.25)
    *every, last = default_fit._choices(told)
    assert all(len(one) == len(read) for one in every) and not unseen[last].any()
