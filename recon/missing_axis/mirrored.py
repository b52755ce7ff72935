# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A contact that the frame cuts along the lights, made whole by its mirror image.

Whatever infers the unseen slope takes each line of lights to begin and to end in gel that rests: a
contact that the frame cuts would be raised to zero at the edge, and with it all of it. So the frame
is continued beyond that edge by its mirror image, in which the line goes on down to gel that rests,
and what is found is cropped. Gel that only touches the edge, as a collar does, does rest there, and
to know that is worth much: so it is mirrored where the edge cuts something, and nowhere else.
"""

import cv2
import numpy as np
from jaxtyping import Bool, Float

from recon.arrays import ContactMask, GradientField
from recon.lights import Axis
from recon.missing_axis.moved import FLANK, near_disturbed
from recon.windows import window_about

Slopes = Float[np.ndarray, "h w"]
Lines = Bool[np.ndarray, " w"]
Beyond = tuple[int, int]
"""How many rows lie beyond the first and the last; of lights along x, columns."""

STEEP = 0.1
"""A line is steep at the edge if it is steeper there than this share of the steepest slope."""
CUT = 0.15
"""Steep lines are cut if together they are deeper at the edge than this share of their deepest."""
CUT_BY_PIXELS = 0.4
"""The same for an estimator that sees single pixels: with one light it reads collars that touch the
edge as steep, and puts the edge at up to 0.34 of their deepest."""
WHOLE, WHOLE_BY_PIXELS = 0.2, 0.6
"""Nothing is cut unless steep and level lines together are deeper at the edge than this share of
what all lines' deepest come to; the second by single pixels. Balls cut at 0.8 radii come to 0.27
and more; whole contacts of a real sensor that would else pass for cut come to 0.13, and to 0.53 as
single pixels show them with one light."""
LEVEL = 0.75
"""A line is level at the edge if it is deeper there than this share of its deepest: it is cut at a
crest or on flat ground, which show no slope."""
MANY = 0.3
"""Level lines are cut if their deepest come to more than this share of all lines': single lines
err."""
REST = 0.5
"""A line that is level at the edge, but shows no slope next to it over more than this share of its
disturbed gel, lacks a flank that single pixels did not see: it is not cut."""
HIGH = 0.1
"""Rows within this share of the way from the highest to the deepest count as the highest."""


def rows_beyond(
    disturbed: ContactMask, gradient: GradientField, unseen: Axis, *, hinted: bool
) -> Beyond:
    """How far a frame should be mirrored beyond each edge that the lights run up to.

    Where one edge cuts a contact, the whole frame is; where both do, as far as the gel between
    them that lies highest, so that lines end in what rests.

    Args:
        disturbed: where the colour changed.
        gradient: (h, w, 2), mm/mm, of the estimator.
        unseen: the axis across the lights.
        hinted: whether the estimator looks around a pixel.
    """
    slopes, depth, side_px = _along_lines(disturbed, gradient, unseen)
    least = (CUT, WHOLE, np.inf) if hinted else (CUT_BY_PIXELS, WHOLE_BY_PIXELS, REST)
    before, after = cut_edges(slopes, depth, side_px, *least)
    rows = len(slopes)
    if before and after:
        highest = _highest_row(depth)
        return highest, rows - highest
    return rows * before, rows * after


def cut_edges(
    slopes: Slopes, depth: Slopes, side_px: int, least: float, whole: float, rest: float
) -> tuple[bool, bool]:
    """Whether something is cut by the first row, and by the last.

    Args:
        slopes: ∂depth/∂y of disturbed gel, the lights being along y.
        depth: their sum along each line, nowhere negative.
        side_px: of the squares over which slopes at an edge are averaged.
        least: share of their deepest at which steep lines are cut.
        whole: share of all lines' deepest that lines which are cut have at the edge, at least.
        rest: share of the disturbed gel along a line that it may lie away from the edge.
    """
    deepest, seen = depth.max(axis=0, initial=0), slopes != 0
    seen_px = np.maximum(seen.sum(axis=0), 1)

    def cut(edge: int, steep: Lines) -> bool:
        deep = depth[edge]
        rests_px = (seen if edge == 0 else seen[::-1]).argmax(axis=0)
        level = (deep > LEVEL * deepest) & (rests_px / seen_px <= rest)
        if deep[steep | level].sum() <= whole * deepest.sum():
            return False
        return bool(
            deep[steep].sum() > least * deepest[steep].sum()
            or deepest[level].sum() > MANY * deepest.sum()
        )

    first, last = _steep_at_edges(slopes, side_px)
    return cut(0, first), cut(-1, last)


def is_cut_twice(disturbed: ContactMask, gradient: GradientField, unseen: Axis) -> bool:
    """Whether a contact runs on beyond both edges, so that no line of lights shows where it ends.

    Args:
        disturbed: where the colour changed.
        gradient: (h, w, 2), mm/mm.
        unseen: the axis across the lights.
    """
    slopes, depth, side_px = _along_lines(disturbed, gradient, unseen)
    first, last = _steep_at_edges(slopes, side_px)
    deepest = depth.max(axis=0, initial=0)
    at_zero = np.minimum(depth[0], depth[-1]) <= CUT * deepest
    return bool(deepest[first & last & at_zero].sum() > MANY * deepest.sum())


def mirrored(
    disturbed: ContactMask, gradient: GradientField, unseen: Axis, beyond: Beyond
) -> tuple[Bool[np.ndarray, "rows columns"], Float[np.ndarray, "rows columns 2"]]:
    """What is disturbed and its slopes, continued: those along the lights lead the other way."""
    along = 0 if unseen == "x" else 1
    around = [beyond if axis == along else (0, 0) for axis in (0, 1)]
    wider = np.pad(gradient, [*around, (0, 0)], "symmetric")
    lines = np.moveaxis(wider[..., 1 - along], along, 0)
    lines[: beyond[0]] *= -1
    lines[len(lines) - beyond[1] :] *= -1
    return np.pad(disturbed, around, "symmetric"), wider


def within(wider: np.ndarray, unseen: Axis, beyond: Beyond) -> np.ndarray:
    """The frame's part of what was found for a mirrored one, (h, w) or (h, w, 2)."""
    along = 0 if unseen == "x" else 1
    inside = slice(beyond[0], wider.shape[along] - beyond[1])
    return np.ascontiguousarray(wider[inside] if along == 0 else wider[:, inside])


