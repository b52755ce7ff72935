# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What picamera2 is told: every automatic off, one sensor mode, names that libcamera knows."""

import threading
import time
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from firmware_pi.camera import REPORTED, PiCamera, camera_controls, steady_tuning
from firmware_pi.settings import Settings
from sensor.errors import WedgeError

LIBCAMERA = tomllib.loads((Path(__file__).parent / "libcamera.toml").read_text())
FakePi = Callable[..., Any]


class Taken:
    """Takes frames until there are enough."""

    def __init__(self, enough: int) -> None:
        self.frames: list[tuple[bytes, int]] = []
        self._enough, self._full = enough, threading.Event()

    def __call__(self, jpeg: bytes, sensor_timestamp_ns: int) -> None:
        self.frames.append((jpeg, sensor_timestamp_ns))
        if len(self.frames) >= self._enough:
            self._full.set()

    def wait(self) -> None:
        assert self._full.wait(10)


def take(settings: Settings, frames: int = 5) -> tuple[Taken, dict[str, Any]]:
    taken = Taken(frames)
    camera = PiCamera(settings, taken)
    taken.wait()
    report = camera.report()
    camera.stop()
    return taken, report


@pytest.mark.parametrize("words", ["zero", "five"])
def test_everything_automatic_is_off_and_the_mode_is_pinned(fake_pi: FakePi, words: str) -> None:
    pi = fake_pi(words)
    settings = Settings(rate_hz=50.0, exposure_us=7000, red_gain=1.25, blue_gain=1.75)
    take(settings)
    (camera,) = pi.opened
    configuration = camera.camera_configuration()
    assert configuration["sensor"] == {"output_size": (640, 480), "bit_depth": 10}
    told = configuration["controls"]
    assert told["AeEnable"] is False
    assert told["AwbEnable"] is False
    assert told["ExposureTime"] == 7000
    assert told["ColourGains"] == (1.25, 1.75)
    assert told["FrameDurationLimits"] == (20_000, 20_000)
    assert told["NoiseReductionMode"] == LIBCAMERA["enumerations"]["NoiseReductionModeEnum"]["Off"]
    assert camera.closed


def test_a_small_picture_is_read_in_the_same_mode(fake_pi: FakePi) -> None:
    pi = fake_pi()
    take(Settings(width_px=320, height_px=240))
    configuration = pi.opened[0].camera_configuration()
    assert configuration["main"]["size"] == (320, 240)
    assert configuration["sensor"]["output_size"] == (640, 480)


def test_colours_are_a_jpegs_not_a_videos(fake_pi: FakePi) -> None:
    pi = fake_pi()
    take(Settings())
    assert pi.opened[0].camera_configuration()["colour_space"] == "sYCC"


def test_a_pi_5_encodes_in_software_and_the_others_in_hardware(fake_pi: FakePi) -> None:
    pi = fake_pi("zero")
    _, report = take(Settings(megabits_per_s=10.0))
    assert report["encodes_in"] == "hardware"
    assert pi.opened[0].encoder.asked == {"bitrate": 10_000_000}
    pi = fake_pi("five")
    _, report = take(Settings(jpeg_quality=91))
    assert report["encodes_in"] == "software"
    assert pi.opened[0].encoder.asked == {"q": 91}


def test_frames_have_the_sensors_time(fake_pi: FakePi) -> None:
    fake_pi()
    before_ns = time.clock_gettime_ns(time.CLOCK_BOOTTIME)
    taken, _ = take(Settings(), frames=5)
    after_ns = time.clock_gettime_ns(time.CLOCK_BOOTTIME)
    times = [stamp for _, stamp in taken.frames]
    assert times == sorted(set(times))
    assert before_ns // 1000 * 1000 <= times[0]
    assert times[-1] <= after_ns
    assert all(jpeg.startswith(b"\xff\xd8") for jpeg, _ in taken.frames)


def test_the_report_says_what_was_used_not_what_was_asked(fake_pi: FakePi) -> None:
    fake_pi()
    _, report = take(Settings(exposure_us=5000))
    assert report["ExposureTime"] == 4997
    assert report["model"] == "ov5647"


def test_the_colours_do_not_follow_the_picture(fake_pi: FakePi) -> None:
    pi = fake_pi()
    take(Settings())
    tuned = {key: x for part in pi.opened[0].tuning["algorithms"] for key, x in part.items()}
    assert tuned["rpi.contrast"]["ce_enable"] == 0
    assert tuned["rpi.alsc"]["n_iter"] == 0
    assert tuned["rpi.contrast"]["gamma_curve"] == [0, 0, 65535, 65535]
    assert tuned["rpi.alsc"]["luminance_strength"] == 0.5


