# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Only good presses are taken from a stream, each once."""

import cv2
import numpy as np
import pytest

from recon.contact.disturbed import STRANGE
from recon.geometry.unwarp import prepare_unwarp
from recon.labels.capture import (
    AGAIN,
    BLANK_FRAMES,
    STILL_FRAMES,
    TOUCHED,
    PressWatcher,
    Verdict,
)
from tests.shading import AZIMUTHS_DEG, as_frame, pressed

SIZE_PX = (160, 120)
BALL_PX = 30.0
BLANK = np.zeros((120, 160, 3), np.float32)


def watcher(lights_deg: dict[str, float] | None = None) -> PressWatcher:
    unwarp = prepare_unwarp(SIZE_PX, None, None, None)
    return PressWatcher(unwarp, 3.0, (0.1, 0.1), lights_deg=lights_deg)


def noisy(difference: np.ndarray, seed: int) -> np.ndarray:
    noise = np.random.default_rng(seed).normal(0, 0.008, difference.shape)
    return as_frame(difference + noise)


def press(x_px: float = 80.0, y_px: float = 60.0) -> np.ndarray:
    return pressed(SIZE_PX, (x_px, y_px), 18.0, BALL_PX, noise=0.0)


def jaws() -> np.ndarray:
    """Edges of two jaws that face each other."""
    edges = BLANK.copy()
    edges[20:100, 55:60] += np.float32([0.2, -0.2, 0.0])
    edges[20:100, 100:105] -= np.float32([0.2, -0.2, 0.0])
    return edges


def shown(watch: PressWatcher, difference: np.ndarray, times: int, seed: int = 0) -> list[Verdict]:
    return [watch.look(noisy(difference, 100 * seed + i)) for i in range(times)]


def ready() -> PressWatcher:
    watch = watcher()
    shown(watch, BLANK, BLANK_FRAMES)
    assert watch.background is not None
    return watch


@pytest.mark.parametrize("step_px", [1.5, 12.0])
def test_steady_motion_is_no_blank_gel(step_px: float) -> None:
    watch = watcher()
    for i in range(BLANK_FRAMES):
        assert "known" not in watch.look(noisy(press(30.0 + step_px * i), i)).words
    assert watch.background is None
    shown(watch, BLANK, 2 * BLANK_FRAMES)
    assert watch.background is not None
    assert np.abs(watch.background - 127.5).mean() < 1


def test_each_still_press_is_taken_once_where_it_is() -> None:
    watch = ready()
    taken = []
    for seed, place in enumerate([(40.0, 40.0), (120.0, 80.0)], start=1):
        taken += [v for v in shown(watch, press(*place), 8, seed) if v.taken]
        assert taken[-1].circle is not None
        assert np.hypot(*np.subtract(taken[-1].circle.center_px, place)) < 1
        assert (
            f"lift it, then press the ball, next at: {watch.coverage.next_place}" in taken[-1].words
        )
        shown(watch, BLANK, 2, 50 + seed)
    assert len(taken) == 2
    assert watch.coverage.counts.sum() == 2
    assert watch.coverage.counts[1, 1] == watch.coverage.counts[2, 3] == 1
    assert str(watch.coverage) == "[..... .1... ...1. .....]"


@pytest.mark.parametrize("calipers", [0, 1])
def test_who_has_but_files_is_told_of_nothing_to_do(calipers: int) -> None:
    watch = PressWatcher(prepare_unwarp(SIZE_PX, None, None, None), 3.0, (0.1, 0.1), calipers)
    watch.set_background(noisy(BLANK, 0))
    frames = [press(), jaws(), press(40.0)] if calipers else [press(), press(40.0)]
    told = [watch.judge_alone(noisy(frame, i)) for i, frame in enumerate(frames, 1)]
    assert [verdict.taken for verdict in told] == ([False, True, True] if calipers else [True] * 2)
    assert not any(word in x.words for x in told for word in ("lift", "next", "press "))


