# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Measures in closed form, and settings that settle on a camera that is simulated."""

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from firmware_pi.settings import Settings
from firmware_pi.tuning import BRIGHTEST, FRAME_SHARE, LINEAR, measure_blank, pad_mask, tune
from sensor.errors import WedgeError

Image = NDArray[np.uint8]


def flat(*rgb: int, height: int = 8, width: int = 6) -> Image:
    return np.broadcast_to(np.array(rgb, np.uint8), (height, width, 3)).copy()


def test_a_steady_flat_frame_is_its_own_measure() -> None:
    blank = measure_blank([flat(50, 100, 150)] * 4)
    assert blank.mean == pytest.approx(LINEAR[[50, 100, 150]], rel=1e-6)
    assert blank.brightest == pytest.approx(LINEAR[[50, 100, 150]], rel=1e-6)
    assert blank.saturated == (0, 0, 0)
    assert (blank.flicker, blank.banding, blank.drift) == pytest.approx((0, 0, 0), abs=1e-6)


def test_flicker_is_the_rms_over_the_mean() -> None:
    low, high = LINEAR[[100, 120]].astype(float)
    frames = [flat(100, 90, 90), flat(120, 90, 90), flat(120, 90, 90), flat(100, 90, 90)]
    blank = measure_blank(frames)
    assert blank.flicker == pytest.approx((high - low) / (high + low), rel=1e-5)
    assert blank.banding == pytest.approx(0, abs=1e-6)
    assert blank.drift == pytest.approx(0, abs=1e-6)


def test_moving_bands_are_not_flicker() -> None:
    low, high = LINEAR[[100, 120]].astype(float)
    rows = np.arange(16) // 4 % 2
    frames = [
        np.where(((rows + k) % 2 == 0)[:, None, None], flat(100, 100, 100, height=16), 120).astype(
            np.uint8
        )
        for k in (0, 1, 1, 0)
    ]
    blank = measure_blank(frames)
    assert blank.banding == pytest.approx((high - low) / (high + low), rel=1e-5)
    assert blank.flicker == pytest.approx(0, abs=1e-6)


def test_shading_that_stands_still_is_neither() -> None:
    ramp = np.repeat(np.linspace(40, 200, 16).astype(np.uint8)[:, None], 6, 1)
    blank = measure_blank([np.dstack([ramp, ramp, ramp])] * 3)
    assert (blank.flicker, blank.banding) == pytest.approx((0, 0), abs=1e-6)


def test_drift_is_the_line_through_the_means() -> None:
    codes = [100, 104, 109, 113, 118]
    blank = measure_blank([flat(90, 90, code) for code in codes])
    light = LINEAR[codes].astype(float)
    slope = np.polyfit(np.arange(5), light, 1)[0]
    assert blank.drift == pytest.approx(4 * slope / light.mean(), rel=1e-5)
    assert blank.flicker is not None
    assert blank.flicker < blank.drift / 20


def test_saturation_is_counted_where_the_pad_is() -> None:
    image = flat(100, 100, 100, height=10, width=10)
    image[:2] = 255
    pad = np.zeros((10, 10), bool)
    pad[:4] = True
    assert measure_blank([image]).saturated == pytest.approx((0.2, 0.2, 0.2))
    assert measure_blank([image], pad).saturated == pytest.approx((0.5, 0.5, 0.5))
    assert measure_blank([image], ~pad).mean == pytest.approx(LINEAR[[100] * 3], rel=1e-6)


@pytest.mark.parametrize("turn", [1, -1])
def test_the_pad_is_what_lies_within_its_corners(turn: int) -> None:
    corners = [(2, 1), (7, 1), (7, 5), (2, 5)][::turn]
    mask = pad_mask(corners, 8, 10)
    expected = np.zeros((8, 10), bool)
    expected[1:6, 2:8] = True
    assert np.array_equal(mask, expected)


def test_fewer_than_three_frames_tell_no_flicker() -> None:
    blank = measure_blank([flat(90, 90, 90)] * 2)
    assert (blank.flicker, blank.banding, blank.drift) == (None, None, None)


@pytest.mark.parametrize(
    ("images", "pad", "says"),
    [
        ([], None, "no frame"),
        ([flat(9, 9, 9), flat(9, 9, 9, height=9)], None, "one size"),
        ([flat(9, 9, 9)], np.ones((3, 3), bool), "one size"),
        ([flat(9, 9, 9)], np.zeros((8, 6), bool), "outside"),
    ],
)
def test_what_cannot_be_measured_is_one_sentence(
    images: list[Image], pad: NDArray[np.bool_] | None, says: str
) -> None:
    with pytest.raises(WedgeError, match=says):
        measure_blank(images, pad)


class Camera:
    """A gel lit from three sides; the camera's curve is not the one that tuning believes in."""

    def __init__(self, lights: tuple[float, float, float], power: float) -> None:
        across, down = np.meshgrid(np.linspace(0.6, 1, 40), np.linspace(0.7, 1, 30))
        shades = np.dstack([across, down, across[:, ::-1]])
        self._light = shades * np.array(lights) / 10_000
        self._power = power

    def __call__(self, settings: Settings) -> Image:
        gains = np.array([settings.red_gain, 1.0, settings.blue_gain])
        light = self._light * gains * settings.exposure_us * settings.analogue_gain
        return (np.clip(light, 0, 1) ** (1 / self._power) * 255).round().astype(np.uint8)


