# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The scale along x and y from the jaws of a caliper, pressed on the gel a known gap apart.

Between the jaws the gel is free: it falls off at the edge of one and rises at the edge of the
other, two straight lines of opposite slope. The edge itself is where the slope sets in, on the
jaw's side of each line; the gel hangs on into the gap.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Float64
from scipy.optimize import least_squares
from scipy.special import erfc

from recon.arrays import Difference
from recon.lights import Axis
from recon.pixels import BallPress, join, label_pixels
from sensor.errors import WedgeError
from sensor.toml import Pair

Slopes = Float32[np.ndarray, "h w 2"]
Response = Float64[np.ndarray, "3 2"]
Profile = Float32[np.ndarray, "rows columns"]
Near = Float32[np.ndarray, "rows near"]
Row = Float32[np.ndarray, " columns"]
Points = Float32[np.ndarray, "points 2"]

SAME_SCALE = 0.05
"""Share of a pixel's length by which a scale that is measured twice may differ."""
COARSE_SIDE_PX = 110  # of the frame in which angles are searched
COARSE_STEP_DEG = 3.0
FEWEST_ROWS = 12
BORDER = 1 / 24
"""Of the shorter side: so near to the frame's edge no jaw leaves room for its own width."""
NEAR_PX, WINDOW_PX = 6, 10
NARROWEST, WIDEST = 0.05, 0.8
"""Gap, in shares of the frame's shorter side."""
STRONG = 0.4
"""Of the strongest row: rows of which both jaws' edges are at least that clear make the profile."""
LEAST_CLEAR = 4.0
"""A line's slope over the frame's usual one; below, no caliper is seen."""
SMOOTH_PX = 1.0
EDGE_PX = 0.4
"""Standard deviation of one edge that is well seen; found on synthetic and real jaws alike."""
LEAST_ALIKE = 0.4
"""Of one edge's slope over the other's. On a real sensor jaws have 0.77 to 1; on the twins 0.52 to
1, as a light that is alone along an axis shows the edge that faces away too gently."""
MOST_BENT, MOST_BENT_PX = 1 / 320, 0.75
"""Standard deviation of an edge from a line: the larger of this share of the frame's shorter side
and so many pixels. In frames of 240 rows jaws have 0.1 to 0.6 px; the edges of balls that are as
alike as jaws' mostly 1 to 2 px."""
LEAST_TURN_DEG = 30.0
LEAST_UNEXPLAINED = 0.005
"""Of a press's squared slopes: the best presses of drawn sensors leave as much."""
TINY = 1e-12


def of_one_scale(mm_per_px: Pair, other_mm_per_px: Pair) -> bool:
    """Whether two scales may be one sensor's, measured twice."""
    pairs = zip(mm_per_px, other_mm_per_px, strict=True)
    return all(abs(one / two - 1) <= SAME_SCALE for one, two in pairs)


@dataclass(frozen=True, kw_only=True)
class Gap:
    """The gap between a caliper's jaws in one picture."""

    width_px: float
    """Along the normal of the jaws' edges."""
    normal: Pair
    """Unit vector across the gap, in pixels."""
    center_px: Pair


@dataclass(frozen=True, kw_only=True)
class Scale:
    """Pixel pitch along x and y with its standard uncertainty."""

    mm_per_px: Pair
    sigma_mm_per_px: Pair
    gaps: int
    unseen: Axis | None = None
    """The axis along which no light shows slopes: its pitch follows the other's in proportion."""


def shading_response(presses: Sequence[BallPress]) -> Response:
    """Slopes per colour change: the linear least squares fit over the balls' contacts.

    A press counts by the inverse square of the share of its slopes that a fit to it alone leaves
    unexplained: where the scale is not known yet, some circles are not the balls'.
    """
    pixels = join([label_pixels(press, index, seed=0) for index, press in enumerate(presses)])
    colors, slopes = [], []
    for index in range(len(presses)):
        its = pixels.contact & (pixels.press == index)
        color, gradient = pixels.color[its].astype(float), pixels.gradient[its].astype(float)
        rest = gradient - color @ _fitted(color, gradient)
        unexplained = (rest**2).sum() / max((gradient**2).sum(), TINY)
        weight = 1 / max(unexplained, LEAST_UNEXPLAINED) / np.sqrt(max(len(color), 1))
        colors.append(weight * color)
        slopes.append(weight * gradient)
    return _fitted(np.concatenate(colors), np.concatenate(slopes))


