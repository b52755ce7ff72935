# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from validation.force import ForceCurve, measured_forces


def test_frames_without_contact_share_a_rank():
    force = np.array([0.0, 0.0, 0.0, 1.0, 2.0, 3.0])
    curve = ForceCurve(name="clip", force_n=force, area_mm2=5 * force, deepest_mm=-force)
    assert curve.rank_correlation == pytest.approx((1.0, -1.0))


def clip_of(folder, readings):
    """The table of forces of a clip, as the sets have it."""
    path = folder / "force.csv"
    path.write_text("\n".join(["frame,force_N", *(f"{i},{r}" for i, r in enumerate(readings))]))
    return path


@pytest.mark.parametrize("sign", [1, -1])
def test_force_is_positive_when_gripped_and_zero_at_rest(tmp_path, sign):
    grip = np.array([0.0, 0.1, -0.1, 2.0, 5.0, 9.0, 9.0, 9.0])  # at rest for three frames, no more
    found = measured_forces(clip_of(tmp_path, 0.7 + sign * grip))
    assert found == pytest.approx(grip)
