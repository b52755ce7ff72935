# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What calibrated sensors read off rendered presses, beside where the object holds the gel.

No formula for a sensor's errors knows what shade and light between the skin's folds do to its
slopes. Here the frames are traced, and the slopes are those of the estimators themselves, taught by
the sensor's balls.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Bool, Float32

from recon.arrays import ContactMask, DepthMap, GradientField
from recon.contact.disturbed import disturbed_mask
from recon.contact.network import network_input
from recon.estimators import GradientEstimator, fit_estimator, lesson_of
from recon.pipeline import Reconstruction, reconstruct
from recon.presses import read_presses
from recon.rendered_presses import RenderedPress, rendered_presses
from recon.training.chance import log_uniform
from recon.windows import window_about
from sensor.dataset import read_dataset
from sensor.errors import WedgeError

ESTIMATORS = ("mlp", "default")
EVERY = (1, 2)
"""An estimator is calibrated with every ball and with every second: its errors differ."""
MARGIN_PX = 16
DENTED = 0.03
"""Of the deepest point: what is deeper belongs to the press."""
SIZES, RESIZED = (0.65, 1.2), 0.6
"""How large presses are seen to how large they are, and what share of them: collars are as many
pixels long as the sensor is coarse."""
ASIDE_PX = 30
GAINS = (0.92, 1.08)


@dataclass(frozen=True, kw_only=True)
class FeltPress:
    """One press as one sensor measured it, cut to the dented gel."""

    depth_px: Float32[np.ndarray, "h w"]
    gradient: Float32[np.ndarray, "h w 2"]
    held: Bool[np.ndarray, "h w"]
    """Where the object touches, of the skin itself."""


def felt_presses(balls: Path, rendered: Sequence[Path], seed: int) -> Iterator[FeltPress]:
    """Each press as measured by every estimator; those that no colour tells of are left out.

    Args:
        balls: a dataset of labelled presses, by which the estimators are calibrated.
        rendered: datasets of the same sensor that know where the gel is held.
        seed: of the calibrations.

    Raises:
        WedgeError: a dataset cannot be used, or does not know where the gel is held.
    """
    sensors = list(_calibrated(balls, seed))
    for folder in rendered:
        for press, held in presses_that_show(folder):
            for touch in read_by(sensors, press):
                depth_px = touch.depth_mm / press.mm_per_px[0]
                yield _cut_to_what_is_dented(depth_px, touch.gradient, held)


def presses_that_show(folder: Path) -> Iterator[tuple[RenderedPress, ContactMask]]:
    """Presses of a rendered set that change a colour, and where each holds the gel.

    Raises:
        WedgeError: the set cannot be used, or does not know where the gel is held.
    """
    for press in rendered_presses(folder):
        if press.held is None:
            raise WedgeError(f"{folder} lacks held/{press.name}.npy: render the set anew.")
        if press.held.any() and disturbed_mask(press.difference).any():
            yield press, press.held


def read_by(sensors: Iterable[GradientEstimator], press: RenderedPress) -> Iterator[Reconstruction]:
    """What each calibrated sensor, whose lights show both slopes, makes of a press."""
    for sensor in sensors:
        yield reconstruct(
            press.difference, sensor, missing="none", lights_deg=None, mm_per_px=press.mm_per_px
        )


def seen_anew(
    rng: np.random.Generator, press: FeltPress, side_px: int
) -> tuple[Float32[np.ndarray, "4 side side"], Bool[np.ndarray, "side side"]]:
    """The network's input for a square of a press, resized and turned at random, and its truth."""
    if rng.random() < RESIZED:
        press = _resized(press, log_uniform(rng, *SIZES))
    place = _square_at_contact(rng, press.held, side_px)
    seen = network_input(press.depth_px[place], press.gradient[place])
    seen *= np.float32(rng.uniform(*GAINS))
    missing = [side_px - length for length in seen.shape[1:]]
    before = [int(rng.integers(more + 1)) for more in missing]
    beside = [(some, more - some) for some, more in zip(before, missing, strict=True)]
    return _turned(rng, np.pad(seen, [(0, 0), *beside]), np.pad(press.held[place], beside))


def _resized(press: FeltPress, share: float) -> FeltPress:
    """The press as a sensor of other pixels would see it."""
    height, width = press.held.shape
    size = max(2, round(width * share)), max(2, round(height * share))
    how = cv2.INTER_AREA if share < 1 else cv2.INTER_LINEAR
    depth, gradient, held = (
        np.asarray(cv2.resize(maps, size, interpolation=how))
        for maps in (press.depth_px, press.gradient, press.held.astype(np.float32))
    )
    return FeltPress(depth_px=depth * np.float32(share), gradient=gradient, held=held > 0.5)


def _calibrated(balls: Path, seed: int) -> Iterator[GradientEstimator]:
    labelled = read_presses(read_dataset(balls)).presses
    for name in ESTIMATORS:
        for step in EVERY:
            lesson = lesson_of(name, labelled, range(0, len(labelled), step), seed)
            yield fit_estimator(name, lesson, "RGB", seed)


def _cut_to_what_is_dented(
    depth_px: DepthMap, gradient: GradientField, held: ContactMask
) -> FeltPress:
    dented = held | (depth_px > DENTED * depth_px.max())
    rows, columns = window_about(dented, MARGIN_PX)
    return FeltPress(
        depth_px=depth_px[rows, columns].astype(np.float32),
        gradient=gradient[rows, columns].astype(np.float32),
        held=held[rows, columns].copy(),
    )


def _square_at_contact(
    rng: np.random.Generator, held: ContactMask, side_px: int
) -> tuple[slice, slice]:
    """A square about a pixel that is held, moved aside by chance; less where the map ends."""
    places = np.argwhere(held)
    middle = places[rng.integers(len(places))] if len(places) else np.array(held.shape) // 2
    corner = middle + rng.integers(-ASIDE_PX, ASIDE_PX + 1, 2) - side_px // 2
    first = np.clip(corner, 0, np.maximum(0, np.array(held.shape) - side_px))
    rows, columns = (slice(int(at), int(at) + side_px) for at in first)
    return rows, columns


def _turned(
    rng: np.random.Generator, maps: np.ndarray, truth: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """One of the eight ways that a square can lie; slopes turn along."""
    for axis in (0, 1):
        if rng.random() < 0.5:
            maps, truth = np.flip(maps, 2 - axis).copy(), np.flip(truth, 1 - axis)
            maps[axis] *= -1
    if rng.random() < 0.5:
        maps, truth = maps.transpose(0, 2, 1)[[1, 0, *range(2, len(maps))]], truth.T
    return np.ascontiguousarray(maps), np.ascontiguousarray(truth)
