# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The Pi's camera through picamera2: one pinned sensor mode, everything automatic switched off."""

import copy
import time
from collections.abc import Callable, Sequence
from typing import Any

from firmware_pi.settings import NOISE_REDUCTIONS, SYNCS, Settings
from sensor.errors import WedgeError

Take = Callable[[bytes, int], None]
"""Takes a JPEG and the time at which its first row was read, ns since the Pi was switched on."""

MODEL = "ov5647"
SENSOR_MODE_PX = (640, 480)
"""The OV5647's fast mode, which sees 98.8 % of the sensor's width. The narrower 1080p mode would
shift and scale the picture, and so silently undo the unwarp of a calibrated unit."""
SENSOR_BITS = 10
BUFFERS = 4
REPORTED = ("ExposureTime", "AnalogueGain", "DigitalGain", "ColourGains", "FrameDuration")
"""Metadata of a frame: what the camera used, which need not be what it was asked for."""
REPORT_EVERY_NS = 1_000_000_000


class PiCamera:
    """A camera of this Pi that hands over each frame as a JPEG, from a thread of its own.

    Args:
        settings: What to tell it.
        take: Called with each frame.

    Raises:
        WedgeError: picamera2 is not installed, or the camera is absent, busy, of another kind or
            does not start.
    """

    def __init__(self, settings: Settings, take: Take) -> None:
        try:
            from libcamera import ColorSpace, controls
            from picamera2 import Picamera2
            from picamera2.encoders import JpegEncoder, LibavMjpegEncoder, MJPEGEncoder
            from picamera2.outputs import Output
        except ModuleNotFoundError as error:
            raise WedgeError(
                f"the Pi's camera needs {error.name}: run firmware_pi/install.sh on the Pi."
            ) from error
        except ImportError as error:
            raise _too_old(error) from error

        called = settings.camera_called
        seen = Picamera2.global_camera_info()
        number = camera_number(settings, [str(one["Id"]) for one in seen])
        self.model, self.id = str(seen[number]["Model"]), str(seen[number]["Id"])
        if self.model != MODEL:  # others have a mode of this size too, but not of this view
            raise WedgeError(
                f"camera {called} is an {self.model}, and this server is for the OV5647: "
                "connect one, or set another camera."
            )
        try:
            tuning = steady_tuning(Picamera2.load_tuning_file(f"{MODEL}.json"))
        except RuntimeError as error:
            raise WedgeError(
                f"the {MODEL}'s tuning cannot be read ({error}): run firmware_pi/install.sh on the "
                "Pi."
            ) from error
        try:
            self._camera = Picamera2(number, tuning=tuning)
        except RuntimeError as error:
            raise WedgeError(
                f"camera {called} cannot be opened ({error}): stop the program that uses it."
            ) from error

        # picamera2 names the software encoder MJPEGEncoder where there is no hardware for it.
        self.encodes_in_hardware = MJPEGEncoder is not LibavMjpegEncoder
        if self.encodes_in_hardware:
            encoder = MJPEGEncoder(bitrate=round(settings.megabits_per_s * 1e6))
        else:
            encoder = JpegEncoder(q=settings.jpeg_quality)

        class ToTake(Output):  # type: ignore[misc, unused-ignore]
            def outputframe(self, frame: bytes, _keyframe: bool, timestamp: int, *_: Any) -> None:
                # picamera2 counts microseconds from the first frame that it encodes.
                take(bytes(frame), (encoder.firsttimestamp + timestamp) * 1000)

        self._metadata: dict[str, Any] = {}
        self._noted_ns = 0
        try:
            self._camera.configure(
                self._camera.create_video_configuration(
                    main={"size": (settings.width_px, settings.height_px), "format": "YUV420"},
                    sensor={"output_size": SENSOR_MODE_PX, "bit_depth": SENSOR_BITS},
                    # What a JPEG is read as; a video's colours would begin at 16 and end at 235.
                    colour_space=ColorSpace.Sycc(),
                    buffer_count=BUFFERS,
                    controls=camera_controls(settings, controls),
                )
            )
            self._refuse_other_mode()
            self._camera.post_callback = self._note
            self._camera.start_recording(encoder, ToTake())
        except BaseException as error:
            self._camera.close()
            if isinstance(error, RuntimeError):  # what picamera2 raises where libcamera refuses
                raise WedgeError(
                    f"camera {called} does not start ({error}): check the settings and "
                    "its ribbon's contacts."
                ) from error
            if isinstance(error, TypeError):  # an argument that it does not know
                raise _too_old(error) from error
            raise

    def report(self) -> dict[str, Any]:
        """What the camera is and what it used for a frame of the last second or two."""
        return {
            "model": self.model,
            "id": self.id,
            "encodes_in": "hardware" if self.encodes_in_hardware else "software",
            **{key: self._metadata[key] for key in REPORTED if key in self._metadata},
        }

    def stop(self) -> None:
        """Stop the camera and let others use it.

        Raises:
            WedgeError: it does not stop; it is let go of all the same.
        """
        try:
            self._camera.stop_recording()
        except RuntimeError as error:
            raise WedgeError(f"the camera does not stop ({error}): check its ribbon.") from error
        finally:
            self._camera.close()

    def _refuse_other_mode(self) -> None:
        chosen = self._camera.camera_configuration()["sensor"]
        if tuple(chosen["output_size"]) != SENSOR_MODE_PX:
            raise WedgeError(
                f"the camera ({self.model}) reads {chosen['output_size']} instead of "
                f"{SENSOR_MODE_PX}: this server is for the OV5647."
            )

    def _note(self, request: Any) -> None:
        now_ns = time.monotonic_ns()
        if now_ns - self._noted_ns > REPORT_EVERY_NS:
            self._noted_ns = now_ns
            self._metadata = dict(request.get_metadata())