def _fitted(color: Float64[np.ndarray, "n 3"], gradient: Float64[np.ndarray, "n 2"]) -> Response:
    response: Response = np.linalg.lstsq(color, gradient, rcond=None)[0]
    return response


def slopes_of(difference: Difference, response: Response) -> Slopes:
    """A rough gradient field: enough to tell which way a line slopes."""
    return (cv2.medianBlur(difference, 5) @ response).astype(np.float32)


def find_gap(slopes: Slopes) -> Gap | None:
    """The gap between two jaws at any angle; ``None`` where no two edges face each other."""
    height, width = slopes.shape[:2]
    smooth = _within_border(cv2.GaussianBlur(slopes, (0, 0), SMOOTH_PX))
    shrink = max(1.0, min(height, width) / COARSE_SIDE_PX)
    coarse = np.asarray(
        cv2.resize(
            smooth, (round(width / shrink), round(height / shrink)), interpolation=cv2.INTER_AREA
        )
    )
    angles = np.arange(0, 180, COARSE_STEP_DEG)  # seen from behind, a gap is the same
    angle_deg = float(max(angles, key=lambda angle: _clearest(_across(coarse, angle))[0]))
    across = _across(smooth, angle_deg)
    _, first, second = _clearest(_across(coarse, angle_deg))
    middle = (across.shape[1] - 1) / 2
    places = [middle + shrink * (one - _middle(coarse)) for one in (first, second)]
    if not _rows(across, places).any():
        return None
    turn_deg = _turn_deg(across, places)
    across = _across(smooth, angle_deg + turn_deg)
    rows = _rows(across, places)
    straight_px = max(MOST_BENT_PX, MOST_BENT * min(height, width))
    if rows.sum() < FEWEST_ROWS or _bent_px(across, places) > straight_px:
        return None
    profile = across[rows].mean(0)
    left, right = _onset(-profile, places[0], -1), _onset(profile, places[1], 1)
    peaks = (
        float(_near(-profile[None], places[0]).max()),
        float(_near(profile[None], places[1]).max()),
    )
    if min(peaks) < max(LEAST_CLEAR * np.abs(across).mean(), LEAST_ALIKE * max(peaks)):
        return None
    turned = np.radians(angle_deg + turn_deg)
    normal = np.array([np.cos(turned), np.sin(turned)])
    along = float(np.flatnonzero(rows).mean()) - (across.shape[0] - 1) / 2
    center = np.array([width - 1, height - 1]) / 2 + ((left + right) / 2 - middle) * normal
    center += along * np.array([-normal[1], normal[0]])
    return Gap(
        width_px=right - left,
        normal=(float(normal[0]), float(normal[1])),
        center_px=(float(center[0]), float(center[1])),
    )


def _within_border(slopes: Slopes) -> Slopes:
    """Without what the pad's own edge shows, where corners are a little off."""
    edge = max(1, int(BORDER * min(slopes.shape[:2])))
    inner = np.zeros_like(slopes)
    inner[edge:-edge, edge:-edge] = slopes[edge:-edge, edge:-edge]
    return inner


def scale_of(gaps: Sequence[Gap], gap_mm: float) -> Scale:
    """Pixel pitch along x and y from gaps of known width.

    Two parallel lines of normal (a, b) and distance w in pixels are ``gap_mm`` apart where
    ``gap_mm^2 (a^2 / sx^2 + b^2 / sy^2) = w^2``: linear in 1 / sx^2 and 1 / sy^2, least squares.
    The uncertainty is the larger of what two edges of ``EDGE_PX`` each allow and of the scatter.

    Raises:
        WedgeError: no gap, one of no width, or all of them measure the same direction.
    """
    width, normal = _measured(gaps, gap_mm)
    turns = np.degrees(np.arctan2(normal[:, 1], normal[:, 0]))
    apart = np.abs((turns[:, None] - turns + 90) % 180 - 90).max()
    if apart < LEAST_TURN_DEG:
        raise WedgeError(
            "every picture of the caliper measures the same direction, but x and y have a scale "
            "each: turn the caliper by 90 degrees and take one more."
        )
    terms = np.square(normal) * gap_mm**2
    weight = 1 / (2 * width)  # so that every gap counts by its own pixels
    inverse = np.linalg.inv((terms * weight[:, None]).T @ (terms * weight[:, None]))
    solved = inverse @ ((terms * weight[:, None]).T @ (weight * width**2))
    if solved.min() <= 0:
        raise WedgeError(
            "the caliper's gaps contradict each other: was each as wide as its name says?"
        )
    sigma_px = _sigma_px(weight * (width**2 - terms @ solved), unknowns=2)
    pitch = 1 / np.sqrt(solved)
    sigma = 0.5 * pitch**3 * sigma_px * np.sqrt(np.diag(inverse))
    return Scale(
        mm_per_px=(float(pitch[0]), float(pitch[1])),
        sigma_mm_per_px=(float(sigma[0]), float(sigma[1])),
        gaps=len(gaps),
    )