def _along_lines(
    disturbed: ContactMask, gradient: GradientField, unseen: Axis
) -> tuple[Float[np.ndarray, "rows lines"], Float[np.ndarray, "rows lines"], int]:
    """Slopes of disturbed gel, and their sum along each line, lifted to be nowhere negative.

    The lines run along y, whatever the lights do. Those that pass disturbed gel are told of, and
    some beside them: as many as the side in pixels, given as well, over which slopes are averaged.
    """
    known = gradient[..., 1]
    if unseen == "y":
        disturbed, known = disturbed.T, gradient[..., 0].T
    near = near_disturbed(disturbed)
    side_px = max(1, round(FLANK * min(near.shape)))
    lines = window_about(near, side_px)[1] if near.any() else slice(1)
    slopes = np.where(near[:, lines], known[:, lines], 0).astype(np.float32)
    depth = np.cumsum(slopes, axis=0)
    depth -= np.minimum(depth.min(axis=0), 0)
    return slopes, depth, side_px


def _steep_at_edges(slopes: Slopes, side_px: int) -> tuple[Lines, Lines]:
    """Which lines are steep at the first row, and at the last."""
    steep = np.abs(cv2.blur(slopes, (side_px, side_px)))
    least = STEEP * steep.max()
    return steep[0] > least, steep[-1] > least


def _highest_row(depth: Slopes) -> int:
    """The middle of the most rows on end that are hardly deeper than the highest one."""
    along = depth.sum(axis=1)
    low = along <= along.min() + HIGH * np.ptp(along)
    edges = np.flatnonzero(np.diff(low, prepend=False, append=False))
    starts, ends = edges[::2], edges[1::2]
    widest = (ends - starts).argmax()
    return int(starts[widest] + ends[widest]) // 2
