# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the commands share that take frames from somewhere: sources by name, rates, units."""

import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from sensor.dataset import CARD_FILE
from sensor.errors import WedgeError

if TYPE_CHECKING:
    from recon.arrays import Frame
    from recon.stream import FrameSource, TimedFrame

RATE_OVER_S = 2.0
FAR_TOO_MANY = 1e9
"""Of seconds, or of times as fast: more than clocks can wait."""


def open_where(where: str) -> "FrameSource":
    """A source by what a person types; beside addresses and files, datasets known by name.

    Raises:
        WedgeError: it is none, or cannot be opened.
    """
    from recon.stream import open_source
    from validation.datasets import dataset_folder, known_datasets

    refuse_nowhere(where)
    return open_source(dataset_folder(where) if where in known_datasets() else where)


def refuse_nowhere(where: str, *also: str) -> None:
    """Refuse what ``open_where`` could never open, also later; nothing is opened.

    Args:
        where: what a person typed.
        also: what else the command takes, for the sentence.

    Raises:
        WedgeError: it is neither an address, nor there, nor of a kind that gives frames.
    """
    from recon.stream import refuse_no_source
    from validation.datasets import known_datasets

    if where not in known_datasets():
        refuse_no_source(where, ("a dataset that `wedge data list` names", *also))


def is_dataset(where: str) -> bool:
    """Whether frames from there are presses that have nothing to do with each other."""
    from validation.datasets import known_datasets

    return where in known_datasets() or (Path(where) / CARD_FILE).is_file()


def open_live(where: str, *, repeat: bool = False) -> "FrameSource":
    """A source that gives frames at their pace, files too.

    Raises:
        WedgeError: it is none, or cannot be opened.
    """
    from recon.stream import Paced

    source = open_where(where)
    return source if source.live else Paced(source, repeat=repeat)


def whole_frames(source: "FrameSource", most: int) -> "Iterator[tuple[TimedFrame, Frame]]":
    """The whole ones among a source's first frames, with their pixels; the others are counted.

    Raises:
        WedgeError: none is whole.
    """
    whole, flaw = 0, ""
    for frame in islice(source, most):
        try:
            image = frame.image()
        except WedgeError as error:
            source.counts.add_corrupt()
            flaw = flaw or f"{source.name}, frame {frame.index}: {error}"
            continue
        whole += 1
        yield frame, image
    if not whole:
        raise WedgeError(flaw or source.counts.no_frame(source.name))


def what_was_damaged(source: "FrameSource") -> str:
    """How many frames of a source were damaged, and what to know of it; empty if all is well."""
    counts = source.counts
    frames = "1 damaged frame." if counts.corrupt == 1 else f"{counts.corrupt} damaged frames."
    damage = frames if counts.corrupt else ""
    return " ".join(filter(None, (damage, counts.remark)))


@contextmanager
def unit_of(where: str, unit: Path | None) -> Iterator[Path | None]:
    """The unit folder that was named, or else the one inside a recording."""
    from recon.stream import McapSource, is_recording

    if unit is not None or not is_recording(where):
        yield unit
        return
    with TemporaryDirectory() as folder:
        yield McapSource(Path(where)).save_unit(Path(folder))


def refuse_few(name: str, value: float | None) -> None:
    """Refuse a number of seconds or a speed that is not above zero, or beyond any sense.

    Raises:
        WedgeError: names the option.
    """
    if value is not None and not 0 < value < FAR_TOO_MANY:
        raise WedgeError(f"--{name} {value:g} must be above zero and below {FAR_TOO_MANY:g}.")


class Rate:
    """Events a second over the last two seconds, or since the last but one where they are rarer."""

    def __init__(self) -> None:
        self._times_s: deque[float] = deque(maxlen=1000)

    def tick(self) -> None:
        """Count one event."""
        self._times_s.append(time.monotonic())

    @property
    def hz(self) -> float:
        """How many a second lately."""
        times_s, now_s = self._times_s, time.monotonic()
        while len(times_s) > 2 and times_s[0] < now_s - RATE_OVER_S:
            times_s.popleft()
        if len(times_s) < 2:
            return 0.0
        gap_s = max((times_s[-1] - times_s[0]) / (len(times_s) - 1), 1e-9)
        silent_s = now_s - times_s[-1]
        return 0.0 if silent_s > max(RATE_OVER_S, 2 * gap_s) else 1 / gap_s
