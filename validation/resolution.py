# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The finest thread that a gel still shows, bare or under a glove.

Parallel round threads are pressed into the twin's skin and photographed. A pitch is resolved where
the brightness repeats with it: its amplitude stands out from those of the frequencies beside it.
"""

import io
from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Float
from PIL import Image

from simulation.camera import CameraModel, expose, photograph
from simulation.dataset import Recipe, trace_part
from simulation.indenters import Indenter, thread_rod
from simulation.presses import Press, skin_under
from simulation.render import smoothed

SIZE_MM = 6.0
"""Side of the comb of threads."""
WINDOW_MM = 4.0
"""Side of its middle, which is looked at."""
DEPTH_MM = 0.4
STANDS_OUT = 3.0
"""Times the amplitude of the frequencies beside it."""
LEAST_LEVELS = 1.0
"""A repetition below one grey level is not seen."""
BESIDE_PER_MM = (-3.5 / WINDOW_MM, -2.5 / WINDOW_MM, 2.5 / WINDOW_MM)
"""From the threads' frequency to others that its own line, as wide as the window makes it, and its
harmonics do not reach."""


@dataclass(frozen=True, kw_only=True)
class Repetition:
    """How strongly a picture repeats with the pitch of the threads."""

    pitch_mm: float
    cover_mm: float
    levels: float
    """Amplitude in grey levels of the colour that shows it best."""
    beside: float
    """Amplitude of the frequencies beside it."""
    relief_mm: float
    """Peak to peak depth of the skin itself."""

    @property
    def resolved(self) -> bool:
        """Whether the threads can be told apart."""
        return self.levels > max(LEAST_LEVELS, STANDS_OUT * self.beside)


def repetition(recipe: Recipe, pitch_mm: float) -> Repetition:
    """Press threads that run along x into a recipe's gel and measure how they repeat along y.

    Args:
        recipe: design, size, samples, seed and glove.
        pitch_mm: of the threads.

    Raises:
        WedgeError: the comb does not fit the pad.
    """
    along = partial(thread_rod, pitch_mm=pitch_mm, size_mm=SIZE_MM)
    comb = Indenter(
        name="threads",
        profile=lambda x, y: along(y, x),
        size_mm=(SIZE_MM, SIZE_MM),
        depth_mm=DEPTH_MM,
    )
    press = Press(name="threads", indenter=comb, center_mm=(0.0, 0.0), depth_mm=DEPTH_MM)
    view = recipe.view
    depth = skin_under(recipe.design, view, press, cover_mm=recipe.cover_mm).depth_mm
    half = round(WINDOW_MM / 2 / view.mm_per_px[0])
    columns, rows = (slice(size // 2 - half, size // 2 + half) for size in view.size_px)
    frames: list[np.ndarray] = []
    camera: CameraModel | None = None
    for skin in (np.zeros_like(depth), depth):
        traced = trace_part(recipe, skin, (columns, rows))
        radiance = smoothed(traced, view.mm_per_px[0], skin[rows, columns], None)
        camera = camera or expose(radiance)
        content = photograph(radiance, camera, recipe.seed + len(frames))
        frames.append(np.asarray(Image.open(io.BytesIO(content)), float))
    change = (frames[1] - frames[0]).mean(1)
    frequencies = [1 / pitch_mm, *(1 / pitch_mm + away for away in BESIDE_PER_MM)]
    levels = [amplitude(change, view.mm_per_px[1], f) for f in frequencies if f > 0]
    best = int(np.argmax(levels[0]))
    line = depth[rows, view.size_px[0] // 2]
    return Repetition(
        pitch_mm=pitch_mm,
        cover_mm=recipe.cover_mm,
        levels=float(levels[0][best]),
        beside=float(np.mean([others[best] for others in levels[1:]])),
        relief_mm=float(np.ptp(line)),
    )


def amplitude(
    signal: Float[np.ndarray, "n 3"], step_mm: float, per_mm: float
) -> Float[np.ndarray, "3"]:
    """Amplitude of each colour's repetition at a frequency, under a Hann window.

    Slow changes, up to the second order, are taken off first.
    """
    place = (np.arange(len(signal)) - (len(signal) - 1) / 2) * step_mm
    slow = np.stack([np.ones_like(place), place, place**2], 1)
    rest = signal - slow @ np.linalg.lstsq(slow, signal, rcond=None)[0]
    window = np.hanning(len(signal))
    wave = np.exp(-2j * np.pi * per_mm * place)
    return np.abs((window * wave) @ rest) * 2 / window.sum()
