# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames of a unit by what a person names: images one by one, or whatever gives a stream."""

import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from app._sources import is_dataset, open_where, refuse_nowhere
from sensor.dataset import IMAGES
from sensor.errors import WedgeError
from sensor.interrupt import UntilInterrupted

if TYPE_CHECKING:
    from recon.arrays import Frame
    from recon.geometry.unwarp import Unwarp
    from recon.stream import Counts, TimedFrame


def is_image(where: str) -> bool:
    """Whether a name is an image file's, or one frame's of an archive."""
    if where.startswith(("http://", "https://")) or Path(where).is_dir():
        return False
    if Path(where).suffix.lower() in IMAGES:
        return True
    return "#" in where and not Path(where).is_file()


def read_checked(name: str, unwarp: "Unwarp") -> "Frame":
    """Read an image that must be a frame of this unit.

    Raises:
        WedgeError: it cannot be read or has another size; the sentence names it.
    """
    from recon.images import read_frame

    frame = read_frame(Path(name).parent, Path(name).name)
    try:
        unwarp.check_colored(frame)
    except WedgeError as error:
        raise WedgeError(f"{name}: {error}") from error
    return frame


@dataclass(frozen=True, kw_only=True)
class UnitFrame:
    """A frame that came, whether or not anything can be made of it."""

    number: int
    """From 0, in its source or among the images that were named."""
    name: str
    """The file's as it was named, or its number in a stream."""
    file: str
    """The image's, as it was named or in its folder; none in a video, recording or live stream."""
    time_ns: int
    image: "Frame | None"
    """``None`` where it is damaged, or of another size than the unit's frames."""
    flaw: str = ""
    """In what way."""
    misfit: bool = False
    """It is whole, but of another size."""
    still: bool = False
    """It is the frame before to the last bit, as no camera's is."""

    @property
    def shown(self) -> str:
        """Its name, and its file's where that is another, for a table."""
        return self.name if self.file in ("", self.name) else f"{self.name} {self.file}"


