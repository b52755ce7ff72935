# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The processes that embarrassingly parallel work runs in."""

import multiprocessing
import os
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing.connection import wait

from sensor.errors import WedgeError

MOST_WORKERS = 2
"""Each keeps the presses of one dataset, about 400 MB for 48 frames of 640x480."""


def on_one_thread() -> None:
    """Keep linear algebra of this process on one thread; call it before numpy is imported.

    The problems here are small: on two threads they wait for each other.
    """
    os.environ.setdefault("OMP_NUM_THREADS", "1")


@contextmanager
def process_pool() -> Iterator[Executor]:
    """Fresh processes, numerics on one thread each; ended at once when the block fails.

    They end with this process too, even where it is killed.

    Raises:
        WedgeError: one of them ended before its work was done.
    """
    on_one_thread()
    others = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(
        max_workers=min(MOST_WORKERS, os.cpu_count() or 1),
        mp_context=multiprocessing.get_context("spawn"),
        initializer=_end_with_parent,
    )
    try:
        yield pool
    except BaseException as fault:  # what is queued would otherwise be computed to its end
        for worker in set(multiprocessing.active_children()) - others:
            worker.terminate()
        if sys.version_info < (3, 11, 5):
            # What is on its way to them would wait for its reader for ever, as nobody closes this
            # end (Python's issue 94777); Debian 12 has such a Python.
            pool._call_queue._reader.close()  # type: ignore[attr-defined]
        pool.shutdown(cancel_futures=True)
        if isinstance(fault, BrokenExecutor):
            raise WedgeError(
                "a process of this command was killed from outside, perhaps for lack of memory: "
                "close other programs and run the command again."
            ) from fault
        raise
    pool.shutdown()


def _end_with_parent() -> None:
    """Watch the process that this worker works for: once that is killed, no more work comes."""
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
