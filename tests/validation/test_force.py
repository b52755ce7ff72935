# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from validation.force import ForceCurve


def test_frames_without_contact_share_a_rank():
    force = np.array([0.0, 0.0, 0.0, 1.0, 2.0, 3.0])
    curve = ForceCurve(name="clip", force_n=force, area_mm2=5 * force, deepest_mm=-force)
    assert curve.rank_correlation == pytest.approx((1.0, -1.0))
