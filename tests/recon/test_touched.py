# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from recon.ball import ball_cap
from recon.touched import Touched

SIZE_PX, PITCH = (80, 60), (0.1, 0.12)


def touched(disturbed: np.ndarray, depth_mm: np.ndarray) -> Touched:
    rows, columns = np.gradient(depth_mm, PITCH[1], PITCH[0])
    return Touched(
        difference=np.zeros((*depth_mm.shape, 3), np.float32),
        gradient=np.stack([columns, rows], -1).astype(np.float32),
        depth_mm=depth_mm.astype(np.float32),
        disturbed=disturbed,
        boundary="dirichlet",
        mm_per_px=PITCH,
    )


def test_the_deepest_point_is_one_where_something_touches() -> None:
    cap = ball_cap(SIZE_PX, (20.0, 30.0), 1.2, 2.0, PITCH)
    deeper = ball_cap(SIZE_PX, (60.0, 30.0), 1.6, 2.0, PITCH)  # no colour changed there: a drift
    found = touched(cap.contact, cap.depth_mm + deeper.depth_mm)
    assert found.depth_mm.max() == pytest.approx(deeper.depth_mm.max())
    assert found.deepest_mm == pytest.approx(cap.depth_mm.max())
    (patch,) = found.patches
    assert found.deepest_mm == patch.deepest_mm
    assert found.contact_mm2 == pytest.approx(patch.area_mm2)


def test_where_nothing_touches_nothing_is_deep() -> None:
    deep = ball_cap(SIZE_PX, (60.0, 30.0), 1.6, 2.0, PITCH).depth_mm
    found = touched(np.zeros(deep.shape, bool), deep)
    assert (found.deepest_mm, found.contact_mm2, found.patches) == (0, 0, ())
