# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What stands under a dot as the least energy of a membrane or of plates around it.

A membrane (``harmonic``) or a thin plate (``biharmonic``) is held with springs by the pixels around
a dot: noise there is averaged, not copied. ``surface`` fills both slopes at once, as two plates
that must be the slopes of one surface: the curl of a gradient is zero, so what is known of one
slope says how the other goes on. Each dot is a small system of equations of its own, a band, which
is factored once for all dots of its shape, wherever they are.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache

import cv2
import numpy as np
from jaxtyping import Float, Int32, Int64
from scipy import ndimage
from scipy.spatial import KDTree

from recon.arrays import ContactMask
from recon.markers.energies import Shape

Field = Float[np.ndarray, "h w c"]
RING_PX: Mapping[str, int] = {"harmonic": 1, "biharmonic": 3, "surface": 2}
"""How far around a dot pixels are listened to."""
LARGEST_PX = 500
TILE_PX = 16
"""Hidden pixels that hang together are cut into tiles of this side where they are more."""
SHAPES = 1024
"""That are kept, of all methods. Of a dot 21 pixels wide, ``surface`` takes 0.5 MB for one."""
EVERY_SIDE = np.ones((3, 3), np.uint8)

Planes = Float[np.ndarray, "c h w"]
Pixels = Float[np.ndarray, "s c"]
"""The values of each pixel of a field or of planes, row by row: a view."""
Box = tuple[int, int, int, int]
"""Top, left, bottom and right; the last two are the first beyond."""


class ElasticFill:
    """Fills what one arrangement of dots hides."""

    def __init__(
        self,
        hidden: ContactMask,
        method: str,
        aspect: float,
        before: "ElasticFill | None" = None,
    ) -> None:
        """Find the dots.

        Args:
            hidden: (h, w), true under dots.
            method: a key of ``RING_PX``.
            aspect: of a pixel's height to its width; only ``surface`` asks.
            before: of other hidden pixels, else alike: its dots are taken, the very objects, where
                nothing around them has changed.
        """
        self.hidden, self._method, self._aspect = hidden, method, aspect
        self._whole: dict[Box, Dot] = {}
        numbers, boxes, tiles = _parts(hidden)
        kept = {} if before is None else before._unchanged(hidden, boxes)
        dots, far = [], np.zeros_like(hidden)
        for number, box in (*boxes.items(), *tiles.items()):
            dot = kept.get(number) or _placed_dot(numbers, number, box, hidden, method, aspect)
            if dot is None:
                far[_within(box)] |= numbers[_within(box)] == number
                continue
            dots.append(dot)
            if number in boxes:
                self._whole[box] = dot
        self.dots = tuple(dots)
        # In the midst of a wide hidden area nothing is known within the ring.
        around = beside(hidden)
        self.far = nearest_known(far, around) if far.any() and around.any() else None

    def moved(self, hidden: ContactMask) -> "ElasticFill":
        """Of other hidden pixels; what has not changed is not prepared anew."""
        if np.array_equal(hidden, self.hidden):
            return self
        return ElasticFill(hidden, self._method, self._aspect, self)

    def __call__(self, field: Field) -> Field:
        """A new field with hidden pixels filled; two slopes, or any values but for ``surface``."""
        filled = np.array(field, order="C")
        self._fill(filled.reshape(self.hidden.size, -1), self._systems)
        return filled

    def in_place(self, planes: Planes, dots: "Iterable[Dot] | None" = None) -> None:
        """Fill the hidden pixels of planes that lie one behind the other, or some dots of them."""
        assert planes.flags.c_contiguous
        pixels = planes.reshape(len(planes), -1).T
        self._fill(pixels, self._systems if dots is None else _systems(dots))

    def _fill(self, pixels: Pixels, systems: "Systems") -> None:
        if self.far is not None:
            places, sources = self.far
            pixels[places] = pixels[sources]
        elif not self.dots:  # nothing is hidden, or all
            pixels[self.hidden.ravel()] = 0
        systems.solve(pixels)

    @cached_property
    def _systems(self) -> "Systems":
        return _systems(self.dots)

    def _unchanged(self, hidden: ContactMask, boxes: "Mapping[int, Box]") -> "dict[int, Dot]":
        """Dots of this arrangement that another has as well, by their numbers there.

        What is hidden in a dot's box and in the ring around it says all about it.
        """
        height, width = hidden.shape
        changes = cv2.integral((hidden != self.hidden).view(np.uint8))
        ring_px = RING_PX[self._method]
        top, left, bottom, right = np.array([*boxes.values()], int).reshape(-1, 4).T
        top, left = np.maximum(top - ring_px, 0), np.maximum(left - ring_px, 0)
        bottom, right = np.minimum(bottom + ring_px, height), np.minimum(right + ring_px, width)
        changed = changes[bottom, right] - changes[top, right]
        changed += changes[top, left] - changes[bottom, left]
        return {
            number: self._whole[box]
            for (number, box), few in zip(boxes.items(), changed, strict=True)
            if not few and box in self._whole
        }


def beside(hidden: ContactMask) -> ContactMask:
    """The pixels around dots."""
    return np.asarray(cv2.dilate(hidden.view(np.uint8), EVERY_SIDE).view(bool) & ~hidden)


