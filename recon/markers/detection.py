# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Dark dots on a gel, found without being told their size or spacing.

A dot is a dark spot of a size, so it is a maximum of the scale-normalised Laplacian of the log
of brightness (Lindeberg, Feature detection with automatic scale selection, IJCV 30(2), 1998);
the log makes a dot in a dark corner weigh as much as one in the light. On a marker gel hundreds
of maxima stand far above the rest, and they lie on a grid.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32, Float64
from scipy.spatial import KDTree

from recon.arrays import Unwarped
from recon.markers.lattice import Cells, Points, grid_spacing, grow_lattice
from recon.medians import median
from sensor.toml import Pair

DARKEST = 0.02
"""Added to brightness, of full scale: below it, dark and darker look the same."""
FINEST_SCALE_PX = 1.0
COARSEST_SCALE = 1 / 28
"""Of the frame's shorter side: dots are found up to 4.2 scales wide, and the coarsest of the steps
below is at least 1/40 of it. So a dot may be a tenth as wide; whether up to a seventh, the frame's
size decides."""
SCALE_STEP = 2**0.5
NEAR_BEST = 0.75
"""The coarsest scale with this share of the best one's response is taken: finer ones split dots."""
FAINTEST = 0.015
"""Responses below this are noise. A dot half as bright as the gel answers with about 0.3."""
LEAST_RESPONSE = 0.05
"""Least response of the median dot; artefacts of a clean gel stay below it."""
OUTLIER = 0.25
"""Dots answer with at least this share of the median dot's response..."""
WEAKER_ON_GRID = 0.12
"""...or, where the grid expects one, with this share."""
FOUND_WITHIN = 0.3
"""How far, in spacings, a dot may lie from where the grid expects it."""
LEAST_DOTS = 9
LEAST_ON_GRID = 0.7
"""Share of the candidates that lie on one grid; fewer are specks, scratches, texture."""
MOST_OF_FRAME = 0.5
"""Share of each side of the frame that a gel's own dots span, as they are all over it."""
CLOSING = 6.0
"""Width of what is taken for a dot and bridged, in standard deviations of the dots' filter."""
FARTHEST = 3.0
"""Farthest that a dot's pixels lie from its centre, in standard deviations of the dots' filter."""


@dataclass(frozen=True, kw_only=True)
class Markers:
    """The dots of a gel at rest: their order in these arrays is their identity."""

    position_px: Points
    """Centres (x, y) in the unwarped frame, finer than a pixel."""
    cell: Cells
    """Row and column of each; (0, 0) is some dot near the middle."""
    response: Float64[np.ndarray, " n"]
    """How strongly each stands out."""
    scale_px: float
    """Standard deviation of the filter that answers best."""
    spacing_px: float
    """Median distance between neighbours."""
    diameter_px: float
    """Of a disc as large as the median dot where it is at least half as dark as its middle."""

    def __len__(self) -> int:
        """How many."""
        return len(self.position_px)

    def rest_mm(self, mm_per_px: Pair, size_px: tuple[int, int]) -> Points:
        """Centres in the gel frame, whose origin is the middle of the frame (width, height)."""
        return (self.position_px - (np.array(size_px) - 1) / 2) * mm_per_px

    def card(self, mm_per_px: Pair) -> dict[str, int | float]:
        """What a unit records of them."""
        pitch_mm = float(np.sqrt(np.prod(mm_per_px)))
        return {
            "count": len(self),
            "spacing_mm": round(grid_spacing(self.position_px * mm_per_px, self.cell), 4),
            "diameter_mm": round(self.diameter_px * pitch_mm, 4),
        }


@dataclass(frozen=True, kw_only=True)
class Spots:
    """Dark spots of one scale."""

    position_px: Points
    response: Float64[np.ndarray, " n"]