def test_after_the_corners_are_turned_presses_count_where_they_lie_now() -> None:
    watch, (width, height) = ready(), SIZE_PX
    shown(watch, press(40.0, 40.0), 8, 1)
    shown(watch, BLANK, 2, 51)
    right, bottom = width - 0.5, height - 0.5
    turned = ((right, bottom), (-0.5, bottom), (-0.5, -0.5), (right, -0.5))
    watch.look_through(prepare_unwarp(SIZE_PX, turned, SIZE_PX), 3.0, (0.1, 0.1))
    (taken,) = (v for v in shown(watch, press(120.0, 80.0), 8, 2) if v.taken)
    assert taken.circle is not None
    for middle_px, raw_px in zip(
        (*watch.coverage.centers_px, taken.circle.center_px),
        ((40.0, 40.0), (120.0, 80.0), (120.0, 80.0)),
        strict=True,
    ):
        assert np.hypot(*np.subtract(middle_px, np.subtract((width - 1, height - 1), raw_px))) < 1.5
    assert watch.coverage.counts.sum() == 2
    assert watch.coverage.counts[2, 3] == watch.coverage.counts[1, 1] == 1


def test_the_first_presses_are_the_calipers_where_one_was_asked_for() -> None:
    watch = PressWatcher(prepare_unwarp(SIZE_PX, None, None, None), 3.0, (0.1, 0.1), calipers=1)
    assert "caliper" in shown(watch, BLANK, BLANK_FRAMES)[-1].words
    balls = shown(watch, press(), STILL_FRAMES + 2, 4)
    assert not any(verdict.taken for verdict in balls)
    assert any("a ball, not the caliper: press the caliper's jaws" in v.words for v in balls)
    shown(watch, BLANK, 2, 5)
    first = [v for v in shown(watch, jaws(), STILL_FRAMES + 2, 1) if v.taken]
    assert [verdict.circle for verdict in first] == [None]
    assert watch.coverage.counts.sum() == 0
    assert "press the ball" in shown(watch, BLANK, 2, 2)[-1].words
    second = [v for v in shown(watch, press(), STILL_FRAMES + 2, 3) if v.taken]
    assert len(second) == 1
    assert second[0].circle is not None


def test_a_moving_ball_waits_until_it_holds_still() -> None:
    watch = ready()
    moving = [watch.look(noisy(press(40 + 4 * i), i)) for i in range(10)]
    assert not any(verdict.taken for verdict in moving)
    assert any("moving" in verdict.words for verdict in moving)
    held = shown(watch, press(80), STILL_FRAMES + 1, 3)
    assert sum(verdict.taken for verdict in held) == 1


def test_a_ball_that_creeps_does_not_hold_still() -> None:
    """Frames then differ by some 2.5 times the blank gel's noise."""
    watch = ready()
    creeping = [watch.look(noisy(press(60 + 0.7 * i), i)) for i in range(10)]
    assert not any(verdict.taken for verdict in creeping)
    assert {verdict.words for verdict in creeping} == {"still moving: hold it"}


def test_a_blank_frame_that_comes_twice_does_not_make_noise_look_like_motion() -> None:
    watch = watcher()
    for seed in (0, 0, *range(1, BLANK_FRAMES - 1)):
        watch.look(noisy(BLANK, seed))
    assert watch.background is not None
    assert any(verdict.taken for verdict in shown(watch, press(), STILL_FRAMES + 1, 3))


def test_a_touch_before_the_gel_is_known_begins_it_anew() -> None:
    watch = watcher()
    shown(watch, BLANK, BLANK_FRAMES - 2)
    assert "moving" in shown(watch, press(), 1, 2)[-1].words
    assert watch.background is None
    shown(watch, BLANK, 1, 3)
    shown(watch, BLANK, BLANK_FRAMES + 1, 4)
    assert watch.background is not None
    assert abs(watch.background.mean() - 127.5) < 1