def scale_in_proportion(gaps: Sequence[Gap], gap_mm: float, mm_per_px: Pair, unseen: Axis) -> Scale:
    """Pixel pitch where slopes along one axis do not show: a multiple k of one in proportion.

    The mean over the gaps, by their pixels, of ``k = gap_mm / w * hypot(a / sx, b / sy)``.

    Args:
        gaps: as seen by slopes along the other axis.
        gap_mm: their width.
        mm_per_px: pitch along x and y, in the right proportion.
        unseen: the axis.

    Raises:
        WedgeError: no gap, or one of no width.
    """
    width, normal = _measured(gaps, gap_mm)
    exact_px = gap_mm * np.hypot(*(normal / mm_per_px).T)  # at the given pitch
    multiple = float(exact_px @ width / (width @ width))
    sigma_px = _sigma_px(width - exact_px / multiple, unknowns=1)
    share = multiple * sigma_px / float(np.linalg.norm(exact_px))
    x, y = (multiple * pitch for pitch in mm_per_px)
    return Scale(
        mm_per_px=(x, y), sigma_mm_per_px=(share * x, share * y), gaps=len(gaps), unseen=unseen
    )


def _measured(
    gaps: Sequence[Gap], gap_mm: float
) -> tuple[Float64[np.ndarray, " n"], Float64[np.ndarray, "n 2"]]:
    """Widths in pixels and normals.

    Raises:
        WedgeError: there is none, or the gap has no width.
    """
    if gap_mm <= 0:
        raise WedgeError(
            f"a caliper's gap of {gap_mm:g} mm measures nothing: name its pictures after its "
            "width, such as 5mm-1.png."
        )
    if not gaps:
        raise WedgeError(
            "the caliper's jaws were recognised in none of its pictures (in a folder, those whose "
            "names begin with a length): press them harder, or rename what shows no caliper."
        )
    return np.array([gap.width_px for gap in gaps]), np.array([gap.normal for gap in gaps])


def _sigma_px(rest_px: Float64[np.ndarray, " n"], unknowns: int) -> float:
    """Standard deviation of a gap's width: of its two edges, or of the scatter if that is more."""
    spare = len(rest_px) - unknowns
    scatter_px = np.sqrt((rest_px**2).sum() / spare) if spare > 0 else 0.0
    return max(float(np.sqrt(2) * EDGE_PX), float(scatter_px))


def _across(slopes: Slopes, angle_deg: float) -> Profile:
    """The slope along a direction, the picture turned about its middle so that it points right."""
    height, width = slopes.shape[:2]
    side = int(np.ceil(np.hypot(height, width)))
    cosine, sine = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    along = (slopes @ np.array([cosine, sine], np.float32)).astype(np.float32)
    center = np.array([width - 1, height - 1]) / 2
    turn = np.array([[cosine, -sine], [sine, cosine]])  # from turned to picture
    shift = center - turn @ np.full(2, (side - 1) / 2)
    matrix = np.column_stack([turn, shift])
    turned = cv2.warpAffine(
        along, matrix, (side, side), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    )
    return np.asarray(turned, np.float32)


def _middle(slopes: Slopes) -> float:
    return (int(np.ceil(np.hypot(*slopes.shape[:2]))) - 1) / 2