def nearest_known(
    hidden: ContactMask, around: ContactMask
) -> tuple[Int64[np.ndarray, " n"], Int64[np.ndarray, " n"]]:
    """Places of hidden pixels, and of those nearest to them of the pixels around dots."""
    _, chosen = KDTree(np.argwhere(around)).query(np.argwhere(hidden))
    return np.flatnonzero(hidden), np.flatnonzero(around)[chosen]


def _within(box: "Box", ring_px: int = 0) -> tuple[slice, slice]:
    """The pixels of a box and of a ring around it, in the frame."""
    top, left, bottom, right = box
    return (
        slice(max(top - ring_px, 0), bottom + ring_px),
        slice(max(left - ring_px, 0), right + ring_px),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Dot:
    """A shape at its place."""

    box: Box
    """Around what it hides."""
    places: Int64[np.ndarray, " n"]
    sources: Int64[np.ndarray, " m"]
    """The pixels that are filled and those that are listened to."""
    shape: Shape


@dataclass(frozen=True, kw_only=True)
class Systems:
    """Dots, those of one shape one after the other."""

    shapes: list[tuple[Shape, int]]
    """With how many dots each has."""
    places: Int64[np.ndarray, " n"]
    sources: Int64[np.ndarray, " m"]
    """Of all dots."""

    def solve(self, pixels: Pixels) -> None:
        """Fill the dots."""
        known, channels = pixels[self.sources], pixels.shape[1]
        solved = np.empty((len(self.places), channels))
        begin, first = 0, 0
        for shape, count in self.shapes:
            end, last = begin + count * shape.filled_px, first + count * shape.listened_px
            around = known[first:last].reshape(count, -1, channels)
            solved[begin:end] = shape.solve(around).reshape(-1, channels)
            begin, first = end, last
        pixels[self.places] = solved


def _systems(dots: Iterable[Dot]) -> Systems:
    groups: dict[Shape, list[Dot]] = {}
    for dot in dots:
        groups.setdefault(dot.shape, []).append(dot)
    in_order = [dot for group in groups.values() for dot in group]
    none = np.zeros(0, np.int64)
    return Systems(
        shapes=[(shape, len(group)) for shape, group in groups.items()],
        places=np.concatenate([none, *(dot.places for dot in in_order)]),
        sources=np.concatenate([none, *(dot.sources for dot in in_order)]),
    )


def _parts(
    hidden: ContactMask,
) -> tuple[Int32[np.ndarray, "h w"], dict[int, Box], dict[int, Box]]:
    """Every dot under its number; many dots that touch, as along an edge, in tiles.

    Returns:
        The numbers of pixels; the boxes of whole dots and of tiles.
    """
    count, numbers, stats, _ = cv2.connectedComponentsWithStats(
        hidden.view(np.uint8), connectivity=8, ltype=cv2.CV_32S
    )
    left, top, width, height, area = stats.T
    large = area > LARGEST_PX
    large[0] = False
    found = np.stack([top, left, top + height, left + width], 1).tolist()
    boxes = {number: tuple(found[number]) for number in range(1, count) if not large[number]}
    if not large.any():
        return numbers, boxes, {}
    rows, columns = np.indices(hidden.shape) // TILE_PX
    tile = count + rows * (columns.max() + 1) + columns
    numbers = np.where(large[numbers], tile, numbers).astype(np.int32)
    tiles = {
        number: (place[0].start, place[1].start, place[0].stop, place[1].stop)
        for number, place in enumerate(ndimage.find_objects(numbers), start=1)
        if number >= count and place is not None
    }
    return numbers, boxes, tiles


def _placed_dot(
    numbers: Int32[np.ndarray, "h w"],
    number: int,
    box: Box,
    hidden: ContactMask,
    method: str,
    aspect: float,
) -> Dot | None:
    """The dot of a number, unless nothing is known around it."""
    window, width = _within(box, RING_PX[method]), hidden.shape[1]
    seen = hidden.view(np.uint8)[window] + (numbers[window] == number)
    dot = _dot_in(seen.tobytes(), seen.shape, width, method, aspect)
    if dot is None:
        return None
    places, sources, shape = dot
    corner = window[0].start * width + window[1].start
    return Dot(box=box, places=places + corner, sources=sources + corner, shape=shape)


@lru_cache(maxsize=SHAPES)
def _dot_in(
    seen: bytes, shape: tuple[int, int], width: int, method: str, aspect: float
) -> "tuple[Int64[np.ndarray, ' n'], Int64[np.ndarray, ' m'], Shape] | None":
    """Places, sources and shape of the dot in the upper left of a frame, if all is not hidden.

    Args:
        seen: 2 under the dot, 1 under others, else 0.
        shape: of what is seen.
        width: of the frame.
        method: a key of ``RING_PX``.
        aspect: of a pixel's height to its width.
    """
    window, side = np.frombuffer(seen, np.uint8).reshape(shape), 2 * RING_PX[method] + 1
    dot = window == 2
    known = cv2.dilate(dot.view(np.uint8), np.ones((side, side), np.uint8)).view(bool)
    known &= window == 0
    if not known.any():
        return None
    places, sources = (rows * width + columns for rows, columns in map(np.nonzero, (dot, known)))
    return places, sources, _shape(dot.tobytes(), known.tobytes(), shape, method, aspect)


@lru_cache(maxsize=SHAPES)
def _shape(dot: bytes, known: bytes, shape: tuple[int, int], method: str, aspect: float) -> Shape:
    hidden, held = (np.frombuffer(mask, bool).reshape(shape) for mask in (dot, known))
    return Shape(hidden, held, method, aspect)
