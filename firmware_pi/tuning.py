# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""From frames of the blank gel to white-balance gains and exposure.

Runs on the computer, with numpy; the Pi only takes the settings that come out of it.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from firmware_pi.settings import US_PER_S, Settings
from sensor.errors import WedgeError

BRIGHTEST = 0.45
"""Where the brightest thousandth of the blank pad is to lie, in linear light of full scale. A press
makes it up to 2.1 times brighter (56 pressed frames of a lab's Wedge), which must still fit."""
BRIGHTEST_QUANTILE = 0.999
SATURATED_CODE = 254
SETTLED = 0.03
"""A change by less than this is not worth another run."""
FLICKER_SHARE = 0.01
"""Flicker or banding above this share of the light is remarked upon. The first eight frames of six
clips of a lab's Wedge vary by 0.2 % to 1.1 %."""
FRAME_SHARE = 0.98
"""An exposure leaves this much of the time between two frames to the sensor's read-out."""
GAINS = (1.0, 8.0)
"""Below 1, the Pi's image processing would raise the other colours instead."""
ANALOGUE_MOST = 16.0

Mask = NDArray[np.bool_]


def _linear() -> NDArray[np.float32]:
    """Light of full scale by 8-bit code, by the sRGB curve (IEC 61966-2-1).

    A Pi's own curve differs a little; a second run, with the new settings, makes up for that.
    """
    code = np.arange(256) / 255
    light = np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)
    return light.astype(np.float32)


LINEAR = _linear()


@dataclass(frozen=True, kw_only=True)
class Blank:
    """What frames of the blank gel say, each triple in the order R, G, B.

    Light is linear, in shares of full scale.
    """

    frames: int
    mean: tuple[float, float, float]
    """Of the pad, over all frames."""
    brightest: tuple[float, float, float]
    """Its brightest thousandth."""
    saturated: tuple[float, float, float]
    """Share of pixels at the upper end, which say nothing of the light any more."""
    flicker: float | None
    """How the mean varies from frame to frame, without its trend: rms over mean, of the worst
    colour; None for fewer than three frames."""
    banding: float | None
    """How rows vary from frame to frame, beyond the whole frame: rms over mean, of the worst
    colour. A lamp that is dimmed by switching, or room light, does that."""
    drift: float | None
    """Change of the mean from the first frame to the last, of the worst colour."""


def measure_blank(images: Iterable[NDArray[np.uint8]], pad: Mask | None = None) -> Blank:
    """Measure frames of the blank gel.

    Args:
        images: (h, w, 3) uint8 RGB, all of one size, in the order they were taken.
        pad: (h, w), true on the gel; everything by default.

    Raises:
        WedgeError: there is no frame, they differ in size, or the pad lies outside.
    """
    means: list[NDArray[np.float64]] = []
    rows: list[NDArray[np.float64]] = []
    counts = np.zeros((3, 256), np.int64)
    inside: Mask | None = pad
    for image in images:
        if inside is None:
            inside = np.ones(image.shape[:2], bool)
        if image.shape[:2] != inside.shape:
            raise WedgeError(
                f"a frame is {_size(image.shape)}, but {_size(inside.shape)} was expected: use"
                " frames of one size, and of the unit's size if a unit is given."
            )
        if not inside.any():
            raise WedgeError("the pad lies outside the frame: give another unit, or none.")
        light = LINEAR[image]
        light[~inside] = 0
        pixels = inside.sum(axis=1)
        lit = pixels > 0
        sums = light[lit].sum(axis=1, dtype=np.float64)
        rows.append(sums / pixels[lit, None])
        means.append(sums.sum(axis=0) / pixels.sum())
        for channel in range(3):
            counts[channel] += np.bincount(image[..., channel][inside], minlength=256)
    if not means:
        raise WedgeError("there is no frame to measure: give a folder of frames or a stream.")
    return _blank(np.array(means), np.array(rows), counts)


def _blank(
    means: NDArray[np.float64], rows: NDArray[np.float64], counts: NDArray[np.int64]
) -> Blank:
    """The measures of n frames, from their means (n, 3), row means (n, h, 3) and histograms."""
    n = len(means)
    mean = means.mean(axis=0)
    shares = counts.cumsum(axis=1) / counts.sum(axis=1, keepdims=True)
    brightest = LINEAR[(shares >= BRIGHTEST_QUANTILE).argmax(axis=1)]
    saturated = counts[:, SATURATED_CODE:].sum(axis=1) / counts.sum(axis=1)
    flicker = banding = drift = None
    if n >= 3 and (mean > 0).all():
        time = np.linspace(-1, 1, n)
        slope = time @ means / (time @ time)
        rest = means - mean - time[:, None] * slope
        drift = float(np.abs(2 * slope / mean).max())
        flicker = float((np.sqrt((rest**2).mean(axis=0)) / mean).max())
        beyond = rows - rows.mean(axis=0) - (means - mean)[:, None]
        banding = float((np.sqrt((beyond**2).mean(axis=(0, 1))) / mean).max())
    return Blank(
        frames=n,
        mean=_triple(mean),
        brightest=_triple(brightest),
        saturated=_triple(saturated),
        flicker=flicker,
        banding=banding,
        drift=drift,
    )


