# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import multiprocessing
import os
import select
from pathlib import Path

import pytest

from app._workers import process_pool


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


def test_the_pool_computes():
    with process_pool() as pool:
        assert list(pool.map(abs, [-1, 2, -3])) == [1, 2, 3]
