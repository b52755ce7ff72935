# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames of a unit by what a person names: images one by one, or whatever gives a stream."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from app._sources import open_where
from sensor.errors import WedgeError

if TYPE_CHECKING:
    from recon.arrays import Frame
    from recon.unwarp import Unwarp

IMAGES = (".png", ".jpg", ".jpeg")


def is_image(where: str) -> bool:
    """Whether a name is an image file's, or one frame's of an archive."""
    file, _, index = where.partition("#")
    return bool(index) or Path(file).suffix.lower() in IMAGES


def read_checked(name: str, unwarp: "Unwarp") -> "Frame":
    """Read an image that must be a frame of this unit.

    Raises:
        WedgeError: it cannot be read or has another size; the sentence names it.
    """
    from recon.images import read_frame

    frame = read_frame(Path(name).parent, Path(name).name)
    try:
        unwarp.check(frame)
    except WedgeError as error:
        raise WedgeError(f"{name}: {error}") from error
    return frame


def unit_frames(
    where: tuple[str, ...], unwarp: "Unwarp", most: int | None = None
) -> "Iterator[tuple[str, int, Frame]]":
    """Name, time in ns and pixels of every frame, in order.

    Args:
        where: image files, or one video, folder, dataset, recording, camera or address.
        unwarp: of the unit that the frames must come from.
        most: stop after so many; by default at the end.

    Raises:
        WedgeError: nothing was named, something cannot be read, or a frame has another size.
    """
    if not where:
        raise WedgeError("no frames were named: give images, a video, a folder or an address.")
    if most is not None and most < 1:
        raise WedgeError(f"--frames {most} must be at least 1.")
    if all(is_image(name) for name in where):
        for index, name in enumerate(where[:most]):
            yield name, index, read_checked(name, unwarp)
        return
    if len(where) > 1:
        raise WedgeError("name either images or one video, folder, recording or address.")
    with open_where(where[0]) as source:
        count = 0
        for timed in source:
            frame = timed.image()
            try:
                unwarp.check(frame)
            except WedgeError as error:
                raise WedgeError(f"{where[0]}, frame {timed.index}: {error}") from error
            yield f"{timed.index:05d}", timed.time_ns, frame
            count += 1
            if count == most:
                return
        if not count:
            raise WedgeError(f"{where[0]} gave no frame.")
