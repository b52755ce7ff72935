# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What lies around a pixel, and how far it resembles what the calibration's presses showed.

A second, wider Gaussian sees how the skin curves. Networks that are given it find balls better and
other shapes worse, since balls are all that they have learnt. So it is given only where it is
familiar. What a pixel's own inputs let expect of its surroundings is learnt beside the networks;
surroundings farther off than all but ``NOVEL`` of held-out pixels are novel; and where more pixels
of a contact are novel than of any held-out press, the surroundings are withheld, smoothly.
"""

from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Float64, Int

from recon.arrays import Difference
from recon.estimators.networks import HIDDEN, Layer, answers

SIDE_PX = 4
"""Surroundings are looked at through averages over this many pixels along each axis."""
SMOOTHING = 1 / 240
"""Of the frame's shorter side: standard deviation of the Gaussian that takes off grain, less than a
press' collar."""
WIDE = 1 / 60
"""Of the same: standard deviation of the wider Gaussian."""
REACH = 1 / 16
"""Of the frame's shorter side: standard deviation of the region in which novel pixels count."""
NOVEL = 0.02
"""Of held-out pixels are called novel."""
LARGEST_LIMIT = 0.125
"""Of a familiar region's pixels at most are novel, whatever single presses showed."""
BINS = 6
"""Of the strength of a pixel's change, in each of which the surroundings scatter another way."""
LEAST_SCATTER = 1e-3
"""Of the surroundings' spread."""

FAINT = 0.1
"""Spreads of the fitted pixels: what changed less is not asked whether it is novel."""

Rows = Float32[np.ndarray, "n _"]
Strength = Float32[np.ndarray, " n"]


@dataclass(frozen=True, kw_only=True)
class Context:
    """What the surroundings of a pixel were like on the calibration's presses."""

    layers: tuple[Layer, ...]
    """A network from a pixel's own inputs to its surroundings, in units of ``spread``."""
    spread: Float32[np.ndarray, " c"]
    edges: Float32[np.ndarray, " b"]
    """Strengths between the bins."""
    precision: Float32[np.ndarray, "b2 c c"]
    """Of each bin: a quadratic form that is 1 where surroundings begin to be novel."""
    limit: Float32[np.ndarray, "1"]
    """Share of novel pixels up to which a region is familiar; 0 where nothing was learnt."""

    def novel(self, own: Rows, around: Rows, strength: Strength) -> Bool[np.ndarray, " n"]:
        """Whether the surroundings of pixels are unlike those of the presses.

        Args:
            own: the pixels' own inputs, as the networks see them.
            around: their surroundings, of full scale.
            strength: of their change of colour, in spreads of the fitted pixels.
        """
        off = around / self.spread - answers(self.layers, 0, own)
        forms = self.precision[np.digitize(strength, self.edges)]
        return np.einsum("ni,nij,nj->n", off, forms, off) > 1

    def familiar(
        self, novel: Bool[np.ndarray, " n"], strength: Strength, shape: tuple[int, int]
    ) -> Float32[np.ndarray, "h w"]:
        """How familiar each place of a frame is, from 0 to 1.

        It is 1 where no more of the region is novel than of any press, and 0 from twice as much.

        Args:
            novel: whether the places are, along the rows.
            strength: of their change of colour, the weight of each in its region.
            shape: rows and columns.
        """
        if self.limit[0] <= 0:
            return np.zeros(shape, np.float32)
        weight = strength**2
        both = np.stack([novel * weight, weight], 1).reshape(*shape, 2)
        smooth = cv2.GaussianBlur(both, (0, 0), max(REACH * min(shape), 0.5))
        share = smooth[..., 0] / np.maximum(smooth[..., 1], 1e-6)
        return np.asarray(np.clip(2 - share / self.limit[0], 0, 1), np.float32)


