# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Fits side by side: each gives its own result, tells how far it is, and ends with its block."""

from concurrent.futures import CancelledError
from threading import Event

import pytest

from validation.fits import MOST, Progress, concurrent_fits

LONG_S = 60.0
"""Longer than any of these tests may take."""


def test_each_result_is_its_own_and_all_fits_run_at_once() -> None:
    begun = [Event() for _ in range(MOST)]

    def fit(number: int) -> int:
        begun[number].set()
        return number if all(other.wait(LONG_S) for other in begun) else -1

    told: list[float] = []
    with concurrent_fits() as fits:
        results = [fits.begin(lambda _, number=number: fit(number)) for number in range(MOST)]
        fits.wait(told.append)
    assert [result.result() for result in results] == list(range(MOST))
    assert told[-1] == 1.0


def test_who_waits_is_told_the_mean_share_that_is_done() -> None:
    told: list[float] = []
    seen = Event()

    def half(progress: Progress) -> None:
        progress(0.5)
        assert seen.wait(LONG_S)

    def hear(share: float) -> None:
        told.append(share)
        if share == 0.75:
            seen.set()

    with concurrent_fits() as fits:
        fits.begin(half)
        fits.begin(lambda progress: progress(1.0))
        fits.wait(hear)
    assert told == sorted(told)
    assert 0.75 in told


def test_nothing_to_wait_for_is_done() -> None:
    told: list[float] = []
    with concurrent_fits() as fits:
        fits.wait(told.append)
    assert told == [1.0]


def test_a_fit_that_nobody_waits_for_ends_with_the_block_and_those_behind_it_do_not_begin() -> None:
    begun = Event()

    def endless(progress: Progress) -> None:
        begun.set()
        while True:
            progress(0.0)

    with pytest.raises(KeyboardInterrupt), concurrent_fits() as fits:
        running = [fits.begin(endless) for _ in range(MOST)]
        behind = fits.begin(endless)
        assert begun.wait(LONG_S)
        raise KeyboardInterrupt
    assert isinstance(running[0].exception(), CancelledError)
    assert behind.cancelled()


def test_a_fault_of_one_is_raised_where_they_are_waited_for_and_ends_the_others() -> None:
    def endless(progress: Progress) -> None:
        while True:
            progress(0.0)

    def faulty(progress: Progress) -> None:
        raise ValueError("no such light")

    with pytest.raises(ValueError, match="no such light"), concurrent_fits() as fits:
        other = fits.begin(endless)
        fits.begin(faulty)
        fits.wait(lambda share: None)
    assert isinstance(other.exception(), CancelledError)
