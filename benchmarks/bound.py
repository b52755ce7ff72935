# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How far slope noise lets any method go: the Cramér-Rao bound of one step on a cube corner.

    python -m benchmarks.bound

Slopes of two touches carry independent noise, so no unbiased estimate of the motion has a smaller
covariance than ``2 s^2 inverse(J^T J)``, J being the change of the noiseless slopes with a twist,
here by central differences of whole touches. Inside the contact's outline slopes do not see
height; depth does, as one measurement (recon.pose.pyramid).
"""

import numpy as np
from scipy import ndimage

from benchmarks.touches import MM_PER_PX, SLOPE_NOISE, cube_corner, pressed
from recon.pose.pyramid import depth_weight
from recon.pose.rigid import Covariance, motion

STEP_MM = 0.25 * MM_PER_PX[0]
LEVER_MM = 1.0
"""A turn by STEP_MM / LEVER_MM moves the contact's rim by about STEP_MM."""
DRAWN = 10_000


def bound(*, outline: bool) -> Covariance:
    """Of the twist (rad, mm) between two touches of the bench's cube corner.

    Args:
        outline: whether the pixels that the contact's outline crosses and those beyond count; on a
            real gel a collar blurs them.
    """
    thing = cube_corner()
    still = pressed(thing, np.eye(4))
    used = np.ones_like(still.contact)
    if not outline:
        used = ndimage.binary_erosion(still.contact, np.ones((3, 3)))
    columns = []
    for axis in range(6):
        twist = np.zeros(6)
        twist[axis] = STEP_MM / (LEVER_MM if axis < 3 else 1.0)
        ahead, behind = (pressed(thing, motion(sign * twist)).gradient[used] for sign in (1, -1))
        columns.append((ahead - behind).ravel() / (2 * twist[axis]))
    change = np.stack(columns, -1).astype(float)
    information = change.T @ change
    if not outline:
        information[5, 5] += depth_weight(still) * np.count_nonzero(still.contact)
    covariance: Covariance = 2 * SLOPE_NOISE**2 * np.linalg.inv(information)
    return covariance


def median_error(covariance: Covariance) -> tuple[float, float]:
    """Median angle in degrees and median shift in mm of twists with that covariance."""
    drawn = np.random.default_rng(0).multivariate_normal(np.zeros(6), covariance, DRAWN)
    turn, shift = (np.median(np.linalg.norm(part, axis=1)) for part in np.split(drawn, 2, 1))
    return float(np.degrees(turn)), float(shift)


if __name__ == "__main__":
    for outline in (False, True):
        angle_deg, shift_mm = median_error(bound(outline=outline))
        what = "outline included" if outline else "inside the outline"
        print(f"cube corner, {what}: median {angle_deg:.3f} deg, {1e3 * shift_mm:.2f} um at best")
