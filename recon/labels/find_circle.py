# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where a ball touched, found without a hint: discs proposed, fitted to shading and outline."""

from collections.abc import Iterator
from functools import lru_cache

import cv2
import numpy as np
from jaxtyping import Bool, Float32, Float64
from scipy import ndimage

from recon.arrays import Difference
from recon.labels.circles import START, Circle, refit_center, refit_circles
from recon.labels.outline import outline_of
from recon.medians import channel_medians
from sensor.errors import WedgeError
from sensor.toml import Pair

LONGEST_SIDE_PX = 320  # of the frame that is searched; dots and noise shrink with it
RADII = 6  # proposed, from the smallest to nearly the ball's
SMALLEST_PX = 6.0
LEAST_BALL_PX = 4.0
"""Radius in the frame as it is searched: a contact on a smaller ball is hardly a pixel or two."""
MOST_BALL = 3.0
"""Radius over the frame's longer side: larger balls hardly slope, their discs fill the memory."""
NEAR_PX, NEAR_RADIUS = 6.0, 0.25  # proposals this close, and of radii this alike, are one
RING = (1.05, 1.45)  # of the radius: the gel around a disc
LEAST_QUALITY = 0.4
"""Below it, what was found is no ball.

Half of the wrong fits to 61 real presses score below 0.25, 95 % of the right ones above 0.79; the
best fits to 212 presses of seven sensors, real and rendered, all score above 0.51.
"""
ALIKE = 0.998
"""Of the best quality: of circles that explain as much, the narrowest is taken. Where the scale is
wrong and the disc therefore oval, a wide circle beside it may explain a hair more."""
DOUBTFUL = 0.7
"""Below this quality somebody should look."""
RIM_POINTS = 360
LEAST_RIM = 0.5
"""Of the circle, within the frame: of less, a wrong radius explains what shows as well."""
VISIBLE_DISC = 1.3
"""Of the radius: of 102 presses of three sensors, whole in the frame, the strongest change lies
within 1.23 in all."""
FARTHEST_SHIFT = 0.4
"""Radii from the centre of the chosen fit to the last one: 0.32 at most on those presses."""
LEAST_CHANGE = 0.03
"""Least root mean square of the change over the disc and its ring, of full scale."""
SMOOTH_PX, OUTLINE_SMOOTH_PX = 2.0, 1.5
ROUNDS, CENTER_REACH = 2, 1.3
"""The last fits to the shading, and radii up to which they look: nearer the disc, where no cast
shadow lies."""

Change = Float32[np.ndarray, "h w"]
Kernel = Float32[np.ndarray, "k k"]
Points = Float64[np.ndarray, "n 2"]
Small = Float32[np.ndarray, "rows columns 3"]
"""A difference image in square pixels, its longest side at most 320."""


def find_circle(difference: Difference, ball_radius_mm: float, mm_per_px: Pair) -> Circle | None:
    """The contact circle of a ball, or ``None`` where no ball shows.

    Discs are proposed where the colour changed more inside than around (a matched filter over
    radii) and where the largest changed patch lies. Each is fitted to the shading of a ball of the
    known radius (``recon.labels.circles``); the best explained one gives radius and quality. The
    centre is that of the outline (``recon.labels.outline``), or, where too little of it lies in the
    frame, of the shading, fitted again closer to the disc; of all circles of a sensor
    ``recon.labels.find_circles.agreed`` chooses between the two. Where the centre lies outside the
    frame, so does the ball, and the next best circle is only gel beside it.

    Args:
        difference: (h, w, 3), frame minus background in the gel plane.
        ball_radius_mm: of the ball.
        mm_per_px: pixel pitch along x and y.

    Returns:
        Centre in pixels of ``difference``, radius in pixels (the geometric mean of both axes where
        pixels are not square), quality 0 to 1; below ``DOUBTFUL`` where more than half of the
        circle is cut off, the strongest change is not the disc's, or the last fits moved far.

    Raises:
        WedgeError: as ``refuse_ball``.
    """
    height, width = difference.shape[:2]
    refuse_ball((width, height), ball_radius_mm, mm_per_px)
    small, ball_px = search_image(difference, ball_radius_mm, mm_per_px)
    change = color_change(small)
    circle = _likeliest(candidates(small, change, ball_px))
    if circle is None or circle.quality < LEAST_QUALITY or _strength(small, circle) < LEAST_CHANGE:
        return None
    shading_px = _shading_center(small, circle, ball_px)
    outline = outline_of(color_change(small, OUTLINE_SMOOTH_PX), shading_px, circle.radius_px)
    center_px = shading_px if outline is None else outline.center_px
    if not _is_inside(small, np.array([center_px])).all():
        return None
    is_sure = _is_sure(change, circle, center_px)
    scale = np.array([width / small.shape[1], height / small.shape[0]])

    def in_frame(place_px: Pair) -> Pair:
        x_px, y_px = (np.array(place_px) + 0.5) * scale - 0.5
        return float(x_px), float(y_px)

    return Circle(
        center_px=in_frame(center_px),
        radius_px=circle.radius_px * float(np.sqrt(scale.prod())),
        quality=circle.quality if is_sure else DOUBTFUL * circle.quality,
        shading_px=in_frame(shading_px),
        spread=None if outline is None else outline.spread,
    )


