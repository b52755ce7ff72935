# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How far off poses are in units of what trackers say, for errors of slopes that are alike or not.

    python -m benchmarks.pose_doubt

Steps of 2.5 degrees and 0.2 mm. Slopes have errors of one size at each pixel, white or smoothed by
a Gaussian. Given is the mean squared error over the covariance that is stated, over 6: 1 where the
covariance is right, and 4 where errors are twice as large as is said.
"""

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from statistics import fmean

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter

from benchmarks.touches import (
    SLOPE_NOISE,
    SyntheticTouch,
    Thing,
    bead,
    cube_corner,
    motions,
    pressed,
    shallow_texture,
)
from recon.arrays import GradientField
from recon.integration.poisson import integrate
from recon.pose.registration import Registration
from recon.pose.rigid import Covariance, Transform, Twist, inverse, turn_and_shift
from recon.pose.tracker import REGISTRATIONS

LENGTHS_PX = (0.0, 2.0, 4.0, 8.0)
"""Standard deviations of the Gaussian."""
MOTIONS, STEPS = 8, 24
SEED = 7


@dataclass(frozen=True, kw_only=True)
class Step:
    """Two touches without errors, and how the object has moved between them."""

    first: SyntheticTouch
    second: SyntheticTouch
    moved: Transform


def smooth_noise(
    rng: np.random.Generator, shape: tuple[int, int], length_px: float
) -> GradientField:
    """Errors (h, w, 2) of variance 1 at each pixel, independent along x and y."""
    noise = rng.standard_normal((*shape, 2))
    if not length_px:
        return noise
    impulse = np.zeros(shape)
    impulse[0, 0] = 1
    energy = float((gaussian_filter(impulse, length_px, mode="wrap") ** 2).sum())
    return gaussian_filter(noise, (length_px, length_px, 0), mode="wrap") / np.sqrt(energy)


def with_errors(exact: SyntheticTouch, errors: GradientField) -> SyntheticTouch:
    """The touch as it would be reconstructed, its contact being told by colour."""
    gradient = exact.gradient + errors
    depth = integrate(gradient, exact.mm_per_px, exact.boundary)
    return replace(exact, gradient=gradient.astype(np.float32), depth_mm=depth.astype(np.float32))


def steps_of(thing: Thing) -> list[Step]:
    """Steps of one object, all from the same touch."""
    first = pressed(thing, np.eye(4))
    moves = motions(np.random.default_rng(SEED), MOTIONS)
    return [Step(first=first, second=pressed(thing, moved), moved=moved) for moved in moves]


def errors_of(
    registration: Registration, steps: Sequence[Step], length_px: float, count: int
) -> Iterator[tuple[Twist, Covariance]]:
    """Twists by which poses are off, and their covariances."""
    rng = np.random.default_rng(0)
    for number in range(count):
        step = steps[number % len(steps)]
        first, second = (
            registration.prepare(
                with_errors(exact, SLOPE_NOISE * smooth_noise(rng, exact.contact.shape, length_px))
            )
            for exact in (step.first, step.second)
        )
        found = registration.align(first, second, np.eye(4))
        left = inverse(step.moved) @ found.T_current_reference
        yield turn_and_shift(left), found.covariance


def square(twist: Twist, covariance: Covariance) -> float:
    """Squared error in units of the covariance, over 6."""
    return float(twist @ np.linalg.solve(covariance, twist)) / 6


def by_axis(
    found: Sequence[tuple[Twist, Covariance]],
) -> Float[np.ndarray, "6"]:
    """Mean squared error along each axis in units of its stated variance."""
    squares: Float[np.ndarray, 6] = np.mean(
        [twist**2 / np.diag(covariance) for twist, covariance in found], axis=0
    )
    return squares


def main() -> None:
    """Measure and print."""
    argparse.ArgumentParser(
        prog="python -m benchmarks.pose_doubt", description=__doc__
    ).parse_args()
    print("object | errors | " + " | ".join(f"{name}, worst axis" for name in REGISTRATIONS))
    for thing in (cube_corner(), shallow_texture(), bead()):
        steps = steps_of(thing)
        for length_px in LENGTHS_PX:
            cells = []
            for registration in REGISTRATIONS.values():
                found = list(errors_of(registration, steps, length_px, STEPS))
                mean = fmean(square(*item) for item in found)
                cells.append(f"{mean:.2f}, {by_axis(found).max():.2f}")
            kind = f"alike over {length_px:g} px" if length_px else "white"
            print(f"{thing.name} | {kind} | " + " | ".join(cells), flush=True)


if __name__ == "__main__":
    main()
