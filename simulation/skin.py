# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The painted skin of the gel: where it lies untouched, and how it follows what is pressed in.

The gel under the skin is a two-parameter foundation (Vlasov's, one shear mode through a bonded
layer): springs that also drag their neighbours along. With nothing in touch the indentation w
obeys ``w = s^2 laplace(w)``; with an object it is the smallest such w that stays below the object,
an obstacle problem. So the skin leaves a ball along a tangent, runs out in a collar, bridges
grooves, and wraps further around as the object is pressed deeper.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from jaxtyping import Bool, Float
from scipy import ndimage

from sensor.design import Gel, Wedge
from sensor.errors import WedgeError

Map = Float[np.ndarray, "h w"]

POISSON_RATIO: Final = 0.48
"""Of soft silicone, nearly incompressible."""
SMALLEST_MM: Final = 1e-3
"""What moves less than this is untouched."""
RELAXATION: Final = 1.7
NARROW_PX: Final = 12.0
"""Collars up to this width settle soon by ``RELAXATION``; another would change the kept sets."""
SWEEPS: Final = 20_000
"""About ten times the widest collar in pixels are needed."""
SETTLED_MM: Final = 1e-5
"""Change in a sweep by ``RELAXATION`` at which the skin has settled."""


@dataclass(frozen=True, kw_only=True)
class View:
    """The pixels of the gel plane: pixel centres are samples of the pad."""

    size_px: tuple[int, int]
    mm_per_px: tuple[float, float]

    @property
    def size_mm(self) -> tuple[float, float]:
        """The rectangle that whole pixels cover."""
        return self.size_px[0] * self.mm_per_px[0], self.size_px[1] * self.mm_per_px[1]

    @cached_property
    def x_mm(self) -> Float[np.ndarray, " w"]:
        """Of every column, from the pad's centre."""
        return (np.arange(self.size_px[0]) - (self.size_px[0] - 1) / 2) * self.mm_per_px[0]

    @cached_property
    def y_mm(self) -> Float[np.ndarray, " h"]:
        """Of every row, from the pad's centre."""
        return (np.arange(self.size_px[1]) - (self.size_px[1] - 1) / 2) * self.mm_per_px[1]

    @cached_property
    def grid_mm(self) -> tuple[Map, Map]:
        """Coordinates of every pixel."""
        x, y = np.meshgrid(self.x_mm, self.y_mm)
        return x, y

    def pixel(self, x_mm: np.ndarray, y_mm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where points of the pad lie in the picture."""
        width, height = self.size_px
        return (
            x_mm / self.mm_per_px[0] + (width - 1) / 2,
            y_mm / self.mm_per_px[1] + (height - 1) / 2,
        )


def gel_view(design: Wedge, width_px: int) -> View:
    """The whole pad, as wide as asked, with square pixels."""
    length, width = design.pad_size_mm
    pitch = length / width_px
    return View(size_px=(width_px, int(width / pitch + 1e-9)), mm_per_px=(pitch, pitch))


def rest_height_mm(gel: Gel, x_mm: np.ndarray, y_mm: np.ndarray) -> np.ndarray:
    """Height z of the untouched skin: 0 at the pad's centre, below it elsewhere."""
    if not gel.curved:
        return np.zeros(np.broadcast_shapes(x_mm.shape, y_mm.shape))
    root = 1 - (x_mm / gel.semi_axis_along_mm) ** 2 - (y_mm / gel.semi_axis_across_mm) ** 2
    return -gel.semi_axis_normal_mm * (1 - np.sqrt(root))


def collar_mm(gel: Gel) -> float:
    """The length s over which the skin beside a contact springs back.

    A bonded layer of thickness h has springs ``k = E' / h`` and shear ``t = G h / 3``
    (Vlasov and Leont'ev, Beams, Plates and Shells on Elastic Foundations, 1966), so
    ``s = sqrt(t / k)`` depends on the thickness and on Poisson's ratio alone.
    """
    v = POISSON_RATIO
    oedometric, shear = (1 - v) / ((1 + v) * (1 - 2 * v)), 1 / (2 * (1 + v))
    return float(gel.thickness_mm * np.sqrt(shear / (3 * oedometric)))


@dataclass(frozen=True, kw_only=True)
class Skin:
    """The skin under a press."""

    depth_mm: Map
    """Indentation below the untouched skin, along z."""
    contact: Bool[np.ndarray, "h w"]
    """Where the object touches."""


def pressed(view: View, gel: Gel, reach_mm: Map, cover_mm: float = 0.0) -> Skin:
    """The skin under an object.

    Args:
        view: the pixels.
        gel: gives the collar.
        reach_mm: how far the object reaches below the untouched skin at every pixel; negative
            where it stays above, -inf where there is none.
        cover_mm: thickness of paint and glove over the gel: finer detail does not come through.

    Raises:
        WedgeError: the reach is no number somewhere, nothing reaches the skin, the cover hides all
            of the dent, or the skin does not settle.
    """
    refuse_reach(reach_mm)
    floor = np.maximum(reach_mm, -1.0)  # what stays a millimetre above cannot touch
    sigma = [cover_mm / pitch for pitch in view.mm_per_px[::-1]]
    depth = _obstacle(floor, [collar_mm(gel) / pitch for pitch in view.mm_per_px[::-1]])
    contact = (floor > 0) & (depth - floor < SMALLEST_MM)
    if cover_mm:
        depth = ndimage.gaussian_filter(depth, sigma, mode="nearest")
    refuse_untouched(depth)
    return Skin(depth_mm=np.where(depth < SMALLEST_MM, 0.0, depth), contact=contact)


def refuse_reach(reach_mm: Map) -> None:
    """Refuse an object that is nowhere or without end at a pixel, or reaches the skin at none.

    Raises:
        WedgeError: the reach is NaN or inf at a pixel, or as ``refuse_untouched``.
    """
    if not (reach_mm < np.inf).all():
        raise WedgeError(
            "the object's profile is NaN or -inf at some pixels: let it give a height there, or "
            "inf where there is no object."
        )
    refuse_untouched(reach_mm)


def refuse_untouched(depth_mm: Map) -> None:
    """Refuse a press that moves the skin at no pixel.

    Raises:
        WedgeError: it nowhere goes as deep as what counts as moved.
    """
    if not (depth_mm >= SMALLEST_MM).any():
        raise WedgeError(
            f"the object does not reach {SMALLEST_MM:g} mm into the skin at any pixel: press "
            "deeper, or take a larger --width-px."
        )


def _obstacle(floor: Map, collar_px: list[float]) -> Map:
    """Smallest w with ``w >= floor`` and ``w >= s^2 laplace(w)``, the border free.

    Projected successive over-relaxation in red-black order (Cryer, SIAM J. Control 9, 1971), for
    wide collars by the factor that is best without an object (Young, Trans. AMS 76, 1954).

    Raises:
        WedgeError: it does not settle.
    """
    along_y, along_x = (length**2 for length in collar_px)
    w = np.pad(np.maximum(floor, 0.0), 1, mode="edge")
    diagonal = 1 + 2 * (along_x + along_y)
    relaxation = RELAXATION
    if max(collar_px) > NARROW_PX:
        relaxation = 2 / (1 + np.sqrt(1 - (1 - 1 / diagonal) ** 2))
    # The slower it creeps, the more is left to go behind a small step.
    settled_mm = SETTLED_MM * ((2 - relaxation) / (2 - RELAXATION))
    rows, columns = np.indices(floor.shape)
    black = (rows + columns) % 2 == 0
    for sweep in range(SWEEPS):
        before = w[1:-1, 1:-1].copy()
        for color in (black, ~black):
            w[0], w[-1], w[:, 0], w[:, -1] = w[1], w[-2], w[:, 1], w[:, -2]
            pull = along_x * (w[1:-1, :-2] + w[1:-1, 2:]) + along_y * (w[:-2, 1:-1] + w[2:, 1:-1])
            inner = w[1:-1, 1:-1]
            relaxed = np.maximum(floor, inner + relaxation * (pull / diagonal - inner))
            np.copyto(inner, relaxed, where=color)
        if sweep % 10 == 9 and np.abs(w[1:-1, 1:-1] - before).max() < settled_mm:
            return w[1:-1, 1:-1]
    raise WedgeError(f"the skin does not settle in {SWEEPS} steps: take a smaller --width-px.")
