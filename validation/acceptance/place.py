# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Has the camera moved, is the unwarped picture straight, do frames come in time?"""

from collections.abc import Sequence

import numpy as np

from recon.arrays import Unwarped
from recon.markers.lattice import Points, grow_lattice
from recon.presses import PressSet
from validation.acceptance.limits import Parts
from validation.acceptance.moved import moved_px
from validation.acceptance.roundness import Roundness

LEAST_DOTS = 12
LEAST_FRAMES = 10


def picture_values(
    presses: PressSet, before: Unwarped, now: Unwarped, round_discs: Roundness | None
) -> tuple[dict[str, Parts], dict[str, str]]:
    """Motion and unwarp; and why what is missing was not measured.

    Args:
        presses: as they were read.
        before: the blank gel at the calibration.
        now: the set's, unwarped as the unit does: a set has corners of its own.
        round_discs: how round the presses are.
    """
    values: dict[str, Parts] = {}
    absent: dict[str, str] = {}
    moved = moved_px(before, now)
    if moved is None:
        absent["moved_px"] = "the blank gel is too smooth, or its picture too coarse, to tell"
    else:
        values["moved_px"] = {"": moved}
    if round_discs is None:
        absent["out_of_round_share"] = "no disc lies completely inside the frame"
    else:
        values["out_of_round_share"] = {"": round_discs.out_of_round}
    bent = None if presses.dots is None else bent_grid_share(presses.dots.markers.position_px)
    if bent is None:
        absent["bent_grid_share"] = "the gel has no grid of dots"
    else:
        values["bent_grid_share"] = {"": bent}
    if presses.lens is None:
        absent["lens_rms_px"] = "no chessboard pictures were taken with this camera"
    else:
        values["lens_rms_px"] = {"": presses.lens.rms_px}
    return values, absent


def bent_grid_share(dots_px: Points) -> float | None:
    """How far dots at rest lie from the straight grid that fits them best.

    Root mean square over the dots, of the spacing. The grid may be turned, and of another pitch
    along each axis: what remains is bent.
    """
    lattice = grow_lattice(dots_px)
    if lattice is None or len(lattice.dots) < LEAST_DOTS:
        return None
    places = dots_px[lattice.dots]
    terms = np.column_stack([lattice.cells, np.ones(len(lattice.cells))]).astype(float)
    straight = terms @ np.linalg.lstsq(terms, places, rcond=None)[0]
    off_px = float(np.sqrt(((places - straight) ** 2).sum(1).mean()))
    return off_px / lattice.spacing_px


def timing_values(times_ns: Sequence[int], indices: Sequence[int]) -> dict[str, Parts]:
    """Frame rate, jitter, gaps and loss of frames by their time stamps.

    The rate is that of the frames that came, over all of their time, so that stalls count; jitter
    is the 95 % quantile of how far the time from frame to frame is from its median. Where any time
    does not grow, no length of time can be trusted, and neither these nor the longest gap is told.

    Args:
        times_ns: when each frame was taken.
        indices: their numbers; a step above 1 is lost frames. Empty where they bear none: then
            frames are taken to be lost in times that are about as long as several.
    """
    if len(times_ns) < LEAST_FRAMES:
        return {}
    steps = np.diff(indices if len(indices) else np.arange(len(times_ns)))
    lost = int((steps - 1).clip(0).sum())
    intervals_ms = np.diff(np.array(times_ns, np.int64)) / 1e6
    backward = int((intervals_ms <= 0).sum())
    found: dict[str, Parts] = {"backward_steps": {"": float(backward)}}
    if len(indices):
        found["lost_share"] = {"": lost / (len(indices) + lost)}
    if backward:
        return found
    if not len(indices):  # a frame that was lost is no time that is wrong
        steps = np.rint(intervals_ms / np.median(intervals_ms))
    between_ms = intervals_ms / steps.clip(1)
    off_ms = np.abs(between_ms - np.median(between_ms))
    return found | {
        "frame_rate_hz": {"": 1e3 * len(intervals_ms) / float(intervals_ms.sum())},
        "jitter_ms": {"": float(np.quantile(off_ms, 0.95))},
        "longest_gap_ms": {"": float(intervals_ms.max())},
    }