@dataclass(frozen=True)
class Tuned:
    """The settings that follow from a measurement, and what a person should know."""

    settings: Settings
    remarks: tuple[str, ...]
    settled: bool
    """Whether the new settings are the old ones but for a hair, and make the gel as bright as it
    should be."""


def tune(settings: Settings, blank: Blank) -> Tuned:
    """Settings under which the blank gel is grey and its brightest part where it should be.

    Args:
        settings: Those under which the frames were taken.
        blank: What the frames say.

    Raises:
        WedgeError: the frames are black in a colour, so that no gain can be found.
    """
    red, green, blue = blank.mean
    if min(blank.mean) < 1e-3:
        raise WedgeError(
            "the frames are black in at least one colour: switch on all lights and, if "
            "mjpg_streamer provides the frames, give it both gains."
        )
    remarks = []
    gains = []
    for name, gain, level in (
        ("red", settings.red_gain, red),
        ("blue", settings.blue_gain, blue),
    ):
        wanted = gain * green / level
        gains.append(float(np.clip(wanted, *GAINS)))
        if abs(gains[-1] - wanted) > SETTLED * wanted:
            remarks.append(
                f"{name} would need a gain of {wanted:.2f}, outside {GAINS[0]:g} to {GAINS[1]:g}: "
                f"change the resistor of the {name} LEDs."
            )
    after = np.array([gains[0] / settings.red_gain, 1.0, gains[1] / settings.blue_gain])
    brightest = float((np.array(blank.brightest) * after).max())
    total = settings.exposure_us * settings.analogue_gain * BRIGHTEST / brightest
    longest = FRAME_SHARE * US_PER_S / settings.rate_hz
    exposure_us = int(min(max(total, 30), longest, 66_666))
    analogue = float(np.clip(total / exposure_us, 1.0, ANALOGUE_MOST))
    lacking = total / (exposure_us * analogue)
    if lacking > 1 + SETTLED:
        remarks.append(
            f"the picture stays {lacking:.1f} times too dark at full exposure and gain: raise the "
            "current of the LEDs."
        )
    elif lacking < 1 - SETTLED:
        remarks.append(
            f"the picture stays {1 / lacking:.1f} times too bright at the shortest exposure without"
            " gain: lower the current of the LEDs."
        )
    tuned = replace(
        settings,
        red_gain=round(gains[0], 3),
        blue_gain=round(gains[1], 3),
        exposure_us=exposure_us,
        analogue_gain=round(analogue, 3),
    )
    before, now = _light(settings), _light(tuned)
    same = bool((np.abs(now / before - 1) < SETTLED).all())
    return Tuned(tuned, (*remarks, *_remarks(blank)), same and abs(lacking - 1) <= SETTLED)


def pad_mask(corners_px: Iterable[tuple[float, float]], height: int, width: int) -> Mask:
    """The pixels within a convex outline, (height, width).

    Args:
        corners_px: (x, y) of each corner, in order around the outline either way.
        height: Of the frame.
        width: Of the frame.
    """
    corners = np.array(list(corners_px))
    y, x = np.mgrid[:height, :width]
    sides = [
        (bx - ax) * (y - ay) - (by - ay) * (x - ax)
        for (ax, ay), (bx, by) in zip(corners, np.roll(corners, -1, axis=0), strict=True)
    ]
    return np.all([side >= 0 for side in sides], axis=0) | np.all(
        [side <= 0 for side in sides], axis=0
    )


def _light(settings: Settings) -> NDArray[np.float64]:
    """What the settings make of light, for R, G and B."""
    gains = np.array([settings.red_gain, 1.0, settings.blue_gain])
    return gains * settings.exposure_us * settings.analogue_gain


def _remarks(blank: Blank) -> list[str]:
    remarks = []
    if max(blank.saturated) > 1e-3:
        remarks.append(
            f"{max(blank.saturated):.1%} of one colour is saturated, so its brightness is unknown: "
            "run again with the new settings."
        )
    for share, what, remedy in (
        (
            blank.flicker,
            "flickers",
            "check that the LEDs' supply is steady and nothing automatic is on",
        ),
        (
            blank.banding,
            "has moving bands",
            "keep room light out, and do not dim the LEDs by switching; an exposure of 10000 us "
            "(mains of 50 Hz) or 8333 us (60 Hz) hides the flicker of lamps",
        ),
    ):
        if share is not None and share > FLICKER_SHARE:
            remarks.append(f"the light {what} by {share:.1%}: {remedy}.")
    if blank.drift is not None and blank.drift > SETTLED:
        remarks.append(
            f"the light drifted by {blank.drift:.1%}: let the LEDs warm up, and check that "
            "nothing automatic is on."
        )
    return remarks


def _triple(values: NDArray[np.float64] | NDArray[np.float32]) -> tuple[float, float, float]:
    red, green, blue = (float(value) for value in values)
    return red, green, blue


def _size(shape: tuple[int, ...]) -> str:
    return f"{shape[1]} x {shape[0]}"