def _clearest(across: Profile) -> tuple[float, int, int]:
    """Score and columns of the fall and the rise that face each other over the most rows."""
    falls, rises = np.maximum(-across, 0), np.maximum(across, 0)
    side = across.shape[1] / np.sqrt(2)
    best = (0.0, 0, 1)
    for apart in range(max(2, int(NARROWEST * side)), int(WIDEST * side)):
        scores = np.minimum(falls[:, :-apart], rises[:, apart:]).sum(0)
        column = int(scores.argmax())
        best = max(best, (float(scores[column]), column, column + apart))
    return best


def _rows(across: Profile, places: Sequence[float]) -> Bool[np.ndarray, " rows"]:
    """Rows in which both edges are clear."""
    first, second = (_near(across, place) for place in places)
    both = np.minimum(np.max(-first, axis=1), np.max(second, axis=1))
    strong: Bool[np.ndarray, " rows"] = both > STRONG * np.quantile(both, 0.98)
    return strong


def _near(across: Profile, place: float) -> Near:
    start = int(np.clip(round(place) - NEAR_PX, 0, across.shape[1] - 2 * NEAR_PX - 1))
    return across[:, start : start + 2 * NEAR_PX + 1]


def _turn_deg(across: Profile, places: Sequence[float]) -> float:
    """How far the edges lean from the columns, mean of both, each by a robust line."""
    leans = []
    for points in _edges(across, places):
        along, lean, _, _ = cv2.fitLine(points, cv2.DIST_HUBER, 0, 0.01, 0.01).ravel()
        leans.append(float(lean / along) if abs(along) > 0.5 else 0.0)
    return -float(np.degrees(np.arctan(np.mean(leans))))


def _bent_px(across: Profile, places: Sequence[float]) -> float:
    """How far from a line of its own each edge lies, that of the less straight one."""
    return max(
        float(np.std(column - np.polyval(np.polyfit(row, column, 1), row)))
        for row, column in (points.T for points in _edges(across, places))
    )


def _edges(across: Profile, places: Sequence[float]) -> list[Points]:
    """Row and column of the fall and of the rise, in every row where both are clear."""
    rows = np.flatnonzero(_rows(across, places))
    edges: list[Points] = []
    for sign, place in zip((-1, 1), places, strict=True):
        steep = np.maximum(sign * _near(across, place)[rows], 0) ** 2
        columns = (steep * np.arange(steep.shape[1])).sum(1) / steep.sum(1)
        edges.append(np.column_stack([rows, columns]).astype(np.float32))
    return edges


def _onset(profile: Row, place: float, outward: int) -> float:
    """Where a line's slope sets in on its outward side, to a fraction of a pixel.

    The skin hangs on in proportion to exp(-distance / collar), seen through a Gaussian blur, beside
    a jaw that may be tilted: fitted are place, collar, blur, height and the slope on either side.
    """
    start = int(np.clip(round(place) - NEAR_PX, 1, len(profile) - 2 * NEAR_PX - 2))
    peak = start + int(profile[start : start + 2 * NEAR_PX + 1].argmax())
    inward = -outward * np.arange(-WINDOW_PX, WINDOW_PX + 1)
    steps = peak + outward * np.arange(-WINDOW_PX, WINDOW_PX + 1)
    inside = (steps >= 0) & (steps < len(profile))
    at, seen = -outward * inward[inside], profile[steps[inside]].astype(np.float64)
    distance = -at.astype(np.float64)  # into the gap, from the peak

    def rest(parameters: np.ndarray) -> np.ndarray:
        shift, collar, blur = parameters
        x = distance - shift
        hung = np.exp(blur**2 / (2 * collar**2) - x / collar)
        hung = hung * erfc((blur / collar - x / blur) / np.sqrt(2))
        jaw = 0.5 * erfc(x / (np.sqrt(2) * blur))
        terms = np.column_stack([hung, jaw, np.ones_like(x)])
        shares = np.linalg.lstsq(terms, seen, rcond=None)[0]
        error: np.ndarray = seen - terms @ shares
        return error

    found = least_squares(
        rest, (-1.0, 2.0, 1.2), bounds=((-6.0, 0.5, SMOOTH_PX), (3.0, 12.0, 3.0)), diff_step=1e-3
    )
    return float(peak - outward * found.x[0])