def _too_old(error: Exception) -> WedgeError:
    """What to do where picamera2 lacks a name or an argument, in a sentence."""
    return WedgeError(
        f"this Pi's picamera2 is too old ({error}): upgrade it by `sudo apt update && sudo apt "
        "install --only-upgrade python3-picamera2`."
    )


def camera_number(settings: Settings, ids: Sequence[str]) -> int:
    """Which of the cameras that a Pi sees is meant.

    They are counted again at each start of the Pi: without the first one, the second is number 0.

    Args:
        settings: The camera by its id or, where that is empty, by its number.
        ids: Of the cameras that are seen, in libcamera's words, by number.

    Raises:
        WedgeError: it is not seen.
    """
    if settings.camera_id in ids:
        return ids.index(settings.camera_id)
    if settings.camera_id or settings.camera >= len(ids):
        key = "camera_id" if settings.camera_id else "camera"
        raise WedgeError(
            f"{key} = {settings.camera_called}, but the Pi sees {len(ids)} cameras "
            f"({', '.join(ids) or 'none'}): check the ribbon's contacts, and what "
            "`rpicam-hello --list-cameras` says."
        )
    return settings.camera


def camera_controls(settings: Settings, controls: Any) -> dict[str, Any]:
    """What libcamera is told.

    Args:
        settings: What to tell.
        controls: ``libcamera.controls``, for its enumerations.

    Raises:
        WedgeError: the settings ask for sync, which this libcamera does not know.
    """
    reduction = NOISE_REDUCTIONS[settings.noise_reduction]
    told = {
        "AeEnable": False,
        "ExposureTime": settings.exposure_us,
        "AnalogueGain": settings.analogue_gain,
        "AwbEnable": False,
        "ColourGains": (settings.red_gain, settings.blue_gain),
        "FrameDurationLimits": (settings.frame_duration_us, settings.frame_duration_us),
        "NoiseReductionMode": getattr(controls.draft.NoiseReductionModeEnum, reduction),
        "Sharpness": 0.0,  # it would draw halos around a contact
    }
    if settings.sync != "off":
        if not hasattr(getattr(controls, "rpi", None), "SyncModeEnum"):
            raise WedgeError(
                f'sync = "{settings.sync}" needs a newer libcamera than this Pi has: update it, '
                'or set sync = "off" and pair frames by their time.'
            )
        told["SyncMode"] = getattr(controls.rpi.SyncModeEnum, SYNCS[settings.sync])
    return told


def steady_tuning(tuning: dict[str, Any]) -> dict[str, Any]:
    """A camera's tuning without what would change the colours with what touches the gel.

    Two parts of the Pi's image processing follow the picture itself and have no control:
    ``rpi.contrast`` bends the gamma curve by the histogram, ``rpi.alsc`` corrects the shading by
    the colours that it sees (src/ipa/rpi/controller/rpi/{contrast,alsc}.cpp in libcamera). Their
    fixed parts stay.
    """
    steady = copy.deepcopy(tuning)
    algorithms: list[dict[str, Any]] = steady.get("algorithms", [steady])
    for algorithm in algorithms:
        if "rpi.contrast" in algorithm:
            algorithm["rpi.contrast"]["ce_enable"] = 0
        if "rpi.alsc" in algorithm:
            algorithm["rpi.alsc"]["n_iter"] = 0
    return steady