def find_markers(image: Unwarped) -> Markers | None:
    """The dots of a blank gel; ``None`` where it has none.

    Args:
        image: the unwarped blank frame, 0 to 1.
    """
    best = _characteristic(image)
    if best is None:
        return None
    scale_px, spots, threshold = best
    strong = spots.response > threshold
    typical = float(np.median(spots.response[strong]))
    strong &= spots.response > OUTLIER * typical
    candidates = spots.position_px[strong]
    if typical < LEAST_RESPONSE or len(candidates) < LEAST_DOTS:
        return None
    lattice = grow_lattice(candidates)
    if lattice is None or len(lattice.dots) < max(LEAST_DOTS, LEAST_ON_GRID * len(candidates)):
        return None
    position = candidates[lattice.dots]
    response = spots.response[strong][lattice.dots]
    weak = np.flatnonzero(~strong & (spots.response > WEAKER_ON_GRID * typical))
    if len(weak) and len(lattice.empty_px):
        away, chosen = KDTree(spots.position_px[weak]).query(lattice.empty_px)
        near = away < FOUND_WITHIN * lattice.spacing_px
        _, first = np.unique(chosen[near], return_index=True)
        added = np.flatnonzero(near)[first]
        position = np.concatenate([position, spots.position_px[weak[chosen[added]]]])
        response = np.concatenate([response, spots.response[weak[chosen[added]]]])
        cell = np.concatenate([lattice.cells, lattice.empty_cells[added]])
    else:
        cell = lattice.cells
    whole = inside(position, image.shape[:2])
    position, response, cell = position[whole], response[whole], cell[whole]
    if len(position) < LEAST_DOTS:  # a jagged border passed as a row of dots
        return None
    order = np.lexsort((cell[:, 1], cell[:, 0]))
    return Markers(
        position_px=position[order],
        cell=cell[order],
        response=response[order],
        scale_px=scale_px,
        spacing_px=lattice.spacing_px,
        diameter_px=_diameter_px(image, position[order], scale_px),
    )


def unexpected_dots(image: Unwarped, blank: Unwarped) -> str:
    """A word where a frame of a gel whose blank frame has no dots shows a grid of them; else empty.

    Args:
        image: the unwarped frame, blank or pressed. What touches may be dotted too, so only a grid
            over most of the frame counts.
        blank: the unwarped blank frame. What is no darker than it is no dot, which is soon told.
    """
    darker = _log_brightness(blank) - _log_brightness(image)
    smooth = cv2.GaussianBlur(darker - median(darker), (0, 0), FINEST_SCALE_PX)
    dark = smooth > LEAST_RESPONSE  # so much the faintest and finest dot is
    if not _reaches_far(np.argwhere(dark)[:, ::-1], image):
        return ""
    found = find_markers(image)
    if found is None or not _reaches_far(found.position_px, image):
        return ""
    return f"{len(found)} dots, but the blank frame has none: is this the unit's gel?"


def _reaches_far(position_px: np.ndarray, image: Unwarped) -> bool:
    """Whether places (n, 2), x and y, are spread over most of a frame."""
    if not len(position_px):
        return False
    reach_px = MOST_OF_FRAME * np.array(image.shape[1::-1])
    return bool((np.ptp(position_px, axis=0) >= reach_px).all())


def inside(position_px: Points, shape: tuple[int, int]) -> Bool[np.ndarray, " n"]:
    """Which places lie in a frame of (h, w) and not on its outermost pixels."""
    height, width = shape
    x_px, y_px = position_px.T
    return (x_px > 0.5) & (x_px < width - 1.5) & (y_px > 0.5) & (y_px < height - 1.5)


def dark_spots(image: Unwarped, scale_px: float) -> Spots:
    """Local maxima of the darkness response, with their places between pixels."""
    response = darkness_response(image, scale_px)
    reach = 2 * max(1, round(1.5 * scale_px)) + 1
    peak = response == cv2.dilate(response, np.ones((reach, reach), np.uint8))
    # One index at a time takes a ninth of the time of ``nonzero``.
    rows, columns = np.unravel_index(np.flatnonzero(peak & (response > FAINTEST)), peak.shape)
    padded = np.pad(response, 1, mode="edge")  # (row, column) is at (row + 1, column + 1) there
    here = response[rows, columns]
    x_px = columns + _vertex(padded[rows + 1, columns], here, padded[rows + 1, columns + 2])
    y_px = rows + _vertex(padded[rows, columns + 1], here, padded[rows + 2, columns + 1])
    return Spots(
        position_px=np.stack([x_px, y_px], 1).astype(np.float64),
        response=here.astype(np.float64),
    )