def quartered(prepared: Difference) -> Float32[np.ndarray, "qh qw 3"]:
    """Averages over ``SIDE_PX`` pixels along each axis."""
    height, width = prepared.shape[:2]
    size = -(-width // SIDE_PX), -(-height // SIDE_PX)
    return cv2.resize(prepared, size, interpolation=cv2.INTER_AREA)


def sampled(length_px: int) -> Int[np.ndarray, " s"]:
    """The pixels along an axis whose surroundings are compared with what is expected.

    They lie in the middle of every second average: enough to tell one object from another.
    """
    every = 2 * SIDE_PX
    return np.minimum(np.arange(-(-length_px // every)) * every + SIDE_PX // 2 - 1, length_px - 1)


def surroundings(quarter: Float32[np.ndarray, "qh qw 3"]) -> Float32[np.ndarray, "qh qw 3"]:
    """What the wider Gaussian adds to smoothed colours, as averages over ``SIDE_PX`` pixels."""
    side_px = SIDE_PX * min(quarter.shape[:2])
    left = (WIDE**2 - SMOOTHING**2) * side_px**2 - (SIDE_PX**2 - 1) / 12  # variances add
    wide = cv2.GaussianBlur(quarter, (0, 0), np.sqrt(max(left, 0.01)) / SIDE_PX)
    return np.asarray(wide - quarter, np.float32)


def fit_context(
    layers: tuple[Layer, ...],
    around: Rows,
    strength: Strength,
    press: Int[np.ndarray, " n"],
    held_out: Rows,
) -> Context:
    """The limits of what is familiar.

    Args:
        layers: of a network that learnt to expect the surroundings.
        around: surroundings of the taught pixels, of full scale.
        strength: of their change of colour, in their spreads.
        press: the press of each.
        held_out: what networks that did not see a pixel's press expected of its surroundings.
    """
    spread = spread_of(around)
    edges = np.quantile(strength, np.linspace(0, 1, BINS + 1)[1:-1]).astype(np.float32)
    bins = np.digitize(strength, edges)
    off = (around / spread - held_out).astype(np.float64)
    forms = np.stack([_form(off[bins == k]) for k in range(BINS)]).astype(np.float32)
    novel = np.einsum("ni,nij,nj->n", off, forms[bins], off) > 1
    weight = strength**2
    index = np.unique(press, return_inverse=True)[1]
    shares = np.bincount(index, novel * weight) / np.maximum(np.bincount(index, weight), 1e-6)
    limit = np.clip(shares.max(), NOVEL, LARGEST_LIMIT)
    return Context(
        layers=layers,
        spread=spread,
        edges=edges,
        precision=forms,
        limit=np.array([limit], np.float32),
    )


def no_context(colors: int, features: int) -> Context:
    """Of presses whose surroundings nobody looked at: nothing is familiar."""
    sizes = pairwise((features, *HIDDEN, colors))
    return Context(
        layers=tuple(
            (np.zeros((1, n, m), np.float32), np.zeros((1, m), np.float32)) for n, m in sizes
        ),
        spread=np.ones(colors, np.float32),
        edges=np.zeros(BINS - 1, np.float32),
        precision=np.zeros((BINS, colors, colors), np.float32),
        limit=np.zeros(1, np.float32),
    )


def spread_of(around: Float32[np.ndarray, "n c"]) -> Float32[np.ndarray, " c"]:
    """The unit that surroundings are expected in."""
    return np.maximum(around.std(0), 1e-3).astype(np.float32)


def _form(off: Float64[np.ndarray, "m c"]) -> Float64[np.ndarray, "c c"]:
    """The inverse of the second moments, over the squared distance that ``NOVEL`` exceed."""
    moments = off.T @ off / max(len(off), 1) + LEAST_SCATTER * np.eye(off.shape[1])
    inverse = np.linalg.inv(moments)
    if len(off) < 1 / NOVEL:
        return inverse / (9 * off.shape[1])
    squared = np.einsum("ni,ij,nj->n", off, inverse, off)
    return np.asarray(inverse / max(float(np.quantile(squared, 1 - NOVEL)), 1e-6))
