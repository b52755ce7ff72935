# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How far the compiled reconstruction is from the reference, on all presses of a set.

    python -m benchmarks.agreement taxim-gelsight twin-standard twin-finger wedge-lab known-depth
    python -m benchmarks.agreement taxim-gelsight twin-standard wedge-lab --estimator mlp

A unit is calibrated on all presses of a set, and reconstructs each both ways. The compiled way may
take gel as flat that the reference does not, or the other way round: given is what share of a
frame's pixels that is, by how much all other slopes differ at most, and depth. Then six presses,
and all shapes of a rendered set, are made smaller, if they are unwarped: depth is off by so much of
the frame's peak.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Bool, Float64

from recon.arrays import Frame
from recon.calibration import Calibration, unit_of_set
from recon.fast import FastReconstructor
from recon.images import read_frame
from recon.pipeline import Reconstructor
from sensor.arguments import ending_in_a_sentence
from sensor.dataset import Dataset, read_dataset
from validation.datasets import dataset_folder

SIZES_PX = ((320, 240), (200, 150), (160, 120), (97, 83), (64, 48))
PRESSES = 6


@dataclass(frozen=True, kw_only=True)
class Apart:
    """How far the two reconstructions of some frames are apart, frame by frame."""

    flat_in_one: Float64[np.ndarray, " n"]
    """Share of the pixels whose slopes are zero in one alone."""
    slope: Float64[np.ndarray, " n"]
    """Largest difference elsewhere, mm/mm."""
    depth_mm: Float64[np.ndarray, " n"]
    """Largest difference."""
    contact_rms_mm: Float64[np.ndarray, " n"]
    """Of the depth in the contact; NaN without one."""
    another_border: Bool[np.ndarray, " n"]


def apart(unit: Calibration, frames: Sequence[Frame]) -> Apart:
    """Both reconstructions of each frame, compared."""
    reference, fast = Reconstructor(unit), FastReconstructor(unit)
    rows = []
    for frame in frames:
        truth, touch = reference(frame), fast(frame)
        flat = truth.gradient.any(2) != touch.gradient.any(2)
        slope = np.abs(touch.gradient - truth.gradient)[~flat].max(initial=0)
        depth_mm = np.abs(touch.depth_mm - truth.depth_mm)
        held = depth_mm[truth.contact]
        rms_mm = np.sqrt(np.mean(held**2)) if held.size else np.nan
        rows.append((flat.mean(), slope, depth_mm.max(), rms_mm, touch.boundary != truth.boundary))
    flat_in_one, slopes, depths_mm, contact_rms_mm, border = np.array(rows, np.float64).T
    return Apart(
        flat_in_one=flat_in_one,
        slope=slopes,
        depth_mm=depths_mm,
        contact_rms_mm=contact_rms_mm,
        another_border=border > 0,
    )


def line(name: str, found: Apart) -> str:
    """What is said of a set."""
    other, depth_um = found.another_border, 1e3 * found.depth_mm
    return (
        f"{name}: {len(other)} presses; flat in one alone {np.median(found.flat_in_one):.1%} of "
        f"the pixels (median), {found.flat_in_one.max():.1%} at most; other slopes differ by "
        f"{found.slope.max():.1e} at most, depth by {depth_um.max():.1f} um, in the contact by "
        f"{1e3 * np.nanmean(found.contact_rms_mm):.1f} um (RMS, mean); {other.sum()} with another "
        f"border, without these depth differs by {depth_um[~other].max(initial=0):.1f} um at most"
    )


def few_frames(dataset: Dataset) -> list[Frame]:
    """Some presses, and all shapes of a rendered set."""
    files = [label.file for label in dataset.labels[:PRESSES]]
    shapes = sorted((dataset.folder / "truth").glob("*.npy"))
    files += [f"{path.stem}.jpg" for path in shapes]
    return [read_frame(dataset.folder, file) for file in files]


def smaller(unit: Calibration, size_px: tuple[int, int]) -> Calibration:
    """The same unit, of frames of another (width, height)."""
    card = unit.card
    pitch_x, pitch_y = (
        pitch_mm * own / other
        for pitch_mm, own, other in zip(card.mm_per_px, card.size_px, size_px, strict=True)
    )
    card = replace(card, frame_size_px=size_px, size_px=size_px, mm_per_px=(pitch_x, pitch_y))
    return replace(unit, background=resized(unit.background, size_px), card=card)


def resized(frame: Frame, size_px: tuple[int, int]) -> Frame:
    """A frame of another (width, height)."""
    return np.asarray(cv2.resize(frame, size_px, interpolation=cv2.INTER_AREA), np.uint8)


def depth_off(unit: Calibration, frames: list[Frame]) -> list[float]:
    """Largest difference of depth from the reference, of its peak, frame by frame."""
    reference, fast = Reconstructor(unit), FastReconstructor(unit)
    found = []
    for frame in frames:
        truth_mm = reference(frame).depth_mm
        found.append(float(np.abs(fast(frame).depth_mm - truth_mm).max() / truth_mm.max()))
    return found


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.agreement", description=__doc__)
    parser.add_argument("datasets", nargs="+", help="sets of ball presses, such as twin-standard")
    parser.add_argument("--estimator", default="default")
    options = parser.parse_args()
    with ending_in_a_sentence(parser):
        for name in options.datasets:
            dataset = read_dataset(dataset_folder(name))
            unit = unit_of_set(dataset, options.estimator)
            presses = [read_frame(dataset.folder, label.file) for label in dataset.labels]
            print(line(name, apart(unit, presses)), flush=True)
            if dataset.card.corners_px is not None:
                continue  # the frames are raw, and the corners hold in frames of this size only
            frames = few_frames(dataset)
            for size_px in SIZES_PX:
                off = depth_off(smaller(unit, size_px), [resized(f, size_px) for f in frames])
                print(
                    f"{name}, {size_px[0]}x{size_px[1]}: depth off by {np.median(off):.2%} of its "
                    f"peak, {max(off):.2%} at most (n {len(off)})"
                )


if __name__ == "__main__":
    main()
