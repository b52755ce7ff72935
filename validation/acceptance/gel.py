# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The gel that nothing touches: its noise, its drift, its light, its wear, and where it serves."""

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import Float, Float64

from recon.arrays import ContactMask, Difference, Unwarped
from recon.brightness import inner
from recon.labels.capture import SATURATED_LEVEL
from recon.lights import channel_indices
from recon.medians import PER_MAD
from recon.pixels import BallPress, label_pixels
from validation.acceptance.lights import Response
from validation.acceptance.limits import Parts
from validation.lighting import GRAY_LEVELS

UNTOUCHED_FROM = 3.0
"""Contact radii: beyond, the gel is untouched."""
GRAIN_PX = 1.5
SMOOTHING_PX = 3.0
LIT = 0.06
"""Of full scale: the brightest colour of a lit pixel."""
SATURATED = (SATURATED_LEVEL - 0.5) / GRAY_LEVELS
WORN = 0.1
"""Of full scale: a blank gel's pixel that differs from its surroundings by this is no gel."""
SURROUNDINGS_PX = 36
REACH = 1.5
"""Contact radii about a press, of which its errors speak."""
KNOWN_SLOPE = 0.05
"""mm/mm, 3°: to this noise alone must leave a pixel's slope."""
LEAST_NOISE = 0.29 / GRAY_LEVELS
"""Of rounding to whole grey levels."""


def of_one_frame(blanks: int) -> float:
    """What noise of one frame is of the noise of its difference to a mean of blank ones."""
    return (1 + 1 / blanks) ** -0.5


def as_seen(press: BallPress) -> Difference:
    """A press's difference image, in the light that the camera saw."""
    if press.blank is None or press.light == (1, 1, 1):
        return press.difference
    return (press.difference + press.blank) * np.array(press.light, np.float32) - press.blank


def noise_of(press: BallPress, flat: ContactMask) -> Float[np.ndarray, " 3"]:
    """Standard deviation of each colour where nothing touches, 0 to 1, without slow changes.

    A median, which a few outliers do not move. What smoothing leaves of white noise is added again:
    the difference to a Gaussian of s pixels keeps 1 - 3 / (4 pi s^2) of its variance.
    """
    grain = press.difference - smooth(press.difference, GRAIN_PX)
    kept = np.sqrt(1 - 0.75 / (np.pi * GRAIN_PX**2))
    return np.asarray(PER_MAD / kept * np.median(np.abs(grain[flat]), axis=0))


def stillness(presses: Sequence[BallPress], channels: str, blanks: int) -> dict[str, Parts]:
    """Noise of a frame and drift of the gel that no press reaches, each colour's.

    Args:
        presses: whose differences are looked at.
        channels: the colours with a light.
        blanks: frames whose mean is the blank one.

    Returns:
        Grey levels of 255, by the names of the limits; nothing where presses reach everywhere.
    """
    noise, drift = [], []
    for press in presses:
        flat = untouched(press)
        if flat.any():
            noise.append(noise_of(press, flat))
            drift.append(np.abs(np.median(as_seen(press)[flat], axis=0)))
    if not noise:
        return {}
    return {
        "noise_gray_levels": _by_color(
            GRAY_LEVELS * of_one_frame(blanks) * np.mean(noise, axis=0), channels
        ),
        "drift_gray_levels": _by_color(GRAY_LEVELS * np.quantile(drift, 0.9, axis=0), channels),
    }


def blank_values(gel: Unwarped, channels: str) -> dict[str, Parts]:
    """What the blank gel shows: evenness and balance of the lights, lit area, wear.

    Args:
        gel: today's, without its dots.
        channels: the colours with a light.
    """
    inside = gel[inner(gel.shape)]
    even = smooth(inside, SMOOTHING_PX)
    low, high = np.quantile(even.reshape(-1, 3), [0.02, 0.98], axis=0)
    means = even.mean((0, 1))
    lit = channel_indices(channels)
    values: dict[str, Parts] = {
        "evenness_share": _by_color(low / np.maximum(high, 1e-6), channels),
        "lit_share": {"": float((even.max(-1) > LIT).mean())},
        "worn_share": {"": float(worn_skin(gel)[inner(gel.shape)].mean())},
    }
    if len(channels) > 1:
        weakest, strongest = means[lit].min(), means[lit].max()
        values["color_balance_share"] = {"": float(weakest / max(strongest, 1e-6))}
    return values


