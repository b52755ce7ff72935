# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The sender's clock laid over this machine's, and what is said where it cannot be right."""

import pytest

from recon.stream.clock import SenderClock, clock_remark
from sensor.wire import Stamp

SECOND_NS = 10**9


def test_the_quickest_frame_lays_the_sender_s_uptime_over_our_clock() -> None:
    clock, uptime_ns = SenderClock(), 10**9
    delays_ns = [9, 4, 7, 2, 30]
    for i, delay_ns in enumerate(delays_ns):
        taken_ns = 1000 + 16 * i
        found_ns, kind = clock.time_ns(Stamp(None, uptime_ns + taken_ns, i), taken_ns + delay_ns)
        assert (found_ns - taken_ns, kind) == (min(delays_ns[: i + 1]), "mapped")


@pytest.mark.parametrize("apart_s", [-7200.0, -1800.0, -6.0, -0.4, 0.1, 30.0, 7200.0])
def test_a_clock_that_cannot_be_right_is_not_believed(apart_s: float) -> None:
    now_ns = 1_800_000_000 * SECOND_NS
    told_ns = now_ns + int(apart_s * SECOND_NS)
    by_uptime, alone = Stamp(told_ns, 50 * SECOND_NS, 0), Stamp(told_ns, None, 0)
    assert SenderClock().time_ns(by_uptime, now_ns) == (now_ns, "mapped")
    assert SenderClock().time_ns(alone, now_ns) == (now_ns, "arrival")
    said = "differ, or every frame comes late: frames carry the time of"
    assert f"{said} the Pi's uptime" in clock_remark("pi", alone, "mapped")
    assert f"{said} their arrival" in clock_remark("pi", alone, "arrival")


def test_a_clock_that_is_not_set_or_tells_no_time_is_said_or_not_blamed() -> None:
    unset = Stamp(3600 * SECOND_NS, 50 * SECOND_NS, 0)
    assert "is not set: frames carry the time of the Pi's up" in clock_remark("pi", unset, "mapped")
    assert clock_remark("pi", Stamp(None, SECOND_NS, 0), "mapped") == ""


def test_one_late_frame_is_late_and_a_clock_that_was_set_is_believed_again() -> None:
    clock, now_ns = SenderClock(), 1_800_000_000 * SECOND_NS

    def kinds(behind_s: int, late_s: list[int], from_s: int) -> list[str]:
        """Of frames every second by a clock so far behind, each so late."""
        found = []
        for second, late in enumerate(late_s, start=from_s):
            taken_ns = now_ns + second * SECOND_NS
            stamp = Stamp(taken_ns - behind_s * SECOND_NS, second * SECOND_NS, second)
            found.append(clock.time_ns(stamp, taken_ns + late * SECOND_NS)[1])
        return found

    assert kinds(0, [0, 0, 8, 0], 100) == ["sensor"] * 4
    assert kinds(-60, [0, 0], 110) == ["mapped"] * 2
    assert kinds(0, [0] * 130, 120)[-1] == "sensor"


@pytest.mark.parametrize("set_s", [-3.0, -0.4, 0.1, 3.0])
def test_a_clock_that_is_set_amid_the_stream_moves_no_frame(set_s: float) -> None:
    clock, now_ns = SenderClock(), 1_800_000_000 * SECOND_NS
    kinds = []
    for second in range(20):
        taken_ns = now_ns + second * SECOND_NS
        moved_ns = int(set_s * SECOND_NS) if second >= 10 else 0
        stamp = Stamp(taken_ns + moved_ns, second * SECOND_NS, second)
        found_ns, kind = clock.time_ns(stamp, taken_ns + 10_000_000)
        assert abs(found_ns - taken_ns) <= 10_000_000
        kinds.append(kind)
    assert kinds == ["sensor"] * 10 + ["mapped"] * 10


def test_a_few_late_frames_leave_a_clock_believed() -> None:
    clock, now_ns = SenderClock(), 1_800_000_000 * SECOND_NS
    for second, late_s in enumerate([0, 1, 2, 1, 1, 0]):
        taken_ns = now_ns + second * SECOND_NS
        stamp = Stamp(taken_ns, second * SECOND_NS + second % 2 * 40_000_000, second)
        arrived_ns = taken_ns + late_s * SECOND_NS
        assert clock.time_ns(stamp, arrived_ns) == (taken_ns, "sensor")


def test_a_sender_that_was_started_anew_is_laid_over_our_clock_anew() -> None:
    clock, now_ns = SenderClock(), 1_800_000_000 * SECOND_NS
    for uptime_s in (10_800, 10_801, 20, 21):
        stamp = Stamp(None, uptime_s * SECOND_NS, 0)
        assert clock.time_ns(stamp, now_ns + uptime_s) == (now_ns + uptime_s, "mapped")


@pytest.mark.parametrize("off_s", [0, 3, 600])
def test_a_sender_that_was_started_anew_early_is_not_dated_by_the_start_before(off_s: int) -> None:
    clock, now_ns = SenderClock(), 1_800_000_000 * SECOND_NS
    for from_s, uptimes_s in ((0, range(25, 29)), (29 + off_s, range(31, 35))):
        for uptime_s in uptimes_s:  # the second time it takes 6 s longer until there are frames
            taken_ns = now_ns + (from_s + uptime_s) * SECOND_NS
            stamp = Stamp(3600 * SECOND_NS, uptime_s * SECOND_NS, 0)
            assert clock.time_ns(stamp, taken_ns + 5) == (taken_ns + 5, "mapped")


@pytest.mark.parametrize("late_s", [1, 3, 600])
def test_a_frame_that_was_held_back_spoils_no_later_one(late_s: int) -> None:
    clock, now_ns, found_ns = SenderClock(), 1_800_000_000 * SECOND_NS, []
    for uptime_s in range(10):
        taken_ns = now_ns + uptime_s * SECOND_NS
        arrived_ns = taken_ns + (late_s * SECOND_NS if uptime_s == 5 else 0)
        time_ns, kind = clock.time_ns(Stamp(None, uptime_s * SECOND_NS, 0), arrived_ns)
        assert kind == "mapped" and time_ns <= arrived_ns
        found_ns.append(time_ns - taken_ns)
    assert found_ns[:5] + found_ns[6:] == [0] * 9


def test_a_crystal_that_runs_slow_dates_no_frame_more_than_6_ms_early() -> None:
    clock, begun_ns = SenderClock(), 1_800_000_000 * SECOND_NS
    early_ns = []
    for second in range(8 * 3600):
        taken_ns = begun_ns + second * SECOND_NS
        stamp = Stamp(None, second * (SECOND_NS - 50_000), second)
        early_ns.append(taken_ns - clock.time_ns(stamp, taken_ns)[0])
    assert 0 <= min(early_ns) <= max(early_ns) <= 6_000_000 + 50_000
