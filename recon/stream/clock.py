# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The sender's clock laid over this machine's."""

from collections import deque

from recon.stream.frame import Clock
from sensor.wire import Stamp

MOST_APART_NS = 3600 * 10**9
"""Clocks that differ by an hour are not set, whatever year they show."""
QUICKEST_OF_NS = 120 * 10**9
"""Long enough for a quick frame to be among them, short enough for the clocks not to part."""
UNSET = (
    "the clock of {name} is not set: frames bear the time of their arrival, and no latency "
    "can be told; let the Pi reach a time server."
)


class SenderClock:
    """Gives each frame its time; where the sender has only its uptime, by the quickest frame.

    That is the quickest of the last ``QUICKEST_OF_NS``, and of none before the sender's start: a
    sender whose crystal runs 50 ppm slow then dates frames at most 6 ms early, however long.
    """

    def __init__(self) -> None:
        self._quickest: deque[tuple[int, int]] = deque()
        """Uptime, and how far our clock was ahead of it: the least, and what will be it next."""

    def time_ns(self, stamp: Stamp, arrived_ns: int) -> tuple[int, Clock]:
        """When a frame was taken, since the Unix epoch, and whose clock says so."""
        if stamp.timestamp_ns is not None and stamp.clock_is_set:
            if abs(arrived_ns - stamp.timestamp_ns) < MOST_APART_NS:
                return stamp.timestamp_ns, "sensor"
        uptime_ns = stamp.sensor_timestamp_ns
        if uptime_ns is None:
            return arrived_ns, "arrival"
        return uptime_ns + self._least_apart_ns(uptime_ns, arrived_ns - uptime_ns), "mapped"

    def _least_apart_ns(self, uptime_ns: int, apart_ns: int) -> int:
        quickest = self._quickest
        if quickest and uptime_ns < quickest[-1][0]:  # it was started anew
            quickest.clear()
        while quickest and quickest[-1][1] >= apart_ns:
            quickest.pop()
        quickest.append((uptime_ns, apart_ns))
        while quickest[0][0] < uptime_ns - QUICKEST_OF_NS:
            quickest.popleft()
        return quickest[0][1]


def clock_remark(name: str, stamp: Stamp, clock: Clock) -> str:
    """A sentence where the sender tells a time that cannot be right; else nothing."""
    return UNSET.format(name=name) if stamp.timestamp_ns and clock != "sensor" else ""