def test_a_tuning_of_the_older_form_is_steadied_too_and_the_given_one_is_left() -> None:
    given = {"rpi.contrast": {"ce_enable": 1}, "rpi.alsc": {}, "rpi.awb": {"bayes": 1}}
    steady = steady_tuning(given)
    assert steady["rpi.contrast"]["ce_enable"] == 0
    assert steady["rpi.alsc"]["n_iter"] == 0
    assert steady["rpi.awb"] == {"bayes": 1}
    assert given["rpi.contrast"]["ce_enable"] == 1


def test_two_sensors_keep_step_where_libcamera_can(fake_pi: FakePi) -> None:
    pi = fake_pi(sync=True)
    take(Settings(sync="server"))
    take(Settings(sync="client"))
    modes = [camera.camera_configuration()["controls"]["SyncMode"].name for camera in pi.opened]
    assert modes == ["Server", "Client"]


def test_a_camera_is_found_by_its_id_however_many_are_left(fake_pi: FakePi) -> None:
    fake_pi("two")
    first, second = (take(Settings(camera=number))[1]["id"] for number in (0, 1))
    assert first != second
    for words, there in (("two", (first, second)), ("two first-gone", (second,))):
        pi = fake_pi(words)
        for number in (0, 1):
            for one in (first, second):
                settings = Settings(camera=number, camera_id=one)
                if one in there:
                    assert take(settings)[1]["id"] == one == pi.opened[-1].id
                else:
                    with pytest.raises(WedgeError, match=f"camera_id = {one}, .*{second}"):
                        PiCamera(settings, Taken(1))


@pytest.mark.parametrize(
    ("words", "settings", "says"),
    [
        ("none", Settings(), "sees 0"),
        ("zero", Settings(camera=1), "camera = 1, .* sees 1"),
        ("busy", Settings(), "resource busy"),
        ("hd", Settings(), "OV5647"),
        ("imx219", Settings(), "imx219, and this server is for the OV5647"),
        ("untuned", Settings(), r"Tuning file not found.*install\.sh"),
        ("zero", Settings(sync="server"), "newer libcamera"),
        ("zero unfit", Settings(), "Invalid camera configuration"),
        ("zero stuck", Settings(), "did not start properly"),
    ],
)
def test_a_camera_that_will_not_do_is_one_sentence(
    fake_pi: FakePi, words: str, settings: Settings, says: str
) -> None:
    pi = fake_pi(words)
    with pytest.raises(WedgeError, match=says):
        PiCamera(settings, Taken(1))
    assert all(camera.closed for camera in pi.opened)


def test_a_camera_that_does_not_stop_is_let_go_of_and_told_in_a_sentence(fake_pi: FakePi) -> None:
    pi = fake_pi("clings")
    camera = PiCamera(Settings(), Taken(1))
    with pytest.raises(WedgeError, match="does not stop"):
        camera.stop()
    assert pi.opened[-1].closed


def test_without_picamera2_it_says_what_to_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "libcamera", None)
    with pytest.raises(WedgeError, match=r"install\.sh"):
        PiCamera(Settings(), Taken(1))


@pytest.mark.parametrize("lacks", ["a name", "an argument"])
def test_an_old_picamera2_is_to_be_upgraded(
    fake_pi: FakePi, monkeypatch: pytest.MonkeyPatch, lacks: str
) -> None:
    pi = fake_pi()
    if lacks == "a name":
        from picamera2 import encoders

        monkeypatch.delattr(encoders, "LibavMjpegEncoder")
    else:

        def without_sensor(self: Any, main: Any, buffer_count: int, controls: Any) -> None:
            pass

        monkeypatch.setattr(pi, "create_video_configuration", without_sensor)
    with pytest.raises(WedgeError, match=r"too old .*--only-upgrade python3-picamera2"):
        PiCamera(Settings(), Taken(1))
    assert all(camera.closed for camera in pi.opened)


def test_every_control_and_report_has_libcameras_name_and_kind(fake_pi: FakePi) -> None:
    fake_pi()
    from libcamera import controls

    kinds = {"Bool": bool, "Integer32": int, "Integer64": int, "Float": float}
    known = LIBCAMERA["controls"] | LIBCAMERA["draft"]
    for name, value in camera_controls(Settings(), controls).items():
        for item in value if isinstance(value, tuple) else (value,):
            assert isinstance(item, kinds[known[name]]), name
    assert set(REPORTED) <= set(known)
