# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Of a frame that is mirrored beyond an edge an axis is inferred as the reference infers it."""

import numpy as np
import pytest

from recon.ball import ball_cap
from recon.depth import inferred_depth, without
from recon.fast.inference import FrameInference
from recon.missing_axis.mirrored import rows_beyond


@pytest.mark.parametrize("unseen", ["x", "y"])
@pytest.mark.parametrize("size_px", [(160, 120), (400, 300)])
@pytest.mark.parametrize("center", [(0.5, 0.02), (0.5, 0.98), (0.02, 0.5), (0.98, 0.5)])
def test_a_ball_that_the_frame_cuts_has_the_reference_s_depth(center, size_px, unseen) -> None:
    (width, height), pitch_mm = size_px, (16.0 / size_px[0], 12.0 / size_px[1])
    place_px = center[0] * width, center[1] * height
    cap = ball_cap(size_px, place_px, 2.0, 3.0, pitch_mm)
    slopes = without(unseen, cap.gradient.astype(np.float32))
    along = center[1] if unseen == "x" else center[0]
    assert any(rows_beyond(cap.contact, slopes, unseen, hinted=False)) == (along != 0.5)
    infer = FrameInference(size_px, pitch_mm, unseen, hinted=False)
    found = infer(slopes, cap.contact)
    wanted = inferred_depth(slopes, cap.contact, unseen, pitch_mm, hinted=False)
    assert found.boundary == wanted.boundary == "neumann"
    np.testing.assert_allclose(found.depth_mm, wanted.depth_mm, atol=2e-3)
    np.testing.assert_allclose(found.gradient, wanted.gradient, atol=3e-3)
    np.testing.assert_allclose(found.doubt, wanted.doubt, atol=3e-3)
