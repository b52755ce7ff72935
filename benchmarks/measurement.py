# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""One measured figure and the bar it is held against."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from statistics import median

import cv2


@dataclass(frozen=True, kw_only=True)
class Measurement:
    """A figure of the performance page."""

    name: str
    value: float
    """Infinite where something failed of which there is no figure then."""
    unit: str
    bar: float | None = None
    """The most that is accepted; ``None`` where nothing is asked."""

    @property
    def passed(self) -> bool:
        """Whether the figure is within its bar."""
        return self.bar is None or self.value <= self.bar


@contextmanager
def one_thread() -> Iterator[None]:
    """OpenCV's loops on one core for as long; those of numpy are bound where Python starts."""
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)


def interleaved_ms(calls: Sequence[Callable[[], object]], rounds: int) -> list[float]:
    """Median time of each call in ms, taken in turn, so that noise of the machine hits all."""
    times: list[list[float]] = [[] for _ in calls]
    for _ in range(rounds):
        for call, taken in zip(calls, times, strict=True):
            start = time.perf_counter()
            call()
            taken.append(1e3 * (time.perf_counter() - start))
    return [median(taken) for taken in times]
