# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Stands in for picamera2 0.3: as strict about names as libcamera, and quicker than any camera.

``FAKE_PI`` says what stands where: words of zero, five, none, two (cameras of a Pi 5, of which
first-gone leaves the second one), imx219 (another camera), untuned
(without a tuning file), busy, hd, silent, unfit (not to be configured), stuck (not to be
started), clings (not to be stopped), second where that holds for the second one alone, and later
where it holds from the second one on.
"""

import copy
import io
import os
import threading
import time

from libcamera import NAMES
from PIL import Image

from picamera2.encoders import JpegEncoder

RATE_HZ = 200.0
BUSES = ("/base/axi/pcie@1000120000/rp1/i2c@88000", "/base/axi/pcie@1000120000/rp1/i2c@80000")


def words() -> list[str]:
    return os.environ.get("FAKE_PI", "zero").split()


def refuses(word: str) -> bool:
    if word not in words():
        return False
    number = len(Picamera2.opened)
    return number == 2 if "second" in words() else number >= 2 if "later" in words() else True


class Request:
    def __init__(self, metadata: dict) -> None:
        self._metadata = metadata

    def get_metadata(self) -> dict:
        return self._metadata


class Picamera2:
    """One camera; ``opened`` holds every one that was made."""

    opened: list = []  # noqa: RUF012
    TUNING = {  # noqa: RUF012
        "version": 2.0,
        "algorithms": [
            {"rpi.black_level": {"black_level": 1024}},
            {"rpi.alsc": {"n_iter": 100, "luminance_strength": 0.5}},
            {"rpi.contrast": {"ce_enable": 1, "gamma_curve": [0, 0, 65535, 65535]}},
        ],
    }

    @staticmethod
    def global_camera_info() -> list[dict]:
        model = "imx219" if "imx219" in words() else "ov5647"
        first, second = ([{"Model": model, "Id": f"{on}/{model}@36"}] for on in BUSES)
        if "none" in words():
            return []
        return second if "first-gone" in words() else first + second * ("two" in words())

    @staticmethod
    def load_tuning_file(name: str) -> dict:
        if "untuned" in words():
            raise RuntimeError("Tuning file not found")
        return copy.deepcopy(Picamera2.TUNING)

    def __init__(self, camera_num: int = 0, tuning: dict | None = None) -> None:
        if "busy" in words():
            raise RuntimeError("Failed to acquire camera: Device or resource busy")
        self.id = self.global_camera_info()[camera_num]["Id"]
        self.tuning = tuning
        self.post_callback = None
        self.closed = False
        self.encoder = None
        self._done = threading.Event()
        Picamera2.opened.append(self)

    def create_video_configuration(
        self, main, sensor, buffer_count, controls, colour_space="SMPTE170M"
    ) -> dict:
        unknown = set(controls) - set(NAMES["controls"]) - set(NAMES["draft"]) - {"SyncMode"}
        if unknown:
            raise RuntimeError(f"Control {unknown} is not advertised by libcamera")
        assert set(main) <= {"size", "format", "preserve_ar"}
        assert set(sensor) <= {"output_size", "bit_depth"}
        return {
            "main": main,
            "sensor": sensor,
            "controls": controls,
            "buffer_count": buffer_count,
            "colour_space": colour_space,
        }

    def configure(self, configuration: dict) -> None:
        if refuses("unfit"):
            raise RuntimeError("Invalid camera configuration")
        self._configuration = copy.deepcopy(configuration)
        if "hd" in words():
            self._configuration["sensor"]["output_size"] = (1920, 1080)

    def camera_configuration(self) -> dict:
        return self._configuration

    def start_recording(self, encoder, output) -> None:
        if refuses("stuck"):
            raise RuntimeError("Camera did not start properly.")
        self.encoder = encoder
        self._thread = threading.Thread(target=self._run, args=(output,), daemon=True)
        if "silent" not in words():
            self._thread.start()

    def _run(self, output) -> None:
        controls = self._configuration["controls"]
        size = self._configuration["main"]["size"]
        jpegs = []
        for level in (80, 120):
            file = io.BytesIO()
            Image.new("RGB", size, (level, level, level)).save(file, "JPEG")
            jpegs.append(file.getvalue())
        count = 0
        while not self._done.wait(1 / RATE_HZ):
            now_us = time.clock_gettime_ns(time.CLOCK_BOOTTIME) // 1000
            if self.encoder.firsttimestamp is None:
                self.encoder.firsttimestamp = now_us
            metadata = {
                "SensorTimestamp": now_us * 1000,
                "ExposureTime": controls["ExposureTime"] - 3,
                "AnalogueGain": controls["AnalogueGain"],
                "ColourGains": controls["ColourGains"],
                "FrameDuration": controls["FrameDurationLimits"][0],
            }
            if self.post_callback:
                self.post_callback(Request(metadata))
            output.outputframe(
                jpegs[count % 2], True, now_us - self.encoder.firsttimestamp, None, False
            )
            count += 1

    def stop_recording(self) -> None:
        assert not self.closed
        self._done.set()
        if self._thread.is_alive():
            self._thread.join()
        if "clings" in words():
            raise RuntimeError("Camera in Stopping state, but trying stop()")

    def close(self) -> None:
        self.closed = True


__all__ = ["JpegEncoder", "Picamera2"]
