# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The sender's clock laid over this machine's."""

from recon.stream.frame import Clock
from sensor.wire import Stamp

MOST_APART_NS = 3600 * 10**9
"""Clocks that differ by an hour are not set, whatever year they show."""
UNSET = (
    "the clock of {name} is not set: frames bear the time of their arrival, and no latency "
    "can be told; let the Pi reach a time server."
)


class SenderClock:
    """Gives each frame its time; where the sender has only its uptime, by the quickest frame."""

    def __init__(self) -> None:
        self._least_ns: int | None = None

    def time_ns(self, stamp: Stamp, arrived_ns: int) -> tuple[int, Clock]:
        """When a frame was taken, since the Unix epoch, and whose clock says so."""
        if stamp.timestamp_ns is not None and stamp.clock_is_set:
            if abs(arrived_ns - stamp.timestamp_ns) < MOST_APART_NS:
                return stamp.timestamp_ns, "sensor"
        if stamp.sensor_timestamp_ns is None:
            return arrived_ns, "arrival"
        apart_ns = arrived_ns - stamp.sensor_timestamp_ns
        if self._least_ns is None or apart_ns < self._least_ns:
            self._least_ns = apart_ns
        return stamp.sensor_timestamp_ns + self._least_ns, "mapped"


def clock_remark(name: str, stamp: Stamp, clock: Clock) -> str:
    """A sentence where the sender tells a time that cannot be right; else nothing."""
    return UNSET.format(name=name) if stamp.timestamp_ns and clock != "sensor" else ""
