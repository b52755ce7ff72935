# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A source by the words that a person types."""

import re
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from threading import Event

from recon.stream.files import FOLDER_FPS, FolderSource, UsbSource, VideoSource, dataset_source
from recon.stream.frame import FrameSource, TimedFrame
from recon.stream.http import HttpSource, hidden_login
from recon.stream.recording import ENDING, McapSource, is_recording
from sensor.closing import Closing
from sensor.dataset import CARD_FILE
from sensor.errors import WedgeError

VIDEOS = (".avi", ".mp4", ".mkv", ".mov", ".mjpeg", ".mjpg", ".webm")
ADDRESSES = ("http://", "https://")
WITHOUT_SCHEME = re.compile(r"(?!usb:)(?:[\w.-]+:\d{1,5}|\d+(?:\.\d+){3})(?:/.*)?")
CAMERA = re.compile(r"usb:(\d{1,3})")
KINDS = (
    "an address such as http://10.55.0.1:8080",
    "usb:0",
    "a folder of images",
    "a dataset folder",
    f"a video ({', '.join(VIDEOS)})",
    f"a recording ({ENDING})",
)

LONGEST_GAP_S = 10.0


def refuse_no_source(where: str | Path, also: Sequence[str] = ()) -> None:
    """Refuse what is neither an address, nor a camera, nor a path of a known kind; open nothing.

    Args:
        where: as for ``open_source``.
        also: what else the caller takes, for the sentence.

    Raises:
        WedgeError: names what can be named.
    """
    if not isinstance(where, str | Path):
        raise WedgeError(f"{where!r} names no source: name a camera as usb:0, all else as text.")
    *kinds, last = (*KINDS, *also)
    named = f"name {', '.join(kinds)} or {last}"
    if not where:  # which pathlib takes for the current folder
        raise WedgeError(f"the source of the frames has an empty name: {named}.")
    text, path = str(where), Path(where)
    if text.lower().startswith(ADDRESSES) or CAMERA.fullmatch(text) or path.is_dir():
        return
    is_file = path.is_file()
    if is_file and (path.suffix.lower() in VIDEOS or is_recording(path)):
        return
    if not is_file and WITHOUT_SCHEME.fullmatch(text):
        raise WedgeError(
            f"{text} does not exist: an address begins with http://, as http://{text}."
        )
    said = text if path.exists() else hidden_login(text)
    fault = "cannot be read as frames" if is_file else "does not exist"
    raise WedgeError(f"{said} {fault}: {named}.")


def open_source(where: str | Path) -> FrameSource:
    """The source that an address or a path names.

    Args:
        where: ``http://HOST:PORT/PATH``, ``usb:0``, a folder of images, a dataset folder (its blank
            frames, then its labelled presses or, without any, all its pictures), a video, or an
            MCAP file.

    Raises:
        WedgeError: it is none of these, or cannot be opened.
    """
    refuse_no_source(where)
    text = str(where)
    if text.lower().startswith(ADDRESSES):
        return HttpSource(text)
    if match := CAMERA.fullmatch(text):
        return UsbSource(int(match[1]))
    path = Path(where)
    if (path / CARD_FILE).is_file():
        return dataset_source(path)
    if path.is_dir():
        return FolderSource(path)
    return McapSource(path) if is_recording(path) else VideoSource(path)


class Paced(Closing):
    """A file's frames at the pace at which they were taken, as if its sensor were here.

    A gap of more than ``LONGEST_GAP_S``, where the sensor was off or a stamp is wrong, is cut
    short; a stamp before the last one is waited for no more.
    """

    live = True

    def __init__(self, source: FrameSource, *, speed: float = 1.0, repeat: bool = False) -> None:
        """Wrap a source.

        Args:
            source: of a file.
            speed: 2 plays twice as fast.
            repeat: begin again at the end.
        """
        self.source, self.speed, self.repeat = source, speed, repeat
        self.name, self.counts, self.timed = source.name, source.counts, source.timed
        self._closed = Event()

    def close(self) -> None:
        """End the iteration, from whichever thread."""
        self._closed.set()
        self.source.close()

    def __iter__(self) -> Iterator[TimedFrame]:
        """Give each frame when its time has come."""
        due_ns, step_ns = float(time.monotonic_ns()), 0.0
        while True:
            before_ns: int | None = None
            for frame in self.source:
                if before_ns is not None:
                    step_ns = min(max(frame.time_ns - before_ns, 0), 1e9 * LONGEST_GAP_S)
                due_ns += step_ns / self.speed
                before_ns = frame.time_ns
                if self._closed.wait(max(0.0, (due_ns - time.monotonic_ns()) / 1e9)):
                    return
                yield frame
            if before_ns is None or not self.repeat or self._closed.is_set():
                return
            step_ns = max(step_ns, 1e9 / FOLDER_FPS)  # from the last frame to the first again
