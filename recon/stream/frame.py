# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""One frame with its times, and what gives frames: the contract of every source."""

import threading
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Literal, Protocol, runtime_checkable

from recon.arrays import Frame
from recon.stream.jpeg import decode_jpeg, jpeg_size_px
from sensor.errors import WedgeError

Clock = Literal["sensor", "mapped", "arrival", "file"]
"""Whose clock ``time_ns`` comes from: the sender's; the sender's uptime, laid so that the quickest
frame took no time; this machine's, as the frame arrived; or a file's, which may be any of these or
a count from its first frame."""


@dataclass(frozen=True, kw_only=True, slots=True)
class TimedFrame:
    """A camera frame as it came: a JPEG, pixels where it never was one, or what it suffers from."""

    index: int
    """Of this source, from 0; a step above 1 is frames that were lost on the way."""
    time_ns: int
    """When it was taken, since the Unix epoch; in a file without times, since its first frame."""
    arrived_ns: int
    """When it was here, by this machine's clock, or by the recorder's, since the Unix epoch."""
    clock: Clock = "arrival"
    """Whose clock ``time_ns`` is: ``"sensor"``, ``"mapped"``, ``"arrival"`` or ``"file"``."""
    jpeg: bytes | None = None
    """As it came; ``None`` where it never was one."""
    pixels: Frame | None = None
    """(h, w, 3) uint8 RGB, where it came as these."""
    flaw: str = ""
    """Why there is neither."""
    file: str = ""
    """Where each frame is a file: its name in the folder, or ``frames.npz#17``."""

    def image(self) -> Frame:
        """The frame, (h, w, 3) uint8 RGB.

        Raises:
            WedgeError: it is damaged.
        """
        if self.flaw:
            raise WedgeError(self.flaw)
        if self.pixels is not None:
            return self.pixels
        assert self.jpeg is not None
        return decode_jpeg(self.jpeg)

    @property
    def size_px(self) -> tuple[int, int] | None:
        """Width and height, as far as its head tells; nothing is decoded."""
        if self.pixels is not None:
            return self.pixels.shape[1], self.pixels.shape[0]
        return None if self.jpeg is None else jpeg_size_px(self.jpeg)

    def decoded(self) -> "TimedFrame":
        """The frame with its pixels.

        Raises:
            WedgeError: it is damaged.
        """
        return self if self.pixels is not None else replace(self, pixels=self.image())

    @property
    def latency_ms(self) -> float | None:
        """From sensor to here; ``None`` where the sender's clock says nothing about that."""
        return (self.arrived_ns - self.time_ns) / 1e6 if self.clock == "sensor" else None


@dataclass(kw_only=True, slots=True)
class Counts:
    """What a source met so far."""

    received: int = 0
    """Whole frames; some may be damaged inside."""
    dropped: int = 0
    """Frames that the sender had but did not send, as its numbering tells; none that its camera or
    its encoder lost."""
    numbered: bool = False
    """Whether the sender numbers its frames; where not, nobody knows what was dropped."""
    corrupt: int = 0
    """Damaged parts of the stream, and frames that nobody could use."""
    connections: int = 0
    """Above 1 by how often the stream was lost and is back."""
    remark: str = ""
    """What a person should know: that the connection is lost, that a clock is not set."""
    lost: bool = False
    """Whether the connection is lost and tried again: no frame comes until it is back."""

    _corrupting: threading.Lock = field(
        default_factory=threading.Lock, init=False, repr=False, compare=False
    )

    def add_corrupt(self, count: int = 1) -> None:
        """Count damage: who reads the stream and who decodes its frames may do so at once."""
        with self._corrupting:
            self.corrupt += count

    def no_frame(self, name: str) -> str:
        """That a source gave no frame, in a sentence."""
        if not self.corrupt:
            return f"{name} gave no frame."
        return f"{name} gave no whole frame: {self.corrupt} damaged."


@runtime_checkable
class FrameSource(Protocol):
    """Gives every frame it has, in order; the iteration ends where a file does."""

    name: str
    """For people: an address without its password, or a file."""
    live: bool
    """Whether frames come by themselves, so that who is slow must skip some."""
    timed: bool
    """Whether frames bear times; else they follow each other at a rate, as a folder's."""
    counts: Counts

    def __iter__(self) -> Iterator[TimedFrame]: ...

    def close(self) -> None:
        """Release the camera or the connection; the iteration ends."""

    def __enter__(self) -> "FrameSource": ...

    def __exit__(self, *_: object) -> None: ...
