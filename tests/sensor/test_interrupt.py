# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C between two frames, amid one, while the next is awaited, and twice; and all that asks."""

import signal
from collections.abc import Iterator

import pytest

from sensor.interrupt import Asked, UntilInterrupted

pytestmark = pytest.mark.usefixtures("usual_ctrl_c")


def test_without_ctrl_c_all_come() -> None:
    until = UntilInterrupted(range(5))
    assert list(until) == [0, 1, 2, 3, 4]
    assert not until.interrupted
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_amid_an_item_it_is_worked_on_to_its_end_and_no_other_comes() -> None:
    done = []
    until = UntilInterrupted(range(5))
    for item in until:
        if item == 2:
            signal.raise_signal(signal.SIGINT)
        done.append(item)
    assert done == [0, 1, 2] and until.interrupted
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_while_the_next_is_awaited_it_ends_at_once_and_the_source_lets_go() -> None:
    closed = []

    def source() -> Iterator[int]:
        try:
            yield 1
            signal.raise_signal(signal.SIGINT)
            yield from range(2, 5)
        finally:
            closed.append(True)

    until = UntilInterrupted(source())
    assert list(until) == [1]
    assert until.interrupted and closed == [True]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_sigterm_twice_ends_it_as_ctrl_c_once_and_is_not_heard_while_what_came_is_kept(
    number: signal.Signals,
) -> None:
    def ended(*_: object) -> None:
        raise SystemExit(128 + number)

    before = signal.signal(number, ended)
    try:
        done = []
        until = UntilInterrupted(range(5))
        for item in until:
            if item == 2:
                signal.raise_signal(number)
                signal.raise_signal(number)
            done.append(item)
        signal.raise_signal(number)
        assert done == [0, 1, 2] and until.interrupted and until.asked_by == number.name
        with pytest.raises(SystemExit, match=str(128 + number)):
            until.give_up()
        assert signal.getsignal(number) is ended
        for item in UntilInterrupted(range(5)):
            if item == 1:
                break
        assert signal.getsignal(number) is ended
    finally:
        signal.signal(number, before)


def test_twice_is_the_usual_one() -> None:
    until = UntilInterrupted(range(5))
    with pytest.raises(KeyboardInterrupt):
        for _ in until:
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)
    del until
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_where_it_is_ignored_it_stays_ignored() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    until = UntilInterrupted(range(3))
    for _ in until:
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
        signal.raise_signal(signal.SIGINT)
    assert not until.interrupted


def test_who_stops_early_gets_ctrl_c_back() -> None:
    for item in UntilInterrupted(range(5)):
        if item == 1:
            break
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_who_is_asked_is_broken_off_nowhere_and_hears_what_was_not_ignored() -> None:
    before = {n: signal.getsignal(n) for n in (signal.SIGHUP, signal.SIGTERM)}
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    try:
        with Asked() as asked:
            signal.raise_signal(signal.SIGHUP)
            assert not asked.to_end
            signal.raise_signal(signal.SIGTERM)
            signal.raise_signal(signal.SIGTERM)
            assert asked.to_end and not asked.again
            signal.raise_signal(signal.SIGINT)
            assert asked.again  # a person, who does not want to wait
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