def saturation(presses: Sequence[BallPress], blank: Unwarped, channels: str) -> Parts:
    """Share of the contact pixels of all presses at which each colour is saturated."""
    shares = []
    for index, press in enumerate(presses):
        pixels = label_pixels(press, index, 0)
        seen = (as_seen(press) + blank).reshape(-1, 3)[pixels.place[pixels.contact]]
        shares.append((seen >= SATURATED).mean(0))
    return _by_color(np.mean(shares, axis=0), channels)


def worn_skin(gel: Unwarped) -> ContactMask:
    """Where the blank gel differs from its surroundings."""
    surface = cv2.medianBlur(np.ascontiguousarray(gel), 5)
    about = cv2.blur(surface, (SURROUNDINGS_PX, SURROUNDINGS_PX))
    return np.asarray(np.abs(surface - about).max(-1) > WORN)


def usable_area(
    gel: Unwarped, response: Response, noise: Parts, axes: str, channels: str
) -> ContactMask:
    """Where slopes stand out of the noise, and nothing is saturated or worn.

    A colour's answer to slope is taken to grow with the blank gel's brightness in it. Noise that is
    independent from colour to colour leaves slopes with the covariance ``(S' W S)^-1``, where S are
    the answers and W the inverse variances (weighted least squares).

    Args:
        gel: blank, without its dots.
        response: of the colours to slope, on average over the pad.
        noise: of each colour's differences, grey levels.
        axes: those that the lights see, "xy", "x" or "y".
        channels: the colours with a light.
    """
    even = smooth(gel, SMOOTHING_PX)
    relative = even / np.maximum(even[inner(gel.shape)].mean((0, 1)), 1e-6)
    xx, yy, xy = (np.zeros(gel.shape[:2]) for _ in range(3))
    for channel in channels:
        index = "RGB".index(channel)
        per_noise = 1 / max(noise[channel] / GRAY_LEVELS, LEAST_NOISE)
        weight = (per_noise * relative[..., index].astype(float)) ** 2
        along_x, along_y = response.slopes[index]
        xx, yy, xy = (
            xx + weight * along_x**2,
            yy + weight * along_y**2,
            xy + weight * along_x * along_y,
        )
    if axes == "xy":
        determinant = np.maximum(xx * yy - xy**2, 1e-12)
        variance = np.maximum(xx, yy) / determinant
    else:
        variance = 1 / np.maximum(xx if axes == "x" else yy, 1e-12)
    clean = (gel[..., channel_indices(channels)] < SATURATED).all(-1) & ~worn_skin(gel)
    return np.asarray((variance <= KNOWN_SLOPE**2) & (even.max(-1) > LIT) & clean)


def covered_area(presses: Sequence[BallPress]) -> ContactMask:
    """Where the pad lies near a press."""
    covered = np.zeros(presses[0].difference.shape[:2], bool)
    for press in presses:
        covered |= press.distance_mm < REACH * press.contact_radius_mm
    return covered


def smooth(image: Difference, sigma_px: float) -> Difference:
    """A Gaussian."""
    return cv2.GaussianBlur(image, (0, 0), sigma_px)


def untouched(press: BallPress) -> ContactMask:
    """Where a press does not reach, and no dot hides the gel."""
    flat = press.distance_mm > UNTOUCHED_FROM * press.contact_radius_mm
    return flat if press.hidden is None else flat & ~press.hidden


def _by_color(values: Float64[np.ndarray, "3"] | np.ndarray, channels: str) -> Parts:
    return {channel: float(values["RGB".index(channel)]) for channel in channels}
