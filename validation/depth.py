# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Depth against the truth, press by press.

The truth is the ball's cap in closed form; it starts at the rim of the contact circle, so the
reconstruction's mean error just inside the rim is taken off first. On a domed gel the dent differs
from the cap by the gel's own curve, on the rendered standard by 0.016 mm: smaller differences
between estimators mean nothing there. Where a dataset knows the depth itself (``truth/NAME.npy``),
the reconstruction is judged against that inside the same circle, nothing taken off: beside it the
gel is dented, too, but hardly, and would dilute the error.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from recon.arrays import ContactMask, DepthMap
from recon.ball import BallCap, ball_cap
from recon.pixels import BallPress
from recon.rendered_presses import read_depth
from validation.intervals import Interval, bootstrap_intervals

RIM_WIDTH_PX = 1.5
PEAK_RADIUS = 0.1
"""Of the contact radius: the deepest point is a mean over this disc."""


@dataclass(frozen=True, kw_only=True)
class DepthErrors:
    """Depth errors inside the contact of one press."""

    file: str
    truth: str
    """What it was judged against: "ball cap" or "truth file"."""
    rmse_mm: float
    bias_mm: float
    """Mean of reconstruction minus truth."""
    peak_mm: float
    """Depth at the contact's centre; of a shape, where it is deepest."""
    peak_truth_mm: float


def rmse_interval_mm(errors: Sequence[DepthErrors], seed: int) -> Interval | None:
    """95 % interval of the mean RMSE over presses; ``None`` for too few of them."""
    rmse_mm = np.array([[error.rmse_mm] for error in errors])
    found = bootstrap_intervals(
        lambda drawn: drawn @ rmse_mm / drawn.sum(1, keepdims=True), len(errors), seed
    )
    return None if found is None else found[0]


def depth_errors(depth: DepthMap, press: BallPress, folder: Path) -> DepthErrors:
    """Judge a reconstruction of a press.

    Args:
        depth: of the dent, mm.
        press: what was pressed.
        folder: of the dataset, which may know the dent's depth.

    Raises:
        WedgeError: the truth file cannot be read or has another size.
    """
    truth = true_depth(depth, press, folder)
    depth = depth - truth.rim_mm
    error = (depth - truth.depth_mm)[truth.contact]
    disc = press.distance_mm < max(PEAK_RADIUS * press.contact_radius_mm, max(press.mm_per_px))
    return DepthErrors(
        file=press.file,
        truth=truth.name,
        rmse_mm=float(np.sqrt(np.mean(error**2))),
        bias_mm=float(error.mean()),
        peak_mm=float(depth[disc].mean()),
        peak_truth_mm=float(truth.depth_mm[disc].mean()),
    )


@dataclass(frozen=True, kw_only=True)
class TrueDepth:
    """What a reconstruction is judged against."""

    name: str
    """Either "ball cap" or "truth file"."""
    depth_mm: DepthMap
    """Of a cap zero outside the contact; a file may know the gel beside it."""
    contact: ContactMask
    """Inside the labelled circle."""
    rim_mm: float
    """Depth of the contact's rim, to be taken off the reconstruction."""


def true_depth(depth: DepthMap, press: BallPress, folder: Path) -> TrueDepth:
    """The truth of a press for a reconstruction of it.

    Raises:
        WedgeError: the truth file cannot be read or has another size.
    """
    known, cap = read_truth(folder, press), cap_of(press)
    if known is not None:
        return TrueDepth(name="truth file", depth_mm=known, contact=cap.contact, rim_mm=0.0)
    rim_width_mm = RIM_WIDTH_PX * press.contact_radius_mm / press.contact_radius_px
    rim = cap.contact & (press.distance_mm > press.contact_radius_mm - rim_width_mm)
    return TrueDepth(
        name="ball cap",
        depth_mm=cap.depth_mm,
        contact=cap.contact,
        rim_mm=float((depth - cap.depth_mm)[rim].mean()),
    )


def cap_of(press: BallPress) -> BallCap:
    """The cap that the ball of a press leaves, in closed form."""
    return ball_cap(
        press.size_px,
        press.center_px,
        press.contact_radius_mm,
        press.ball_radius_mm,
        press.mm_per_px,
    )


def read_truth(folder: Path, press: BallPress) -> DepthMap | None:
    """Depth that the dataset knows, where it does, in its ``truth_file``.

    Raises:
        WedgeError: the file cannot be read, or is not a depth map of the frame's size.
    """
    path = truth_file(folder, press.file)
    if not path.is_file():
        return None
    return read_depth(path, press.difference.shape[:2], press.mm_per_px)


def truth_file(folder: Path, frame: str) -> Path:
    """Where a dataset keeps the depth of a frame, if it knows it: ``truth/NAME.npy``.

    That of ``frames.npz#17`` is ``truth/frames-17.npy``.
    """
    file, _, index = frame.partition("#")
    stem = str(Path(file).with_suffix(""))
    return folder / "truth" / (f"{stem}-{index}.npy" if index else f"{stem}.npy")