def refuse_ball(size_px: tuple[int, int], ball_radius_mm: float, mm_per_px: Pair) -> None:
    """Refuse a ball that cannot be found in frames of this size, as where a unit is mistaken.

    Args:
        size_px: width and height of the frames in the gel plane.
        ball_radius_mm: of the ball.
        mm_per_px: pixel pitch along x and y.

    Raises:
        WedgeError: the ball is smaller than a few pixels, or larger than a few frames.
    """
    longer_mm = max(size_px[0] * mm_per_px[0], size_px[1] * mm_per_px[1])
    pitch_mm = float(np.sqrt(np.prod(mm_per_px)))
    if ball_radius_mm < LEAST_BALL_PX * _searched_pitch_mm(size_px, mm_per_px):
        raise WedgeError(
            f"the ball's radius, {ball_radius_mm:g} mm, is {ball_radius_mm / pitch_mm:.2g} px at "
            f"{pitch_mm:.4g} mm/px, too small to be found in frames {longer_mm:.3g} mm long: is it "
            "in metres, or is the scale wrong?"
        )
    if ball_radius_mm > MOST_BALL * longer_mm:
        raise WedgeError(
            f"the ball's radius, {ball_radius_mm:g} mm, is {ball_radius_mm / longer_mm:.3g} times "
            f"as long as the frames, {longer_mm:.3g} mm at {pitch_mm:.4g} mm/px: are the "
            "radius and the scale in millimetres?"
        )


def search_image(
    difference: Difference, ball_radius_mm: float, mm_per_px: Pair
) -> tuple[Small, float]:
    """The difference as it is searched, and the ball's radius in its pixels."""
    height, width = difference.shape[:2]
    pitch_mm = _searched_pitch_mm((width, height), mm_per_px)
    size = (
        max(1, round(width * mm_per_px[0] / pitch_mm)),
        max(1, round(height * mm_per_px[1] / pitch_mm)),
    )
    small = np.asarray(
        cv2.resize(difference, size, interpolation=cv2.INTER_AREA), np.float32
    ).reshape(size[1], size[0], 3)
    return small, ball_radius_mm / pitch_mm


def _searched_pitch_mm(size_px: tuple[int, int], mm_per_px: Pair) -> float:
    """Of the square pixels in which frames of a size are searched."""
    longer_mm = max(size_px[0] * mm_per_px[0], size_px[1] * mm_per_px[1])
    return max(*mm_per_px, longer_mm / LONGEST_SIDE_PX)


def candidates(small: Small, change: Change, ball_px: float) -> list[Circle]:
    """Every proposed disc, fitted to the ball's shading, or glanced at where it can be no ball.

    Right ones have the higher quality.
    """
    return refit_circles(small, _proposals(change, ball_px), ball_px)


def _likeliest(circles: list[Circle]) -> Circle | None:
    """The circle that explains most of the shading; of several alike, the narrowest."""
    enough = ALIKE * max((circle.quality for circle in circles), default=0.0)
    alike = (circle for circle in circles if circle.quality >= enough)
    return min(alike, key=lambda circle: circle.radius_px, default=None)


def _is_inside(frame: Small | Change, points_px: Points) -> Bool[np.ndarray, " n"]:
    """Which points lie in the frame."""
    height, width = frame.shape[:2]
    x, y = points_px.T
    return (x >= -0.5) & (x <= width - 0.5) & (y >= -0.5) & (y <= height - 0.5)


def _is_sure(change: Change, circle: Circle, center_px: Pair) -> bool:
    """Whether a circle, last centred here, shows its radius, and is what changed most.

    At the frame's edge a ball's shading may explain what is none, or another radius as much.
    """
    angle = np.linspace(0, 2 * np.pi, RIM_POINTS, endpoint=False)
    outward = np.stack([np.cos(angle), np.sin(angle)], -1)
    rim = _is_inside(change, center_px + circle.radius_px * outward).mean()
    y, x = np.unravel_index(change.argmax(), change.shape)
    strongest = np.hypot(x - center_px[0], y - center_px[1]) / circle.radius_px
    shift = np.hypot(*np.subtract(center_px, circle.center_px)) / circle.radius_px
    return bool(rim >= LEAST_RIM and strongest <= VISIBLE_DISC and shift <= FARTHEST_SHIFT)


