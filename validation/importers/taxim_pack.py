# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Taxim's ``dataPack.npz``: frames and the circles drawn on them in one archive, BGR."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from recon.arrays import Frame
from recon.images import write_image
from sensor.dataset import BallLabel
from sensor.errors import WedgeError
from validation.importers.drawn import drawn_label, read_numbers, refuse_count

BACKGROUND, FRAMES = "background.png", "frames.npz"
"""As they are called in the dataset."""


@dataclass(frozen=True, kw_only=True)
class TaximPack:
    """What one archive holds, checked."""

    background: Frame
    frames: np.ndarray
    """[n, height, width, 3] uint8, RGB."""
    labels: tuple[BallLabel, ...]


def read_taxim_pack(path: Path) -> TaximPack:
    """Read ``f0``, ``imgs``, ``touch_center`` and ``touch_radius``; the rest is not looked at.

    Raises:
        WedgeError: the archive is damaged, too large or incomplete, its parts do not fit each
            other, or its frames are no grey levels of 0 to 255.
    """
    pack = read_numbers(path, ("f0", "imgs", "touch_center", "touch_radius"))
    frames, background = pack["imgs"], pack["f0"]
    if frames.ndim != 4 or frames.shape[3] != 3 or background.shape != frames.shape[1:]:
        raise WedgeError(
            f"{path}: imgs must be [n, height, width, 3] and f0 one such frame, not "
            f"{list(frames.shape)} and {list(background.shape)}."
        )
    if not background.size:
        raise WedgeError(f"{path}: its frames have no pixels.")
    centers, radii = pack["touch_center"], pack["touch_radius"].ravel()
    if centers.shape != (len(frames), 2) or len(radii) != len(frames):
        raise WedgeError(
            f"{path}: it must have as many centres and radii as frames, {len(frames)}."
        )
    refuse_count(path, len(frames))
    circles = np.column_stack([centers, radii]).astype(float).tolist()
    return TaximPack(
        background=_gray_levels(path, "f0", background)[..., ::-1],
        frames=_gray_levels(path, "imgs", frames)[..., ::-1],
        labels=tuple(
            drawn_label(f"{FRAMES}#{index}", circle, path) for index, circle in enumerate(circles)
        ),
    )


def write_taxim_frames(pack: TaximPack, folder: Path) -> None:
    """Write the blank gel and the frames that the labels name into a dataset's folder."""
    write_image(folder / BACKGROUND, pack.background)
    np.savez(folder / FRAMES, frames=pack.frames)


def _gray_levels(path: Path, name: str, array: np.ndarray) -> np.ndarray:
    """As uint8; other values would wrap round and look like some other picture."""
    low, high = float(array.min()), float(array.max())
    if not 0 <= low <= high <= 255:  # nor NaN, which compares as false
        raise WedgeError(
            f"{path}: {name} must hold grey levels of 0 to 255, not {low:g} to {high:g}."
        )
    if array.dtype.kind != "f":
        return array.astype(np.uint8, copy=False)
    if high <= 1:
        raise WedgeError(f"{path}: {name} holds floats of at most 1: multiply them by 255.")
    return np.rint(array).astype(np.uint8)
