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
from recon.images import UNREADABLE_ARCHIVE, read_frame
from recon.presses import press_reader
from sensor.dataset import read_dataset
from sensor.errors import WedgeError
from sensor.toml import Pair

READ_HEAD = {
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
}
"""By the version of an ``.npy``; the third is of names in other letters, which no map has."""


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
        WedgeError: the set, a frame or a truth of it cannot be read, or a truth has another size
            than its frame. The sentence names the file.
    """
    dataset = read_dataset(folder)
    reader = press_reader(dataset)
    for path in depth_files(folder):
        frame = reader.unwarp(read_frame(folder, f"{path.stem}.jpg"))
        shape = frame.shape[:2]
        held = folder / "held" / path.name
        yield RenderedPress(
            name=path.stem,
            difference=frame - reader.blank,
            depth_mm=read_depth(path, shape, dataset.card.mm_per_px),
            held=_read_map(held, shape, "b", "booleans") if held.is_file() else None,
            mm_per_px=dataset.card.mm_per_px,
        )


def read_depth(path: Path, shape: tuple[int, ...], mm_per_px: Pair) -> DepthMap:
    """The true depth of a frame, ``truth/NAME.npy``.

    Args:
        path: of the file.
        shape: (h, w) of the unwarped frame.
        mm_per_px: of the unwarped frame, x and y.

    Raises:
        WedgeError: the file is missing or damaged, or holds anything but finite depths of this
            shape, in mm as floats, some of them above zero, none of them more than the frame's
            shorter side.
    """
    depth_mm = _read_map(path, shape, "f", "depths in mm as floats")
    if not np.isfinite(depth_mm).all() or not (depth_mm > 0).any():
        raise WedgeError(
            f"{path} must hold finite depths in mm, some of them above zero: make the file again."
        )
    height, width = shape
    side_mm = min(width * mm_per_px[0], height * mm_per_px[1])
    if (deepest := float(depth_mm.max())) > side_mm:
        raise WedgeError(
            f"{path} holds depths up to {deepest:g} mm, but its frame is only {side_mm:.3g} mm "
            "wide: write depths in mm."
        )
    return depth_mm


def _read_map(path: Path, shape: tuple[int, ...], kind: str, what: str) -> np.ndarray:
    """An array of this shape and kind; what its file says of it is judged before it is read."""
    if not path.is_file():
        raise WedgeError(f"{path} is missing.")
    try:
        with path.open("rb") as stream:
            found, _, dtype = READ_HEAD[np.lib.format.read_magic(stream)](stream)
            if found == shape and dtype.kind == kind:
                stream.seek(0)
                array: np.ndarray = np.lib.format.read_array(stream, allow_pickle=False)
                return array
    except (KeyError, *UNREADABLE_ARCHIVE) as error:
        raise WedgeError(
            f"{path} is not a whole numpy array, it may be truncated: copy or make it again."
        ) from error
    height, width = shape
    raise WedgeError(
        f"{path} does not hold {height} rows of {width} {what}, which its frame needs: copy or "
        "make it again."
    )
