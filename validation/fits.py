# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Several fits to the same presses, side by side in this process.

Torch lets go of Python's lock while it computes, so threads share the processors evenly, however
many fits there are, and what was read once is read by all.
"""

from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from statistics import fmean
from threading import Event
from typing import Any, TypeVar

Progress = Callable[[float], None]
Result = TypeVar("Result")

MOST = 3
"""At once. Two, of 40 and of 32 presses at 320 pixels of width, take 0.7 GB with all else."""
LOOK_EVERY_S = 0.2
"""How often somebody who waits is told how far they are."""


class Fits:
    """Fits that were begun."""

    def __init__(self, pool: ThreadPoolExecutor, ended: Event) -> None:
        """Begin none yet."""
        self._pool, self._ended = pool, ended
        self._begun: list[Future[Any]] = []
        self._shares: list[float] = []

    def begin(self, fit: Callable[[Progress], Result]) -> Future[Result]:
        """Begin one more; it is given what to call with its share that is done, 0 to 1."""
        number = len(self._shares)
        self._shares.append(0.0)

        def still_wanted(share: float) -> None:
            if self._ended.is_set():
                raise CancelledError
            self._shares[number] = share

        future = self._pool.submit(fit, still_wanted)
        self._begun.append(future)
        return future

    def wait(self, progress: Progress) -> None:
        """Wait until all that were begun are done; a fault of one is raised at once."""
        left = set(self._begun)
        while left:
            done, left = wait(left, LOOK_EVERY_S)
            for future in done:
                future.result()
            progress(fmean(self._shares))
        progress(1.0)


@contextmanager
def concurrent_fits() -> Iterator[Fits]:
    """Fits that are begun in the block end with it, those that nobody waited for unfinished."""
    ended = Event()
    pool = ThreadPoolExecutor(MOST)
    try:
        yield Fits(pool, ended)
    finally:
        ended.set()
        pool.shutdown(cancel_futures=True)
