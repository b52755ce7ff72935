# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import multiprocessing
import os
import select
from pathlib import Path

import pytest

from app._workers import process_pool
from sensor.errors import WedgeError


def never_ends(signal_file: Path) -> None:
    """Say that it runs, then wait for what never comes."""
    signal_file.write_text("running")
    select.select([], [], [])


@pytest.mark.parametrize("fault", [KeyboardInterrupt, ValueError])
def test_when_the_block_fails_no_worker_computes_on(tmp_path, fault):
    os.mkfifo(tmp_path / "signal")
    with pytest.raises(fault), process_pool() as pool:
        for _ in range(9):
            pool.submit(never_ends, tmp_path / "signal")
        assert (tmp_path / "signal").read_text().startswith("running")
        raise fault
    assert multiprocessing.active_children() == []


def test_what_no_worker_has_read_yet_holds_nobody_up():
    with pytest.raises(ValueError), process_pool() as pool:
        # More than a pipe holds, and no worker is up yet; Python from 3.11.5 on ends by itself.
        first, _ = (pool.submit(len, bytes(1 << 24)) for _ in range(2))
        while not (first.running() or first.done()):
            pass
        raise ValueError
    assert multiprocessing.active_children() == []


def test_a_process_that_was_killed_is_said_in_a_sentence():
    with pytest.raises(WedgeError, match="memory"), process_pool() as pool:
        pool.submit(os._exit, 9).result()
    assert multiprocessing.active_children() == []


def test_the_pool_computes():
    with process_pool() as pool:
        assert list(pool.map(abs, [-1, 2, -3])) == [1, 2, 3]
