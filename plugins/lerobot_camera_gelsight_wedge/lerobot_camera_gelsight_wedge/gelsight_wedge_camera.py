# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The camera itself: the newest frame of a source, by LeRobot's rules."""

import time
from typing import Any

import numpy as np
from lerobot.cameras.camera import Camera
from lerobot.cameras.configs import ColorMode
from lerobot.utils.errors import DeviceAlreadyConnectedError, DeviceNotConnectedError
from numpy.typing import NDArray

from lerobot_camera_gelsight_wedge.config_gelsight_wedge_camera import GelSightWedgeCameraConfig
from recon.stream import Newest, Paced, TimedFrame, open_source
from sensor.errors import WedgeError

FIRST_FRAME_WITHIN_MS = 5000.0


class GelSightWedgeCamera(Camera):  # type: ignore[misc, unused-ignore]
    """A sensor that is read like a camera; a thread keeps its newest frame.

    Args:
        config: Where the frames come from.
    """

    def __init__(self, config: GelSightWedgeCameraConfig) -> None:
        super().__init__(config)
        self.config = config
        self._newest: Newest | None = None
        self._last: TimedFrame | None = None

    def __str__(self) -> str:
        return f"GelSightWedgeCamera({self._newest.source.name if self._newest else 'closed'})"

    @property
    def is_connected(self) -> bool:
        """Whether it was connected and not disconnected since, as LeRobot's own cameras say.

        That holds after a source has ended, too: LeRobot's arms release their motors only if all of
        their cameras are connected.
        """
        return self._newest is not None

    @staticmethod
    def find_cameras() -> list[dict[str, Any]]:
        """None: a sensor on the network is named by its address."""
        return []

    def connect(self, warmup: bool = True) -> None:
        """Open the source and learn the size of its frames.

        Args:
            warmup: As LeRobot's; the first frame is waited for either way, for its size.

        Raises:
            DeviceAlreadyConnectedError: it is connected.
            ConnectionError: nothing is there, no frame comes, or it has another size.
        """
        if self.is_connected:
            raise DeviceAlreadyConnectedError(f"{self} is already connected.")
        try:
            source = open_source(self.config.source)
            self._newest = Newest(source if source.live else Paced(source))
            height, width = self.async_read(FIRST_FRAME_WITHIN_MS).shape[:2]
            if (self.width or width, self.height or height) != (width, height):
                raise WedgeError(
                    f"frames are {width} x {height}, not {self.width} x {self.height}: set the "
                    "camera's width and height to these."
                )
        except (WedgeError, TimeoutError) as error:
            self.disconnect_if_connected()
            raise ConnectionError(str(error)) from error
        self.width, self.height = width, height

    def read(self, color_mode: ColorMode | None = None) -> NDArray[np.uint8]:
        """The newest frame that was not read yet; waits for it.

        Args:
            color_mode: Order of the channels; the configured one by default.

        Returns:
            (height, width, 3).
        """
        return self._image(self._next(FIRST_FRAME_WITHIN_MS), color_mode)

    def async_read(self, timeout_ms: float = 200) -> NDArray[np.uint8]:
        """The newest frame that was not read yet.

        Args:
            timeout_ms: How long to wait for it.

        Raises:
            TimeoutError: none came in time, or the source has ended.
        """
        return self._image(self._next(timeout_ms))

    def read_latest(self, max_age_ms: int = 500) -> NDArray[np.uint8]:
        """The newest frame, read before or not, without waiting.

        Args:
            max_age_ms: How long ago it may have come here; of a file, have been played.

        Raises:
            TimeoutError: there is none so young.
        """
        newest = self._connected()
        frame = newest.take(0.0) or self._last
        if frame is None or 1e3 * (time.monotonic() - newest.came_s) > max_age_ms:
            raise TimeoutError(f"{self} has no frame from the last {max_age_ms} ms.")
        self._last = frame
        return self._image(frame)

    def disconnect(self) -> None:
        """Close the source.

        Raises:
            DeviceNotConnectedError: it is not connected.
        """
        self._connected()
        self.disconnect_if_connected()

    def disconnect_if_connected(self) -> None:
        """Close the source where there is one."""
        if self._newest is not None:
            self._newest.close()
        self._newest = self._last = None

    def _connected(self) -> Newest:
        if self._newest is None:
            raise DeviceNotConnectedError(f"{self} is not connected.")
        return self._newest

    def _next(self, timeout_ms: float) -> TimedFrame:
        newest = self._connected()
        frame = newest.take(timeout_ms / 1000)
        if frame is None:
            late = f"gave no frame within {timeout_ms:.0f} ms"
            raise TimeoutError(f"{self} {'has ended' if newest.ended else late}.")
        self._last = frame
        return frame

    def _image(self, frame: TimedFrame, color_mode: ColorMode | None = None) -> NDArray[np.uint8]:
        image = frame.image()
        if (color_mode or self.config.color_mode) == ColorMode.BGR:
            return np.ascontiguousarray(image[..., ::-1])
        return image