def darkness_response(image: Unwarped, scale_px: float) -> Float32[np.ndarray, "h w"]:
    """Scale-normalised Laplacian of the log of brightness: positive on dark spots."""
    brightness = _log_brightness(image)
    smooth = cv2.GaussianBlur(brightness, (0, 0), scale_px)
    laplacian = cv2.Laplacian(smooth, cv2.CV_32F, ksize=1)
    return np.asarray(scale_px**2 * laplacian, np.float32)


def darkness(image: Unwarped, scale_px: float) -> Float32[np.ndarray, "h w"]:
    """How much darker each pixel is than the gel around its dot, in the log of brightness."""
    brightness = cv2.GaussianBlur(_log_brightness(image), (0, 0), 0.7)
    width_px = 2 * round(CLOSING * scale_px / 2) + 1
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (width_px, width_px))
    return np.asarray(cv2.morphologyEx(brightness, cv2.MORPH_CLOSE, kernel) - brightness)


def _log_brightness(image: Unwarped) -> Float32[np.ndarray, "h w"]:
    red, green, blue = np.moveaxis(image, -1, 0)  # the mean of so short an axis is slow
    mean = red + green
    mean += blue
    mean /= 3
    mean += np.float32(DARKEST)
    return np.asarray(np.log(mean, out=mean))


def _diameter_px(image: Unwarped, position_px: Points, scale_px: float) -> float:
    dark = darkness(image, scale_px)
    columns, rows = np.rint(position_px).astype(int).T
    reach = int(np.ceil(FARTHEST * scale_px))
    offsets_y, offsets_x = np.indices((2 * reach + 1, 2 * reach + 1)).reshape(2, -1) - reach
    near = np.hypot(offsets_x, offsets_y) <= FARTHEST * scale_px
    padded = np.pad(dark, reach)
    around = padded[
        rows[:, None] + offsets_y[near] + reach, columns[:, None] + offsets_x[near] + reach
    ]
    half = around > 0.5 * dark[rows, columns, None]
    return float(np.median(2 * np.sqrt(half.sum(1) / np.pi)))


def _characteristic(image: Unwarped) -> tuple[float, Spots, float] | None:
    """The scale at which spots stand out best, its spots, and what parts dots from the rest."""
    coarsest = COARSEST_SCALE * min(image.shape[:2])
    found: list[tuple[float, float, Spots, float]] = []
    scale_px = FINEST_SCALE_PX
    while scale_px <= coarsest:
        spots = dark_spots(image, scale_px)
        if len(spots.response) >= LEAST_DOTS:
            threshold = _parting(spots.response)
            strength = float(np.median(spots.response[spots.response > threshold]))
            found.append((strength, scale_px, spots, threshold))
        scale_px *= SCALE_STEP
    if not found:
        return None
    strongest = max(strength for strength, *_ in found)
    near = [item for item in found if item[0] >= NEAR_BEST * strongest]
    _, scale_px, spots, threshold = near[-1]
    return scale_px, spots, threshold


def _parting(response: Float64[np.ndarray, " n"]) -> float:
    """The middle of the widest gap, on a log scale, below at least ``LEAST_DOTS`` responses."""
    values = np.log(np.append(np.sort(response)[::-1], FAINTEST))
    gaps = values[LEAST_DOTS - 1 : -1] - values[LEAST_DOTS:]
    widest = LEAST_DOTS - 1 + int(np.argmax(gaps))
    return float(np.exp((values[widest] + values[widest + 1]) / 2))


def _vertex(
    before: Float[np.ndarray, " n"], middle: Float[np.ndarray, " n"], after: Float[np.ndarray, " n"]
) -> Float[np.ndarray, " n"]:
    """Where the parabola through three equidistant samples peaks, -0.5 to 0.5."""
    curvature = before - 2 * middle + after
    shift = 0.5 * (before - after) / np.where(curvature < 0, curvature, -1.0)
    return np.clip(np.where(curvature < 0, shift, 0.0), -0.5, 0.5)
