# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A labelled press by the path that a user's frame takes: whoever judges, judges this.

What dots hide is filled again from slopes around them, as ``recon.pipeline.Reconstructor`` does,
but rounded alike whatever was filled before, so that tables do not depend on what runs them.
"""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float32

from recon.arrays import GradientField
from recon.depth import beneath_dots, of_moved_gel
from recon.estimators import GradientEstimator, as_labelled, gradient_field, slopes_at
from recon.lights import unseen_axis
from recon.pipeline import Reconstruction, disturbed_in, reconstruct
from recon.pixels import BallPress, Pixels
from sensor.unit import MissingAxis

Slopes = Float32[np.ndarray, "n 2"]


def reconstruct_press(
    press: BallPress,
    estimator: GradientEstimator,
    missing: MissingAxis,
    lights_deg: Mapping[str, float] | None,
) -> Reconstruction:
    """Gradients, depth and contact of one press.

    Args:
        press: as it was read.
        estimator: fitted for some channels.
        missing: what stands in for a gradient that those channels' lights cannot see.
        lights_deg: where the lights sit; ``None`` where nobody said.
    """
    return reconstruct(
        press.difference,
        estimator,
        missing=missing,
        lights_deg=lights_deg,
        mm_per_px=press.mm_per_px,
        hidden=press.hidden,
    )


def slopes_in(found: Reconstruction, estimator: GradientEstimator, pixels: Pixels) -> Slopes:
    """Gradients (mm/mm) of some pixels of a reconstructed press, as their labels mean them."""
    return _at(pixels, found.gradient, estimator)


def slopes_of(
    estimator: GradientEstimator,
    press: BallPress,
    pixels: Pixels,
    missing: MissingAxis,
    lights_deg: Mapping[str, float] | None,
) -> Slopes:
    """The same of a press not yet reconstructed; depth and the rest only where it matters."""
    unseen = unseen_axis(lights_deg, estimator.channels)
    if missing == "network" and unseen is not None:
        found = reconstruct_press(press, estimator, missing, lights_deg)
        return slopes_in(found, estimator, pixels)
    if estimator.reach is not None or press.hidden is not None:
        gradient = gradient_field(estimator, press.difference)
        if press.hidden is not None:
            pitch_mm = press.mm_per_px
            gradient = beneath_dots(gradient, press.hidden, unseen, pitch_mm)
        disturbed = disturbed_in(press.difference, estimator)
        gradient = of_moved_gel(gradient, disturbed, estimator, missing, unseen)
        return _at(pixels, gradient, estimator)
    slopes = slopes_at(estimator, press.difference, pixels)
    if missing == "zero" and unseen:
        slopes[:, "xy".index(unseen)] = 0
    return slopes


def _at(pixels: Pixels, gradient: GradientField, estimator: GradientEstimator) -> Slopes:
    return as_labelled(estimator, gradient.reshape(-1, 2)[pixels.place], pixels)
