# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The processes that embarrassingly parallel work runs in."""

import multiprocessing
import os
from concurrent.futures import Executor, ProcessPoolExecutor

MOST_WORKERS = 2
"""Each keeps the presses of one dataset, about 400 MB for 48 frames of 640x480."""


def process_pool() -> Executor:
    """Fresh processes, numerics on one thread each."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    return ProcessPoolExecutor(
        max_workers=min(MOST_WORKERS, os.cpu_count() or 1),
        mp_context=multiprocessing.get_context("spawn"),
    )
