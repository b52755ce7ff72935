# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Heights of a contact's rim above the gel right beside it, as far as they can be believed.

Where gel lies still right beside an object, the few pixels across the outline tell how high its rim
stands there, far better than the way from the window's border: noise adds up along it. Of all
surfaces that end at a height difference e over w pixels, the plane has the least slope; so each
pixel along the rim counts as w slope residuals of e / (w h), h being the pitch.

A soft gel's collar follows the object, but not as if it were a part of it. What it does otherwise
is left over beyond what noise and the doubt of a pose without the rim explain; that excess is added
to the rim's variance (estimated variance components: Helmert, 1907). A collar's errors are alike
over millimetres, so means over tiles are looked at, up to that of the whole rim.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float32

from recon.pose.level import ALL, looked_up
from recon.pose.pyramid import BESIDE_PX, Pyramid
from recon.pose.rigid import Covariance, Transform
from recon.pose.template import carried, sums_by_tile

SKIPPED_PX = 1
"""Rows of pixels that the outline may cross; the rim is the next."""
WIDTH_PX = SKIPPED_PX + BESIDE_PX + 0.5
"""From the rim to the gel beside."""
LEAST_PX = 12
FINEST = 4
"""Tiles along each side of the rim's extent; they are looked at one by one, then by fours."""
CROSS = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))


@dataclass(frozen=True, kw_only=True)
class Rim:
    """Pixels of a reference along the outline of what both touches show, and their heights."""

    pixels: Bool[np.ndarray, " n"]
    """Which of the template's."""
    residual: Float32[np.ndarray, " k"]
    """Heights in mm as seen less those that the guess predicts."""
    change: Float32[np.ndarray, "k 6"]
    """Of the heights, per twist."""
    points: Float32[np.ndarray, "k 3"]
    weight: float
    """Of a height (1/mm^2) beside slope residuals of weight 1, where the gel beside lies still."""

    def believed(self, variance: float, pose: Covariance) -> float:
        """Share of the variance of the rim's heights that noise explains.

        Args:
            variance: of a residual of weight 1, by noise alone.
            pose: covariance of the guess, found without the rim.
        """
        place = self.points[:, :2] - self.points[:, :2].min(0)
        place /= np.maximum(place.max(0), np.float32(1e-6))
        column, row = np.minimum(place * FINEST, FINEST - 1).T.astype(int)
        rows = np.concatenate([self.residual[None], self.change.T, np.ones((1, len(place)))])
        sums = sums_by_tile(rows, row * FINEST + column, FINEST**2).reshape(FINEST, FINEST, -1)
        shares = []
        while True:
            used = sums[..., -1] > 0
            pixels = sums[used, -1]
            means = sums[used] / pixels[:, None]
            mean, change = means[:, 0], means[:, 1:-1]
            doubt = ((change @ pose) * change).sum(1)
            noise, part = variance / self.weight / pixels, pixels / len(place)
            explained = float(part @ noise)
            excess = float(part @ (mean**2 - doubt - noise))
            shares.append(explained / (explained + max(excess, 0.0)))
            if len(sums) == 1:
                return min(shares)
            sums = sums[::2, ::2] + sums[1::2, ::2] + sums[::2, 1::2] + sums[1::2, 1::2]


def rim(
    reference: Pyramid,
    current: Pyramid,
    seen: Bool[np.ndarray, " n"],
    guess: Transform,
) -> Rim | None:
    """The rim at full resolution; ``None`` where little of it lies beside gel.

    Args:
        reference: one touch.
        current: another.
        seen: which pixels of the reference's template both show.
        guess: the motion from the reference to the current touch.
    """
    template, level = reference.templates[0], reference.beside
    column, row = (np.rint(place).astype(int) for place in level.place(template.points))
    common = np.zeros(level.values.shape[:2], np.uint8)
    common[row[seen], column[seen]] = 1
    outer = cv2.erode(common, CROSS, iterations=SKIPPED_PX)
    height, near = level.values[row, column, 2:].T
    pixels = (outer > cv2.erode(outer, CROSS))[row, column] & (near > ALL)
    points = np.column_stack([template.points[pixels, :2], -height[pixels]])
    moved = carried(points, guess)
    found = looked_up(current.beside, moved)
    residual, known = found[2] + moved[2], found[3] > ALL
    pixels[pixels] = known
    if np.count_nonzero(pixels) < LEAST_PX:
        return None
    pitch_x, pitch_y = reference.touch.mm_per_px
    return Rim(
        pixels=pixels,
        residual=residual[known],
        change=template.change[:, 2, pixels].T,
        points=points[known],
        weight=1 / (WIDTH_PX * pitch_x * pitch_y),
    )
