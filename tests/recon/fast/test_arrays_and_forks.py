# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames in whichever layout, and in a process that was forked."""

import multiprocessing
import sys
from typing import Any

import numpy as np
import pytest

from recon.fast import FastReconstructor, unwarping
from tests.recon.fast.units import make_unit, pressed, random_default

UNIT = make_unit(estimator=random_default())
FRAME = pressed(UNIT.background, (80, 60))


def cut_out(frame: np.ndarray) -> np.ndarray:
    return np.pad(frame, ((3, 5), (2, 4), (0, 0)))[3:-5, 2:-4]


def read_only(frame: np.ndarray) -> np.ndarray:
    return np.frombuffer(frame.tobytes(), np.uint8).reshape(frame.shape)


@pytest.mark.parametrize(
    "laid",
    [
        lambda frame: np.ascontiguousarray(frame[..., ::-1])[..., ::-1],
        lambda frame: np.ascontiguousarray(frame[::-1, ::-1])[::-1, ::-1],
        np.asfortranarray,
        cut_out,
        read_only,
    ],
    ids=["as OpenCV's", "turned", "by columns", "cut out", "read only"],
)
def test_no_loop_is_compiled_for_a_frame_that_is_laid_otherwise(laid) -> None:
    reconstruct, frame = FastReconstructor(UNIT), laid(FRAME)
    np.testing.assert_array_equal(frame, FRAME)
    wanted = reconstruct(FRAME).depth_mm.copy()
    compiled = list(unwarping._difference.signatures)
    np.testing.assert_array_equal(reconstruct(frame).depth_mm, wanted)
    assert unwarping._difference.signatures == compiled
    np.testing.assert_array_equal(frame, FRAME)


def answer(reconstruct: FastReconstructor, said: Any) -> None:
    said.send(reconstruct(FRAME).depth_mm.copy())


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere libraries do not outlive a fork")
@pytest.mark.filterwarnings("ignore:.*multi-threaded.*:DeprecationWarning")
@pytest.mark.parametrize("threads", [1, 2])
def test_a_fork_has_threads_of_its_own(threads: int) -> None:
    reconstruct = FastReconstructor(UNIT, threads=threads)
    wanted = reconstruct(FRAME).depth_mm.copy()
    fork = multiprocessing.get_context("fork")
    here, there = fork.Pipe(duplex=False)
    process = fork.Process(target=answer, args=(reconstruct, there), daemon=True)
    process.start()
    try:
        assert here.poll(60), "it waits for threads that are not there"
        np.testing.assert_array_equal(here.recv(), wanted)
        process.join(60)
        assert process.exitcode == 0
    finally:
        process.kill()
        process.join()
    np.testing.assert_array_equal(reconstruct(FRAME).depth_mm, wanted)
