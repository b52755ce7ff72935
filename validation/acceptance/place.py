# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Has the camera moved, is the unwarped picture straight, do frames come in time?"""

from collections.abc import Sequence

import cv2
import numpy as np

from recon.arrays import Unwarped
from recon.markers.lattice import Points, grow_lattice
from recon.presses import PressSet
from validation.acceptance.gel import smooth
from validation.acceptance.limits import Parts
from validation.acceptance.roundness import Roundness

LEAST_DOTS = 12
HIGH_PASS_PX = 6.0
LEAST_FRAMES = 10


def picture_values(
    presses: PressSet, calibrated: Unwarped, round_discs: Roundness | None
) -> tuple[dict[str, Parts], dict[str, str]]:
    """Shift and unwarp; and why what is missing was not measured."""
    values: dict[str, Parts] = {
        "moved_px": {"": shift_px(calibrated, presses.unwarp(presses.background))}
    }
    absent: dict[str, str] = {}
    if round_discs is None:
        absent["out_of_round_share"] = "no disc lies wholly inside the frame"
    else:
        values["out_of_round_share"] = {"": round_discs.out_of_round}
    bent = None if presses.dots is None else bent_grid_share(presses.dots.markers.position_px)
    if bent is None:
        absent["bent_grid_share"] = "the gel has no grid of dots"
    else:
        values["bent_grid_share"] = {"": bent}
    if presses.lens is None:
        absent["lens_rms_px"] = "no chessboards were taken of this camera"
    else:
        values["lens_rms_px"] = {"": presses.lens.rms_px}
    return values, absent


def shift_px(before: Unwarped, now: Unwarped) -> float:
    """How far the blank gel's picture has moved since the calibration."""
    if before.shape != now.shape:
        return float("inf")
    flat = [
        (image.mean(-1) - smooth(image, HIGH_PASS_PX).mean(-1)).astype(np.float64)
        for image in (before, now)
    ]
    window = cv2.createHanningWindow(flat[0].shape[::-1], cv2.CV_64F)
    (x_px, y_px), _ = cv2.phaseCorrelate(flat[0], flat[1], window)
    return float(np.hypot(x_px, y_px))


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
    """Frame rate, jitter and loss of frames by their time stamps.

    The rate follows from the median interval of frames that follow each other; jitter is the 95 %
    quantile of how far an interval is from that.

    Args:
        times_ns: when each frame was taken.
        indices: their numbers; a step above 1 is lost frames.
    """
    steps = np.diff(indices)
    intervals_ms = (np.diff(np.array(times_ns, np.int64)) / 1e6)[steps == 1]
    if len(intervals_ms) + 1 < LEAST_FRAMES or np.median(intervals_ms) <= 0:
        return {}
    usual_ms = float(np.median(intervals_ms))
    lost = int((steps - 1).clip(0).sum())
    return {
        "frame_rate_hz": {"": 1e3 / usual_ms},
        "jitter_ms": {"": float(np.quantile(np.abs(intervals_ms - usual_ms), 0.95))},
        "lost_share": {"": lost / (len(indices) + lost)},
    }
