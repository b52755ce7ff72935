# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""When a frame was taken by this machine's clock, as far as the sender's clock or uptime tells."""

from collections import deque

from recon.stream.frame import Clock
from sensor.wire import Stamp

MOST_AHEAD_NS = 50 * 10**6
"""A stamp may be later than the frame's arrival by this: time servers keep clocks nearer."""
MOST_BEHIND_NS = 300 * 10**6
"""Most latency of the quickest frame: no network to steer a robot by holds every frame longer."""
SET_NS = 50 * 10**6
"""If a sender's clock departs from its uptime by this between two frames, the clock was set."""
STARTED_NS = 2 * 10**9
"""An uptime that fell behind our clock by so much between two frames is that of another start, even
where it grew: no connection is silent for so long without being made anew, with a fresh frame."""
QUICKEST_OF_NS = 120 * 10**9
"""The quickest frame is that of so long a time: quick frames are among them, and the clocks hardly
drift."""
REMARK = (
    "the clock of {name} {fault}: frames carry the time {by}, and the latency is "
    "unknown; let {who} reach a time server."
)
UNSET = "is not set", "the Pi"
APART = "and this machine's differ, or every frame comes late", "both"
"""Which of the two it is cannot be told where stamps lie a little in the past."""


class _Quickest:
    """The least of some numbers, over ``QUICKEST_OF_NS``."""

    def __init__(self) -> None:
        self._kept: deque[tuple[int, int]] = deque()
        """When, and the number: the least, and what will be it next."""

    def of_ns(self, at_ns: int, number_ns: int) -> int:
        """With one more; times that fall begin anew."""
        kept = self._kept
        if kept and at_ns < kept[-1][0]:
            kept.clear()
        while kept and kept[-1][1] >= number_ns:
            kept.pop()
        kept.append((at_ns, number_ns))
        while kept[0][0] < at_ns - QUICKEST_OF_NS:
            kept.popleft()
        return kept[0][1]


class SenderClock:
    """Gives each frame its time; where the sender has only its uptime, by the quickest frame.

    So it is, too, where the sender's clock cannot be right: by it a frame was taken after it had
    come, or the quickest was long on the way.

    That is the quickest of the last ``QUICKEST_OF_NS``, and of none before the sender's start: a
    sender whose crystal runs 50 ppm slow then dates frames at most 6 ms early, however long.
    """

    def __init__(self) -> None:
        self._late, self._apart = _Quickest(), _Quickest()
        """Arrival after the stamp, and our clock ahead of the sender's uptime."""
        self._ahead_ns = 0
        """Of the sender's uptime, its clock."""
        self._before_ns: int | None = None
        """Of the sender's uptime, our clock at the frame before."""

    def time_ns(self, stamp: Stamp, arrived_ns: int) -> tuple[int, Clock]:
        """When a frame was taken, since the Unix epoch, and whose clock says so."""
        uptime_ns, apart_ns = stamp.sensor_timestamp_ns, 0
        if uptime_ns is not None:
            apart_ns = arrived_ns - uptime_ns
            if self._before_ns is not None and apart_ns - self._before_ns > STARTED_NS:
                self._apart = _Quickest()
            self._before_ns = apart_ns
            apart_ns = self._apart.of_ns(uptime_ns, apart_ns)
        if stamp.timestamp_ns is not None and stamp.clock_is_set:
            if uptime_ns is not None:
                ahead_ns, self._ahead_ns = self._ahead_ns, stamp.timestamp_ns - uptime_ns
                if abs(self._ahead_ns - ahead_ns) > SET_NS:  # earlier frames tell nothing of it
                    self._late = _Quickest()
            late_ns = self._late.of_ns(arrived_ns, arrived_ns - stamp.timestamp_ns)
            if -MOST_AHEAD_NS < late_ns < MOST_BEHIND_NS:
                return stamp.timestamp_ns, "sensor"
        if uptime_ns is None:
            return arrived_ns, "arrival"
        return uptime_ns + apart_ns, "mapped"


def clock_remark(name: str, stamp: Stamp, clock: Clock) -> str:
    """A sentence where the sender tells a time that cannot be right; else nothing."""
    if not stamp.timestamp_ns or clock == "sensor":
        return ""
    fault, who = APART if stamp.clock_is_set else UNSET
    by = "of the Pi's uptime" if clock == "mapped" else "of their arrival"
    return REMARK.format(name=name, fault=fault, by=by, who=who)
