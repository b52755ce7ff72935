# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What a calibrated sensor with one light, two opposite ones or all would measure of a surface.

Networks that complete a gradient field learn from it. Noise alone would not do: a single light
saturates on steep skin, darkens skin that tilts either way, and an estimator calibrated on balls
answers every colour with the mean slope of the ball's pixels that had it. So each frame draws a
sensor, shades a ball with it, fits slope to colour as a calibration does, and applies that fit to
the shaded surface. Of the axis across the lights nothing is reported: the hint of an estimator
that looks around each pixel comes in later (``recon.depth``), and what others say is worse than
silence (docs/decisions/0010-missing-axis.md).

Light along y; ``gradient`` is (h, w, 2) px/px.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float32
from scipy import ndimage

from recon.training.chance import log_uniform

Gradient = Float32[np.ndarray, "*place 2"]
Colors = Float32[np.ndarray, "*place lights"]
Map = Float32[np.ndarray, "h w"]

SENSORS = {1: 0.4, 2: 0.35, 3: 0.25}
"""Shares of frames by number of lights; three see both axes."""
PLAIN_SHARE = 0.4  # of the third kind: white noise on one axis, nothing of the other, as in theory
GATED_SHARE = 0.7  # of all frames: what lies outside the disturbed gel is known to be flat
DOTS_SHARE = 0.45
CALIBRATION_PX = 600
"""Pixels that a calibration is fitted to."""
BINS = 48


@dataclass(frozen=True, kw_only=True)
class Measured:
    """What a sensor says of a surface."""

    gradient: Gradient
    support: Bool[np.ndarray, "h w"]
    """Where the gel may have moved, as far as the sensor knows."""
    both: bool
    """Whether it saw the x gradient; else that is zero."""


def measure(rng: np.random.Generator, gradient: Gradient) -> Measured:
    """The gradient field as one random sensor of random lights would measure it."""
    lights = int(rng.choice(list(SENSORS), p=list(SENSORS.values())))
    if lights == 3:
        both = rng.random() >= PLAIN_SHARE
        measured, change, grain = _with_noise(rng, gradient)
        if not both:
            measured[..., 0] = 0
    else:
        both = False
        measured, change, grain = _seen_by(rng, gradient, lights)
    support = np.ones(change.shape, bool)
    if rng.random() < GATED_SHARE:
        support = _disturbed(change, max(grain, rng.uniform(0.02, 0.05)))
    return Measured(
        gradient=np.asarray(measured * support[..., None], np.float32), support=support, both=both
    )


@dataclass(frozen=True, kw_only=True)
class _Sensor:
    """A random sensor with lights at one azimuth along y, or at two opposite ones."""

    azimuths: Float32[np.ndarray, " lights"]
    """Where the lights come from, in radians."""
    elevation: float
    sky: float
    """Light from straight above, which tilted skin loses whichever way it tilts."""
    compression: float
    noise: float
    """Of a pixel's colour."""
    stain: float
    """Of what drifts across the frame."""

    @classmethod
    def drawn(cls, rng: np.random.Generator, lights: int) -> "_Sensor":
        first = rng.choice([-90, 90]) + rng.normal(0, 7)
        azimuths = first + np.array([0.0, 180 + rng.normal(0, 5)])[:lights]
        return cls(
            azimuths=np.radians(azimuths).astype(np.float32),
            elevation=np.radians(rng.uniform(8, 50)),
            sky=rng.uniform(0, 0.4),
            compression=log_uniform(rng, 0.4, 8.0),
            noise=log_uniform(rng, 0.005, 0.05),
            stain=rng.uniform(0, 0.03),
        )

    def colors(self, gradient: Gradient) -> Colors:
        """Change of each light's colour against flat skin: Lambert, shadow, saturation."""
        along, up = np.cos(self.elevation), np.sin(self.elevation)
        facing = 1 / np.sqrt(1 + np.square(gradient).sum(-1, keepdims=True))
        toward = np.stack([np.cos(self.azimuths), np.sin(self.azimuths)])  # depth rises away
        lit = np.maximum((up - along * (gradient @ toward)) * facing, 0) - up
        change = lit + np.float32(self.sky) * (facing - 1)
        return np.asarray(np.tanh(self.compression * change) / self.compression, np.float32)


def _seen_by(
    rng: np.random.Generator, gradient: Gradient, lights: int
) -> tuple[Gradient, Map, float]:
    """The y gradient of one or two lights, how far the colour changed, and how much is noise."""
    sensor = _Sensor.drawn(rng, lights)
    height, width = gradient.shape[:2]
    slope_of = _calibrated(rng, sensor, lights)
    colors = sensor.colors(gradient)
    blur_px = rng.uniform(0, 1.5)
    if blur_px > 0.4:
        colors = cv2.GaussianBlur(colors, (0, 0), blur_px).reshape(height, width, lights)
    colors += np.float32(sensor.noise) * rng.standard_normal(colors.shape, np.float32)
    stain = _drift(rng, height, width, log_uniform(rng, 2.0, min(height, width) / 4))
    colors += np.float32(sensor.stain) * stain[..., None] * rng.choice([-1, 1], lights)
    if rng.random() < DOTS_SHARE:
        colors += _moved_dots(rng, height, width)[..., None]
    change = np.abs(cv2.GaussianBlur(colors, (0, 0), 2)).reshape(height, width, lights).max(-1)
    gain = 1 + rng.uniform(0, 0.15) * _drift(rng, height, width, min(height, width) / 5)
    measured = np.zeros_like(gradient)
    measured[..., 1] = slope_of(colors) * rng.uniform(0.85, 1.12) * gain
    return measured, change, 4 * float(np.hypot(sensor.noise / 5, sensor.stain))


