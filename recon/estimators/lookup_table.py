# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The baseline that the network replaced: a lookup table from colour to slope, blind to position.

Yuan, Dong and Adelson, GelSight, Sensors 17(12), 2017, section 4: the colour difference is cut
into bins, each bin holds the mean gradient of the calibration pixels that fell into it, and an
empty bin copies its nearest neighbour.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Float32, Int
from scipy import ndimage

from recon.arrays import Difference
from recon.estimators.effort import Effort
from recon.lights import channel_indices
from recon.pixels import Pixels

BINS = 48
"""Along each channel."""
TAIL_PERCENT = 0.05
"""Of the pixels may lie beyond either end; they fall into the outermost bin."""


@dataclass(frozen=True, kw_only=True)
class LookupTable:
    """Mean gradients by bin of the colour difference."""

    name: ClassVar[str] = "table"
    reach: ClassVar[None] = None
    looks_around: ClassVar[bool] = False
    channels: str
    low: Float32[np.ndarray, " c"]
    high: Float32[np.ndarray, " c"]
    """Colour differences at the table's ends."""
    bins: Float32[np.ndarray, "*bins 2"]

    def prepared(self, difference: Difference) -> Difference:
        """The difference as it is."""
        return difference

    def asked(self, difference: Difference) -> Difference:
        """The difference as it is."""
        return difference

    def slopes(
        self,
        color: Float32[np.ndarray, "n 3"],
        position: Float32[np.ndarray, "n 2"],
    ) -> Float32[np.ndarray, "n 2"]:
        """Gradients (mm/mm) of pixels, from colours (full scale); positions are not used."""
        seen = color[:, channel_indices(self.channels)]
        found: Float32[np.ndarray, "n 2"] = self.bins[tuple(_bin(seen, self.low, self.high).T)]
        return found

    def lean(self, position: Float32[np.ndarray, "*n 2"]) -> Float32[np.ndarray, "*n 2"]:
        """None: the gel is taken as flat."""
        return np.zeros_like(position)

    def half_width(self, slopes: Float32[np.ndarray, "*n 2"]) -> None:
        """Not measured."""

    def tensors(self) -> dict[str, np.ndarray]:
        """Everything it learnt."""
        return {"low": self.low, "high": self.high, "bins": self.bins}

    @classmethod
    def from_tensors(cls, tensors: Mapping[str, np.ndarray], channels: str) -> "LookupTable":
        """The table whose ``tensors()`` these are.

        Raises:
            KeyError: an array is missing.
            ValueError: an array has another shape.
        """
        count = len(channels)
        shapes = [tensors[key].shape for key in ("low", "high", "bins")]
        if shapes != [(count,), (count,), (*[BINS] * count, 2)]:
            raise ValueError("the table has another number of channels or bins")
        return cls(channels=channels, **{key: tensors[key] for key in ("low", "high", "bins")})


def fit_lookup_table(
    pixels: Pixels,
    channels: str,
    seed: int,
    progress: Callable[[float], None],
    effort: Effort,
) -> LookupTable:
    """Fill the table from labelled pixels; nothing is random."""
    seen = pixels.color[:, channel_indices(channels)]
    low, high = np.percentile(seen, [TAIL_PERCENT, 100 - TAIL_PERCENT], axis=0).astype(np.float32)
    high = np.maximum(high, low + 1 / 255).astype(np.float32)
    shape = (BINS,) * len(channels)
    flat = np.ravel_multi_index(tuple(_bin(seen, low, high).T), shape)
    counts = np.bincount(flat, minlength=BINS ** len(channels))
    sums = [np.bincount(flat, pixels.gradient[:, axis], len(counts)) for axis in (0, 1)]
    means = (np.stack(sums, -1) / np.maximum(counts, 1)[:, None]).reshape(*shape, 2)
    nearest = ndimage.distance_transform_edt(
        counts.reshape(shape) == 0, return_distances=False, return_indices=True
    )
    progress(1.0)
    bins = means[tuple(nearest)].astype(np.float32)
    return LookupTable(channels=channels, low=low, high=high, bins=bins)


def _bin(
    seen: Float32[np.ndarray, "n c"],
    low: Float32[np.ndarray, " c"],
    high: Float32[np.ndarray, " c"],
) -> Int[np.ndarray, "n c"]:
    scaled = (seen - low) / (high - low) * BINS
    return np.clip(scaled, 0, BINS - 1).astype(np.intp)