@pytest.mark.parametrize("held", [press(50.0), press(45.0) + press(110.0)], ids=["one", "two"])
def test_a_held_touch_is_no_blank_gel_where_the_lights_are_known(held: np.ndarray) -> None:
    watch = watcher(AZIMUTHS_DEG)
    assert "known" in shown(watch, held, BLANK_FRAMES)[-1].words
    assert "no contact" in shown(watch, held, 3, 1)[-1].words
    free = shown(watch, BLANK, STILL_FRAMES + BLANK_FRAMES + 1, 2)
    assert any(TOUCHED in verdict.words and "anew" in verdict.words for verdict in free)
    assert not any(verdict.taken for verdict in free)
    assert watch.background is not None and np.abs(watch.background - 127.5).mean() < 1
    (taken,) = (v for v in shown(watch, press(110.0), STILL_FRAMES + 2, 3) if v.taken)
    assert taken.circle is not None
    assert np.hypot(*np.subtract(taken.circle.center_px, (110.0, 60.0))) < 1


def test_gel_that_stands_out_after_the_first_press_is_said_and_not_taken() -> None:
    watch = watcher(AZIMUTHS_DEG)
    shown(watch, BLANK, BLANK_FRAMES)
    assert any(verdict.taken for verdict in shown(watch, press(), STILL_FRAMES + 1, 1))
    shown(watch, BLANK, 2, 2)
    raised = shown(watch, -press(40.0), STILL_FRAMES + 1, 3)
    assert not any(verdict.taken for verdict in raised)
    assert AGAIN in {verdict.words for verdict in raised}


def test_a_picture_of_the_blank_gel_on_which_something_touches_is_refused() -> None:
    watch = watcher(AZIMUTHS_DEG)
    watch.set_background(noisy(press(50.0), 0))
    verdict = watch.judge_alone(noisy(BLANK, 1))
    assert not verdict.taken and "give another" in verdict.words


def test_without_known_lights_a_held_touch_shows_beside_the_next_one() -> None:
    watch = watcher()
    shown(watch, press(40.0), BLANK_FRAMES)
    assert any(verdict.taken for verdict in shown(watch, BLANK, STILL_FRAMES + 1, 1))
    assert "lift it" in shown(watch, BLANK, 2, 2)[-1].words
    assert AGAIN in shown(watch, press(120.0), 1, 3)[-1].words
    watch = ready()
    assert any(verdict.taken for verdict in shown(watch, press(40.0), STILL_FRAMES + 1, 4))
    moved = [shown(watch, press(40.0 + 8 * i), 1, 10 + i)[0].words for i in range(10)]
    assert not any(AGAIN in words for words in moved)  # one ball, which was not lifted


def test_blank_frames_are_never_taken() -> None:
    assert not any(verdict.taken for verdict in shown(ready(), BLANK, 30, 7))


def test_a_picture_that_comes_twice_is_no_second_press() -> None:
    watch = watcher()
    watch.set_background(noisy(BLANK, 0))
    once, other = noisy(press(), 1), noisy(press(60.0), 2)
    assert watch.judge_alone(once).taken
    again = watch.judge_alone(once.copy())
    assert not again.taken and "same picture" in again.words
    assert len(watch.coverage.centers_px) == 1
    assert watch.judge_alone(other).taken
    assert len(watch.coverage.centers_px) == 2


def test_blurred_and_saturated_presses_are_refused_with_a_reason() -> None:
    watch = ready()
    blurred = [cv2.GaussianBlur(noisy(press(), i), (0, 0), 2) for i in range(STILL_FRAMES + 2)]
    verdicts = [watch.look(frame) for frame in blurred]
    assert not any(verdict.taken for verdict in verdicts)
    assert any("blurred" in verdict.words for verdict in verdicts)
    watch = ready()
    bright = [
        np.maximum(noisy(press(), i), 254 * (np.abs(press()) > 0.03).astype(np.uint8))
        for i in range(STILL_FRAMES + 2)
    ]
    verdicts = [watch.look(frame) for frame in bright]
    assert not any(verdict.taken for verdict in verdicts)
    assert any("saturated" in verdict.words for verdict in verdicts)


def test_a_frame_without_light_is_not_said_to_be_blurred() -> None:
    watch = watcher()
    watch.set_background(noisy(BLANK, 0))
    verdict = watch.judge_alone(np.zeros_like(noisy(BLANK, 0)))
    assert not verdict.taken and verdict.words == f"{STRANGE}: are the lights on?"
