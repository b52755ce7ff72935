# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A part that somebody has as triangles, to press in: the height of its underside."""

from functools import partial
from typing import Final

import numpy as np
from jaxtyping import Float

from sensor.errors import WedgeError
from simulation.indenters import Indenter
from simulation.skin import Map

PART_DEPTH_MM: Final = 0.5
"""How deep a part is pressed in when nothing else is said."""
MOST_LAYERS: Final = 1000
"""Of triangles above each other, on average along a row of pixels."""
HAIR_MM: Final = 1e-6
"""To which single precision, in which STL files are written, may tear neighbours apart."""

Triangles = Float[np.ndarray, "t 3 3"]


def part_of(corners_mm: Triangles, depth_mm: float = PART_DEPTH_MM) -> Indenter:
    """A part that stands over the gel as its own axes say: its lowest side is pressed in.

    What lies less than the depth above its lowest point is its extent, whose middle goes to where
    the part is pressed: the rest of it may be larger than the pad.

    Args:
        corners_mm: of its triangles, in any order and winding.
        depth_mm: how deep it is pressed.
    """
    lowest_mm = corners_mm[..., 2].min()
    pressed = _below(corners_mm, lowest_mm + np.fmax(depth_mm, 0.0))
    least, greatest = pressed.min(axis=0)[:2], pressed.max(axis=0)[:2]
    own = corners_mm - np.array([*(least + greatest) / 2, lowest_mm])
    by_y = np.argsort(own[..., 1], axis=1)[..., None]
    width_mm, length_mm = (greatest - least).tolist()
    return Indenter(
        name="part",
        profile=partial(underside, corners_mm=np.take_along_axis(own, by_y, axis=1)),
        size_mm=(width_mm, length_mm),
        depth_mm=depth_mm,
    )


def underside(x: Map, y: Map, *, corners_mm: Triangles) -> Map:
    """Height of the lowest point of triangles at each place of a grid; infinity beside them.

    A plane along each row cuts triangles in segments, of which the lowest counts in each column.

    Args:
        x: of the grid in mm, ascending along rows and the same in all of them.
        y: alike along columns.
        corners_mm: each triangle's by ascending y.

    Raises:
        WedgeError: too many triangles lie above each other.
    """
    columns = x[0]
    heights = np.full(x.shape, np.inf)
    low, middle, high = np.moveaxis(corners_mm, 1, 0)
    from_y, to_y = low[:, 1] - HAIR_MM, high[:, 1] + HAIR_MM
    for row, y_mm in zip(heights, y[:, 0], strict=True):
        cut = (from_y <= y_mm) & (y_mm <= to_y)
        a, b, c = low[cut], middle[cut], high[cut]
        one = _at(y_mm, a, c)
        other = np.where(y_mm < b[:, 1:2], _at(y_mm, a, b), _at(y_mm, b, c))
        turned = one[:, :1] > other[:, :1]
        left, right = np.where(turned, other, one), np.where(turned, one, other)
        first = np.searchsorted(columns, left[:, 0] - HAIR_MM)
        counts = np.searchsorted(columns, right[:, 0] + HAIR_MM, side="right") - first
        if counts.sum() > MOST_LAYERS * len(columns):
            raise WedgeError("the mesh has too many large triangles above each other: simplify it.")
        segment = np.repeat(np.arange(len(counts)), counts)
        column = np.arange(len(segment)) + (first + counts - np.cumsum(counts))[segment]
        start, run = left[segment], (right - left)[segment]
        share = _share(columns[column] - start[:, 0], run[:, 0])
        np.minimum.at(row, column, start[:, 2] + share * run[:, 2])
    return heights


def _at(
    y_mm: float, start: Float[np.ndarray, "n 3"], end: Float[np.ndarray, "n 3"]
) -> Float[np.ndarray, "n 3"]:
    """Points of lines at one y, or their nearest ends."""
    along = end - start
    return start + _share(y_mm - start[:, 1], along[:, 1])[:, None] * along


def _share(part: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """From 0 to 1."""
    return np.clip(part / np.where(whole == 0, 1.0, whole), 0, 1)


def _below(corners_mm: Triangles, height_mm: float) -> Float[np.ndarray, "n 3"]:
    """Corners up to a height, and where sides end there."""
    start, end = corners_mm.reshape(-1, 3), np.roll(corners_mm, -1, axis=1).reshape(-1, 3)
    some = np.minimum(start[:, 2], end[:, 2]) <= height_mm
    start, along = start[some], (end - start)[some]
    ends = start + _share(height_mm - start[:, 2], along[:, 2])[:, None] * along
    return np.concatenate([start[start[:, 2] <= height_mm], ends])