LIGHT = st.floats(0.05, 0.6)


@given(LIGHT, LIGHT, LIGHT, st.floats(1.8, 2.4), st.floats(1, 16))
@settings(max_examples=40)
@example(0.05, 0.3, 0.05, 2.2, 16.0)
def test_tuning_settles_on_a_grey_gel_of_the_right_brightness(
    red: float, green: float, blue: float, power: float, gain: float
) -> None:
    camera = Camera((red, green, blue), power)
    now = Settings(analogue_gain=gain)
    for _ in range(8):
        tuned = tune(now, measure_blank([camera(now)]))
        if tuned.settled:
            break
        now = tuned.settings
    assert tuned.settled
    blank = measure_blank([camera(tuned.settings)])
    free = [0, 1, 2] if not any("resistor" in remark for remark in tuned.remarks) else []
    if free:
        assert np.ptp(blank.mean) < 0.05 * max(blank.mean)
    assert max(blank.brightest) == pytest.approx(BRIGHTEST, rel=0.08)
    assert tuned.settings.exposure_us <= FRAME_SHARE * 1e6 / now.rate_hz


def test_the_exposure_is_spent_before_the_gain() -> None:
    dim = Camera((0.1, 0.1, 0.1), 2.2)
    settings_now = tune(Settings(exposure_us=1000), measure_blank([dim(Settings())])).settings
    bright = Camera((0.4, 0.4, 0.4), 2.2)
    assert tune(Settings(), measure_blank([bright(Settings())])).settings.analogue_gain == 1
    assert settings_now.exposure_us < FRAME_SHARE * 1e6 / settings_now.rate_hz
    darker = Camera((0.05, 0.05, 0.05), 2.2)
    spent = tune(Settings(rate_hz=90.0), measure_blank([darker(Settings())])).settings
    assert spent.exposure_us == pytest.approx(FRAME_SHARE * 1e6 / 90, abs=1)
    assert spent.analogue_gain > 1


@pytest.mark.parametrize(
    ("code", "exposure_us", "gain", "says"),
    [(240, 30, 1.0, "too bright .* lower"), (40, 16_896, 16.0, "too dark .* raise")],
)
def test_a_brightness_out_of_reach_is_never_settled(
    code: int, exposure_us: int, gain: float, says: str
) -> None:
    now = Settings(exposure_us=exposure_us, analogue_gain=gain)
    tuned = tune(now, measure_blank([flat(code, code, code)]))
    assert tuned.settings == now  # nothing is left to change
    assert not tuned.settled
    (remark,) = tuned.remarks
    assert re.search(says, remark)
    times = max(LINEAR[code] / BRIGHTEST, BRIGHTEST / LINEAR[code])
    assert f"{times:.1f} times" in remark


def test_what_the_settings_cannot_mend_is_said() -> None:
    def said(lights: tuple[float, float, float], start: Settings) -> str:
        return " ".join(tune(start, measure_blank([Camera(lights, 2.2)(start)])).remarks)

    assert "resistor of the red" in said((0.5, 0.1, 0.1), Settings(red_gain=1.0, blue_gain=1.0))
    assert "resistor of the blue" in said((0.3, 0.3, 0.01), Settings(blue_gain=1.0))
    assert "too dark" in said((0.001, 0.001, 0.001), Settings(rate_hz=90.0, analogue_gain=16.0))
    assert "saturated" in said((0.9, 0.9, 0.9), Settings(analogue_gain=16.0))
    steady, other = flat(100, 100, 100), flat(104, 104, 104)
    flickers = tune(Settings(), measure_blank([steady, other, other, steady])).remarks
    assert any("flickers" in remark for remark in flickers)
    with pytest.raises(WedgeError, match="both gains"):
        tune(Settings(), measure_blank([flat(0, 100, 0)]))


def test_the_colour_that_its_gain_makes_the_brightest_is_not_cut() -> None:
    now = Settings(red_gain=1.0, blue_gain=1.0, exposure_us=4000, analogue_gain=1.0)
    blank = measure_blank([flat(100, 100, 100)])
    brightest = (0.3, 0.4, 0.4)  # red's after its gain: 0.6
    blank = replace(blank, mean=(0.1, 0.2, 0.2), brightest=brightest)
    new = tune(now, blank).settings
    raised = new.exposure_us * new.analogue_gain / (now.exposure_us * now.analogue_gain)
    after = [new.red_gain * raised, raised, new.blue_gain * raised]
    assert max(np.multiply(brightest, after)) == pytest.approx(BRIGHTEST, rel=1e-3)


def test_a_slow_rate_lends_no_more_exposure_than_the_camera_takes() -> None:
    slow = Settings(rate_hz=5.0, exposure_us=60_000, analogue_gain=1.0)
    new = tune(slow, measure_blank([flat(100, 100, 100)])).settings
    assert new.exposure_us == 66_666
    assert new.analogue_gain > 1