def _shading_center(small: Small, circle: Circle, ball_px: float) -> Pair:
    """The shading's centre, fitted again closer to the disc."""
    (x, y), radius = circle.center_px, circle.radius_px
    for _ in range(ROUNDS):
        x, y, radius = refit_center(small, (x, y, radius / START), ball_px, CENTER_REACH)
    return x, y


def color_change(difference: Difference, smooth_px: float = SMOOTH_PX) -> Change:
    """How much the colour changed; printed dots and dust removed, noise smoothed."""
    centered = difference - channel_medians(difference)
    smooth = cv2.GaussianBlur(cv2.medianBlur(centered.astype(np.float32), 5), (0, 0), smooth_px)
    return np.sqrt((smooth**2).sum(2), dtype=np.float32)


def _proposals(change: Change, ball_px: float) -> Iterator[tuple[float, float, float]]:
    """Centre and radius of discs that may be contacts, without near repetitions."""
    largest = 0.98 * ball_px
    kept: list[tuple[float, float, float]] = []
    radii = np.geomspace(min(SMALLEST_PX, largest), largest, RADII).tolist()
    discs = [_best_disc(change, radius) for radius in radii]
    for x, y, r in [*discs, *_largest_patch(change, ball_px)]:
        if all(
            np.hypot(x - a, y - b) > NEAR_PX or abs(np.log(r / c)) > NEAR_RADIUS for a, b, c in kept
        ):
            kept.append((x, y, r))
            yield x, y, r


def _best_disc(change: Change, radius_px: float) -> tuple[float, float, float]:
    """Where a disc of this radius stands out most from the ring around it."""
    disc, ring = (
        cv2.filter2D(change, -1, shape, borderType=cv2.BORDER_CONSTANT) / inside
        for shape, inside in _disc_and_ring(change.shape[:2], radius_px)
    )
    contrast = disc - ring
    row, column = np.unravel_index(contrast.argmax(), contrast.shape)
    return float(column), float(row), float(radius_px)


@lru_cache(maxsize=2 * RADII)
def _disc_and_ring(
    shape: tuple[int, int], radius_px: float
) -> tuple[tuple[Kernel, Change], tuple[Kernel, Change]]:
    """A disc and the ring around it, and how much of each lies in the frame, laid at each pixel."""
    reach = int(np.ceil(RING[1] * radius_px))
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    distance = np.hypot(x, y) / radius_px
    disc = (distance <= 1).astype(np.float32)
    ring = ((distance > RING[0]) & (distance <= RING[1])).astype(np.float32)
    everywhere = np.ones(shape, np.float32)

    def inside(kernel: Kernel) -> Change:
        count = cv2.filter2D(everywhere, -1, kernel, borderType=cv2.BORDER_CONSTANT)
        return np.maximum(count, 1, dtype=np.float32)

    return (disc, inside(disc)), (ring, inside(ring))


def _largest_patch(change: Change, ball_px: float) -> list[tuple[float, float, float]]:
    """The disc of the largest patch that changed a quarter as much as the most."""
    smooth = cv2.GaussianBlur(change, (0, 0), 2)
    mask = ndimage.binary_fill_holes(smooth > 0.25 * np.percentile(smooth, 99.5))
    patches, count = ndimage.label(mask)
    if not count:
        return []
    largest = 1 + int(np.bincount(patches.ravel())[1:].argmax())
    rows, columns = np.nonzero(patches == largest)
    radius = min(0.85 * float(np.sqrt(len(rows) / np.pi)), 0.95 * ball_px)
    return [((columns.min() + columns.max()) / 2, (rows.min() + rows.max()) / 2, max(radius, 1.0))]


def _strength(difference: Difference, circle: Circle) -> float:
    """Root mean square of the colour's change over the disc and the ring around it."""
    height, width = difference.shape[:2]
    y, x = np.mgrid[0:height, 0:width]
    near = np.hypot(x - circle.center_px[0], y - circle.center_px[1]) < RING[1] * circle.radius_px
    smooth = cv2.GaussianBlur(difference - channel_medians(difference), (0, 0), 1)
    return float(np.sqrt((smooth[near] ** 2).sum(-1).mean())) if near.any() else 0.0
