# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The newest frame, for any number of readers: who is slow misses frames and delays nobody."""

import threading
import time
from collections import deque
from dataclasses import dataclass

from sensor.wire import NS_PER_S, Stamp, part

_RATE_OVER = 60


@dataclass(frozen=True)
class Frame:
    """A frame as the camera gave it and as it is sent.

    Attributes:
        jpeg: The picture.
        stamp: When it was taken and which one it is.
        part: Both as they follow a delimiter on the wire.
    """

    jpeg: bytes
    stamp: Stamp
    part: bytes


class Newest:
    """Holds one frame, the newest."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._frame: Frame | None = None
        self._count = 0
        self._sensor_ns: deque[int] = deque(maxlen=_RATE_OVER)
        self._arrived_ns = time.monotonic_ns()

    def put(self, jpeg: bytes, sensor_timestamp_ns: int) -> None:
        """Take the next frame in the place of the last one."""
        age_ns = time.clock_gettime_ns(time.CLOCK_BOOTTIME) - sensor_timestamp_ns
        stamp = Stamp(time.time_ns() - age_ns, sensor_timestamp_ns, self._count)
        frame = Frame(jpeg, stamp, part(jpeg, stamp))
        with self._changed:
            self._frame = frame
            self._count += 1
            self._sensor_ns.append(sensor_timestamp_ns)
            self._arrived_ns = time.monotonic_ns()
            self._changed.notify_all()

    def after(self, index: int, timeout_s: float) -> Frame | None:
        """The newest frame once it comes after number ``index``, or None when time is up."""
        with self._changed:
            self._changed.wait_for(lambda: self._count > index + 1, timeout_s)
            return self._frame if self._count > index + 1 else None

    @property
    def count(self) -> int:
        """Frames so far."""
        return self._count

    @property
    def age_s(self) -> float:
        """Time since the last frame came, or since the beginning where none has."""
        return (time.monotonic_ns() - self._arrived_ns) / NS_PER_S

    @property
    def rate_hz(self) -> float | None:
        """Rate of the last frames by the sensor's time; None before the second one."""
        with self._changed:
            times = list(self._sensor_ns)
        if len(times) < 2 or times[-1] <= times[0]:
            return None
        return (len(times) - 1) * NS_PER_S / (times[-1] - times[0])
