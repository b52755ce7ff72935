# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Batches made by other processes, ahead of the step that learns from them."""

import signal
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from multiprocessing import get_context
from typing import TypeVar

Batch = TypeVar("Batch")


def batch_makers(count: int) -> ProcessPoolExecutor:
    """So many processes that make batches; Ctrl-C is for the one that learns from them."""
    return ProcessPoolExecutor(
        count,
        mp_context=get_context("spawn"),
        initializer=signal.signal,
        initargs=(signal.SIGINT, signal.SIG_IGN),
    )


def made_ahead(
    make: Callable[[int], Batch], steps: Iterable[int], executor: Executor, ahead: int
) -> Iterator[Batch]:
    """What ``make`` gives for each step, in their order, up to ``ahead`` made before their turn."""
    waiting: deque[Future[Batch]] = deque()
    for step in steps:
        waiting.append(executor.submit(make, step))
        if len(waiting) > ahead:
            yield waiting.popleft().result()
    while waiting:
        yield waiting.popleft().result()
