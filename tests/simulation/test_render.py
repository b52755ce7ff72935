# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A picture that does not fit into a GPU's memory is traced in pieces."""

from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from sensor.design import FINGER
from sensor.errors import WedgeError
from sensor.extras import how_to_restore
from simulation.engine import SCALAR, best_engine
from simulation.render import drawn_samples, render
from simulation.skin import gel_view

VIEW = gel_view(FINGER, 16)
REST = np.zeros(VIEW.size_px[::-1])
FULL = "jit_malloc(): out of memory! Could not allocate 4096 bytes (backend=cuda, shared=0)."


@pytest.mark.parametrize("samples", [1, 2, 3, 10, 24, 32, 64, 128, 200])
def test_as_many_paths_are_drawn_as_said(samples):
    with SCALAR.loaded() as mi:
        sampler = mi.load_dict({"type": "multijitter", "sample_count": samples})
        assert sampler.sample_count() == drawn_samples(samples) >= samples


class Small:
    """The plain engine, as if no more rows than these fitted, or as if it failed otherwise."""

    def __init__(self, rows=99, error=None):
        self.rows, self.error, self.seen = rows, error, []

    @contextmanager
    def loaded(self, threads=None):
        def traced(scene, **options):
            rows = scene.sensors()[0].film().crop_size()[1]
            self.seen.append(rows)
            if self.error or rows > self.rows:
                raise RuntimeError(self.error or FULL)
            return mi.render(scene, **options)

        names = ("load_dict", "Properties", "Mesh", "traverse", "Bitmap", "ScalarTransform4f")
        with SCALAR.loaded(threads) as mi:
            yield SimpleNamespace(**{name: getattr(mi, name) for name in names}, render=traced)


def picture(engine, window=None, seed=3):
    return render(engine, FINGER, VIEW, REST, samples=4, seed=seed, window=window)


def test_pieces_are_those_of_the_windows_and_none_is_larger_than_need_be(mitsuba) -> None:
    width, height = VIEW.size_px
    engine = Small(rows=height // 2 + 1)
    halves = [  # the second by random paths of its own
        picture(SCALAR, (slice(0, width), rows), seed=3 + rows.start)
        for rows in (slice(0, height // 2), slice(height // 2, height))
    ]
    np.testing.assert_array_equal(picture(engine), np.concatenate(halves))
    assert engine.seen == [height, height // 2, height - height // 2]


def test_threads_of_one_process_have_the_pictures_that_they_would_have_alone(mitsuba) -> None:
    tasks = [(engine, None, seed) for seed in range(4) for engine in (SCALAR, best_engine())]
    alone = [picture(*task) for task in tasks]
    with ThreadPoolExecutor(4) as threads:
        beside = list(threads.map(lambda task: picture(*task), tasks))
    np.testing.assert_array_equal(beside, alone)


def test_a_picture_that_fits_is_traced_at_once_and_as_ever(mitsuba) -> None:
    engine = Small()
    np.testing.assert_array_equal(picture(engine), picture(SCALAR))
    assert engine.seen == [VIEW.size_px[1]]


def test_memory_for_no_row_is_said(mitsuba) -> None:
    with pytest.raises(WedgeError, match="fewer --samples"):
        picture(Small(rows=0))


def test_other_errors_are_not_taken_for_it(mitsuba) -> None:
    engine = Small(error="the film has no pixels")
    with pytest.raises(RuntimeError, match="no pixels"):
        picture(engine)
    assert len(engine.seen) == 1


@pytest.mark.parametrize("other", [None, SimpleNamespace()], ids=["without", "emptied"])
def test_an_opencv_without_the_filter_is_told_before_anything_is_traced(other, monkeypatch) -> None:
    engine = Small()
    if other is None:
        monkeypatch.delattr(cv2, "ximgproc")
    else:
        monkeypatch.setattr(cv2, "ximgproc", other)
    with pytest.raises(WedgeError, match="another OpenCV") as raised:
        picture(engine)
    assert how_to_restore("opencv-contrib-python-headless<5") in str(raised.value)
    assert engine.seen == []