class UnitFrames:
    """Frames of one unit in their order, until they, Ctrl-C or SIGTERM end; what to say of them."""

    def __init__(
        self,
        frames: Iterable[UnitFrame],
        counts: "Counts | None" = None,
        *,
        live: bool = False,
        timed: bool = False,
        apart: bool = False,
    ) -> None:
        self._until = UntilInterrupted(frames)
        self._counts = counts
        self._came = self._useless = self._still = 0
        self._flaw = self._earlier = ""
        self._failed: WedgeError | None = None
        self.live = live
        """Whether they have no end of their own."""
        self.timed = timed
        """Whether they bear times, and do not only follow a rate."""
        self.apart = apart
        """Whether none has to do with the one before: images that were named, or a dataset's."""

    def __iter__(self) -> Iterator[UnitFrame]:
        """Give each frame that comes.

        Raises:
            WedgeError: the source failed before its first whole frame; later, ``tell`` raises it.
        """
        import numpy as np

        before: Frame | None = None
        latest_ns: int | None = None
        try:
            for frame in self._until:
                self._came += 1
                if self.timed and latest_ns is not None and frame.time_ns < latest_ns:
                    self._earlier = self._earlier or frame.name
                latest_ns = frame.time_ns
                if frame.image is None:
                    self._useless += 1
                    self._flaw = self._flaw or f"{frame.name}: {frame.flaw}"
                elif before is not None and np.array_equal(before, frame.image):
                    self._still += 1
                    frame = replace(frame, still=True)
                before = frame.image
                yield frame
        except WedgeError as error:
            if self._counts is None or self._came == self._useless:
                raise
            self._failed = error
        if self.interrupted and self._came == self._useless:
            self.give_up()

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C, SIGTERM or SIGHUP has ended them."""
        return self._until.interrupted

    def give_up(self) -> NoReturn:
        """End as what interrupted them does elsewhere: there is nothing to keep."""
        self._until.give_up()

    @property
    def remarks(self) -> list[str]:
        """What a person should know of the frames that came, in sentences."""
        said = []
        if self._useless:
            said.append(f"Left out {self._useless} of {self._came} frames: {self._flaw}")
        if self._still:
            said.append(
                f"The stream stood still: {self._still} of {self._came} frames are identical to "
                "the one before, to the last bit."
            )
        if self._earlier:
            said.append(
                f"Times go backwards, first at frame {self._earlier}: what is told in seconds may "
                "be wrong."
            )
        if self._counts is not None and self._counts.dropped:
            said.append(f"Lost in transmission: {self._counts.dropped} frames.")
        if self._counts is not None and self._counts.corrupt:
            said.append(f"Damaged and left out: {self._counts.corrupt} parts of the stream.")
        if self._counts is not None and self._counts.remark:
            said.append(self._counts.remark)
        if self._failed is not None:
            said.append(str(self._failed))
        if self.interrupted:
            said.append(f"Ended by {self._until.asked_by} after {self._came} frames.")
        return said

    def tell(self) -> None:
        """Say them on stderr, once all is written.

        Raises:
            WedgeError: the source failed after its first frame.
        """
        for remark in self.remarks:
            if remark != str(self._failed):
                print(remark, file=sys.stderr)
        if self._failed is not None:
            raise self._failed


@contextmanager
def unit_frames(
    where: Sequence[str], unwarp: "Unwarp", most: int | None = None
) -> Iterator[UnitFrames]:
    """Open what gives the frames of a unit.

    Of images that were named one by one, each must be a frame of the unit, and all are checked
    before the first is given. In whatever gives a stream, frames that are damaged or have another
    size are given without their pixels.

    Args:
        where: image files, or one video, folder, dataset, recording, camera or address.
        unwarp: of the unit that the frames must come from.
        most: stop after so many; by default at the end.

    Raises:
        WedgeError: nothing was named, something cannot be read, the first whole frame has another
            size than the unit's, or no frame is whole.
    """
    if not where:
        raise WedgeError("no frames were named: give images, a video, a folder or an address.")
    if most is not None and most < 1:
        raise WedgeError(f"--frames {most} must be at least 1.")
    if all(is_image(name) for name in where):
        for name in where[:most]:
            read_checked(name, unwarp)
        yield UnitFrames(_images(where[:most], unwarp), apart=True)
    elif len(where) > 1:
        raise WedgeError("name either images, or one video, folder, recording or address.")
    else:
        refuse_nowhere(where[0], "images", "one frame of an archive, as frames.npz#17")
        with open_where(where[0]) as source:
            came = _streamed(where[0], islice(source, most), source.counts, unwarp)
            yield UnitFrames(
                came,
                source.counts,
                live=source.live,
                timed=source.timed,
                apart=is_dataset(where[0]),
            )


def _images(names: Sequence[str], unwarp: "Unwarp") -> Iterator[UnitFrame]:
    for index, name in enumerate(names):
        image = read_checked(name, unwarp)
        yield UnitFrame(number=index, name=name, file=name, time_ns=index, image=image)


def _streamed(
    where: str, source: "Iterable[TimedFrame]", counts: "Counts", unwarp: "Unwarp"
) -> Iterator[UnitFrame]:
    whole, flaw = 0, ""
    for timed in source:
        number, file, time_ns = timed.index, timed.file, timed.time_ns
        name = f"{number:05d}"
        image: Frame | None = None
        try:
            image = timed.image()
            unwarp.check_colored(image)
            whole += 1
        except WedgeError as error:
            flaw = flaw or f"{where}, frame {timed.index}: {error}"
            if image is not None and not whole:  # another sensor's, most likely
                raise WedgeError(f"{where}, frame {timed.index}: {error}") from error
            yield UnitFrame(
                number=number,
                name=name,
                file=file,
                time_ns=time_ns,
                image=None,
                flaw=str(error),
                misfit=image is not None,
            )
        else:
            yield UnitFrame(number=number, name=name, file=file, time_ns=time_ns, image=image)
    if not whole:
        raise WedgeError(flaw or counts.no_frame(where))
