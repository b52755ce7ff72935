# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How far slope noise lets any method go: the Cramér-Rao bound of one step on a cube corner.

    python -m benchmarks.bound

Slopes of two touches carry independent noise, so no unbiased estimate of the motion has a smaller
covariance than ``2 s^2 inverse(J^T J)``, J being the change of the noiseless slopes with a twist,
here by central differences of whole touches. Where the contact's outline is not used, nobody knows
how the gel follows around it, but it stays a surface: of all changes of depth there that join those
inside, and are zero where the gel lies still, the one of least slope is as little as slopes around
can say.
"""

import argparse

import numpy as np
from jaxtyping import Bool, Float
from scipy import ndimage, sparse
from scipy.sparse.linalg import spsolve

from benchmarks.touches import MM_PER_PX, SLOPE_NOISE, cube_corner, pressed
from recon.pose.pyramid import still_window
from recon.pose.rigid import Covariance, motion

STEP_MM = 0.25 * MM_PER_PX[0]
LEVER_MM = 1.0
"""A turn by STEP_MM / LEVER_MM moves the contact's rim by about STEP_MM."""
DRAWN = 10_000


def bound(*, outline: bool) -> Covariance:
    """Of the twist (rad, mm) between two touches of the bench's cube corner.

    Args:
        outline: whether the pixels that the contact's outline crosses and those beyond count as
            they are; on a real gel a collar blurs them.
    """
    thing = cube_corner()
    still = pressed(thing, np.eye(4))
    used = np.ones_like(still.contact)
    if not outline:
        used = ndimage.binary_erosion(still.contact, np.ones((3, 3)))
    slopes, depths = [], []
    for axis in range(6):
        twist = np.zeros(6)
        twist[axis] = STEP_MM / (LEVER_MM if axis < 3 else 1.0)
        ahead, behind = (pressed(thing, motion(sign * twist)) for sign in (1, -1))
        apart = 2 * twist[axis]
        slopes.append((ahead.gradient - behind.gradient)[used].ravel() / apart)
        depths.append((ahead.depth_mm - behind.depth_mm) / apart)
    change = np.stack(slopes, -1).astype(float)
    information = change.T @ change
    if not outline:
        window = still_window(still.contact)
        information += _around(used[window], np.stack(depths, -1)[window].astype(float))
    covariance: Covariance = 2 * SLOPE_NOISE**2 * np.linalg.inv(information)
    return covariance


def _around(inside: Bool[np.ndarray, "h w"], change_mm: Float[np.ndarray, "h w 6"]) -> Covariance:
    """Products of the least slopes around that join changes of depth inside; zero at the border."""
    differences = [
        sparse.diags([1.0, -1.0], [0, -1], shape=(count + 1, count)) for count in inside.shape
    ]
    down = sparse.kron(differences[0], sparse.eye(inside.shape[1]))
    across = sparse.kron(sparse.eye(inside.shape[0]), differences[1])
    slope = sparse.vstack([down, across]).tocsr() / MM_PER_PX[0]
    known = inside.ravel()
    slope = slope[np.asarray(abs(slope[:, ~known]).sum(1)).ravel() > 0]  # those not all inside
    free = slope[:, ~known]
    fixed = slope[:, known] @ change_mm[inside]
    least = fixed - free @ spsolve((free.T @ free).tocsc(), free.T @ fixed)
    products: Covariance = least.T @ least
    return products


def median_error(covariance: Covariance) -> tuple[float, float]:
    """Median angle in degrees and median shift in mm of twists with that covariance."""
    drawn = np.random.default_rng(0).multivariate_normal(np.zeros(6), covariance, DRAWN)
    turn, shift = (np.median(np.linalg.norm(part, axis=1)) for part in np.split(drawn, 2, 1))
    return float(np.degrees(turn)), float(shift)


def main() -> None:
    """Work out and print."""
    argparse.ArgumentParser(prog="python -m benchmarks.bound", description=__doc__).parse_args()
    for outline in (False, True):
        angle_deg, shift_mm = median_error(bound(outline=outline))
        what = "outline included" if outline else "inside the outline"
        print(f"cube corner, {what}: median {angle_deg:.3f} deg, {1e3 * shift_mm:.2f} um at best")


if __name__ == "__main__":
    main()