class _SlopeOfColor:
    """Mean y slope of a ball's pixels by colour: a polynomial of degree 4 or 5, tabulated."""

    def __init__(self, colors: Colors, slopes: Float32[np.ndarray, " n"]) -> None:
        self.low, self.high = colors.min(0), colors.max(0)
        terms = self._terms(colors)
        ridge = 1e-3 * np.eye(terms.shape[1])
        fitted = np.linalg.solve(terms.T @ terms + ridge, terms.T @ slopes)
        along = [np.linspace(*ends, BINS) for ends in zip(self.low, self.high, strict=True)]
        grid = np.stack(np.meshgrid(*along), -1).reshape(-1, len(along))
        values = (self._terms(grid) @ fitted).reshape(-1, BINS).astype(np.float32)
        self.table = values if len(along) == 2 else np.repeat(values, 2, axis=0)

    def __call__(self, colors: Colors) -> Map:
        scale = np.float32(BINS - 1) / (self.high - self.low)
        places = np.clip((colors - self.low) * scale, 0, BINS - 1).astype(np.float32)
        row = places[..., 1] if places.shape[-1] == 2 else np.zeros_like(places[..., 0])
        return np.asarray(cv2.remap(self.table, places[..., 0], row, cv2.INTER_LINEAR), np.float32)

    def _terms(self, colors: Colors) -> np.ndarray:
        scaled = (2 * (colors - self.low) / (self.high - self.low) - 1).astype(float)
        first = np.vander(scaled[:, 0], 6 if scaled.shape[1] == 1 else 5, increasing=True)
        if scaled.shape[1] == 1:
            return first
        second = np.vander(scaled[:, 1], 5, increasing=True)
        pairs = [first[:, i] * second[:, j] for i in range(5) for j in range(5 - i)]
        return np.stack(pairs, -1)


def _calibrated(rng: np.random.Generator, sensor: _Sensor, lights: int) -> _SlopeOfColor:
    """Slope by colour, fitted to a ball's pixels and to untouched ones."""
    of_radius = np.sqrt(rng.uniform(0, 1, CALIBRATION_PX)) * rng.uniform(0.6, 0.92)
    angle = rng.uniform(0, 2 * np.pi, CALIBRATION_PX)
    steepness = of_radius / np.sqrt(1 - of_radius**2)
    gradient = np.stack([steepness * np.cos(angle), steepness * np.sin(angle)], -1)
    gradient[: int(rng.uniform(0.2, 0.75) * CALIBRATION_PX)] = 0
    colors = sensor.colors(gradient.astype(np.float32))
    noise = np.hypot(sensor.noise, sensor.stain) * rng.standard_normal((CALIBRATION_PX, lights))
    return _SlopeOfColor(colors + noise.astype(np.float32), gradient[:, 1].astype(np.float32))


def _with_noise(rng: np.random.Generator, gradient: Gradient) -> tuple[Gradient, Map, float]:
    """Both gradients with white and drifting noise and a false gain."""
    height, width = gradient.shape[:2]
    longest = min(height, width) / 4
    drift = np.stack(
        [_drift(rng, height, width, log_uniform(rng, 2.0, longest)) for _ in range(2)], -1
    )
    white = np.array([log_uniform(rng, 0.005, 0.07) for _ in range(2)], np.float32)
    measured = gradient * rng.uniform(0.88, 1.1, 2).astype(np.float32)
    measured += white * rng.standard_normal(gradient.shape, np.float32)
    measured += rng.uniform(0, 0.03, 2).astype(np.float32) * drift
    change = cv2.GaussianBlur(np.abs(measured).max(-1), (0, 0), 2)
    return measured, np.asarray(change, np.float32), 3 * float(white.max())


def _disturbed(change: Map, least: float) -> Bool[np.ndarray, "h w"]:
    """Where the colour changed, holes filled, and a little around it."""
    filled = ndimage.binary_fill_holes(change > least).astype(np.uint8)
    widened = cv2.dilate(filled, np.ones((3, 3), np.uint8), iterations=3)
    return np.asarray(widened, bool)


def _drift(rng: np.random.Generator, height: int, width: int, wavelength_px: float) -> Map:
    """Smooth noise of standard deviation 1 that varies over some pixels."""
    step = max(1, int(wavelength_px))
    coarse = rng.standard_normal((height // step + 4, width // step + 4), np.float32)
    smooth = cv2.GaussianBlur(coarse, (0, 0), 1.0)
    size = (width + 4 * step, height + 4 * step)
    fine = cv2.resize(smooth, size)[2 * step : 2 * step + height, 2 * step : 2 * step + width]
    return np.asarray(fine / max(float(fine.std()), 1e-6), np.float32)


def _moved_dots(rng: np.random.Generator, height: int, width: int) -> Map:
    """Printed markers that moved with the gel: dark where they are, bright where they were."""
    y, x = np.mgrid[:height, :width].astype(np.float32)
    pitch, radius = rng.uniform(12, 26), rng.uniform(1.2, 3.0)
    first, moved = rng.uniform(0, pitch, 2), rng.uniform(-2.0, 2.0, 2)

    def dots(shift: np.ndarray) -> Map:
        across, down = ((at - s) % pitch - pitch / 2 for at, s in zip((x, y), shift, strict=True))
        return np.asarray(across**2 + down**2 < radius**2, np.float32)

    share = rng.uniform(0, 1, (3, 4)).astype(np.float32)
    strength: Map = np.asarray(cv2.resize(share, (width, height)), np.float32)
    picture = (dots(first + moved) - dots(first)) * rng.uniform(0.15, 0.7) * strength
    return np.asarray(cv2.GaussianBlur(-picture, (0, 0), 0.7), np.float32)
