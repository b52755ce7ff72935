# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What was traced is traced once; what a crash has left of it, once more."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from simulation.kept import Kept

PICTURE = np.arange(24, dtype=np.float32).reshape(2, 4, 3)


class Tracing:
    """A task that counts how often it is done."""

    def __init__(self) -> None:
        self.times = 0

    def __call__(self) -> np.ndarray:
        self.times += 1
        return PICTURE * self.times


def traced(kept: Kept, task: Tracing) -> np.ndarray:
    with ThreadPoolExecutor(1) as executor:
        return kept.result("press_01", kept.started(executor, "press_01", task))


def test_a_part_is_traced_once(tmp_path: Path) -> None:
    kept, task = Kept(tmp_path), Tracing()
    for _ in range(2):
        np.testing.assert_array_equal(traced(kept, task), PICTURE)
    assert task.times == 1
    nowhere = Kept(None)
    assert [traced(nowhere, task)[0, 0, 1] for _ in range(2)] == [2, 3]


@pytest.mark.parametrize("damage", [lambda whole: whole[:-40], lambda whole: b"", lambda _: b"no"])
def test_a_part_that_cannot_be_read_is_traced_and_kept_again(damage, tmp_path: Path) -> None:
    kept, task = Kept(tmp_path), Tracing()
    traced(kept, task)
    (path,) = tmp_path.iterdir()
    path.write_bytes(damage(path.read_bytes()))
    assert traced(kept, task)[0, 0, 1] == 2
    assert traced(kept, task)[0, 0, 1] == 2 and task.times == 2
