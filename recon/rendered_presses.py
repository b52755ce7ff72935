# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Presses of a rendered set: what the camera sees of them, beside the skin's true depth.

Such a set is a dataset folder whose frames ``NAME.jpg`` need no label, as ``truth/NAME.npy`` holds
the depth of every pixel of the unwarped frame and ``held/NAME.npy`` which of them the object holds
(``benchmarks/rendered_presses.py`` makes them).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from recon.arrays import ContactMask, DepthMap, Difference
from recon.images import read_frame
from recon.presses import press_reader
from sensor.dataset import read_dataset
from sensor.errors import WedgeError
from sensor.toml import Pair


@dataclass(frozen=True, kw_only=True)
class RenderedPress:
    """One press, unwarped."""

    name: str
    difference: Difference
    """(h, w, 3), to the blank gel."""
    depth_mm: DepthMap
    """(h, w), of the skin, below where it rests."""
    held: ContactMask | None
    """(h, w), where the object touches; ``None`` where the set does not say."""
    mm_per_px: Pair


def depth_files(folder: Path) -> list[Path]:
    """The true depths of a rendered set, one for every press, in the order of their names."""
    return sorted((folder / "truth").glob("*.npy"))


def rendered_presses(folder: Path) -> Iterator[RenderedPress]:
    """The presses of a set one at a time, in the order of their names.

    Raises:
        WedgeError: the set or a frame of it cannot be read, or a truth has another size than its
            frame. The sentence names the file.
    """
    dataset = read_dataset(folder)
    reader = press_reader(dataset)
    for path in depth_files(folder):
        frame = reader.unwarp(read_frame(folder, f"{path.stem}.jpg"))
        depth_mm = _of_size(path, frame.shape[:2])
        held_file = folder / "held" / path.name
        yield RenderedPress(
            name=path.stem,
            difference=frame - reader.blank,
            depth_mm=depth_mm,
            held=_of_size(held_file, frame.shape[:2]) if held_file.is_file() else None,
            mm_per_px=dataset.card.mm_per_px,
        )


def _of_size(path: Path, shape: tuple[int, ...]) -> np.ndarray:
    truth: np.ndarray = np.load(path, allow_pickle=False)
    if truth.shape != shape:
        raise WedgeError(f"{path} has another size than its frame.")
    return truth
