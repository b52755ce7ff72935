# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames that lie on a disk, and a camera on USB: images, archives, videos, datasets."""

import os
import threading
import time
from abc import abstractmethod
from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2

from recon.arrays import Frame
from recon.images import frame_count, read_frame
from recon.picture_names import picture_names
from recon.stream.frame import Counts, TimedFrame
from sensor.closing import Closing
from sensor.dataset import frame_name, read_dataset
from sensor.errors import WedgeError

os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")  # a line for each damaged block, else
FOLDER_FPS = 30.0
"""Images of a folder bear no times: they follow each other so quickly."""
COUNTED = (".avi", ".mp4", ".mov")
"""Videos that name how many frames they hold; of others it is what their length would hold."""
LEAST_SHARE = 0.97
"""Of the frames that a video names can be read unless it broke off."""
REOPEN_AFTER_S = 0.4
"""A camera that was unplugged is looked for so often."""
PRESSES_FPS = 1.0
"""Frames of a dataset have nothing to do with each other."""


class _Pixels(Closing):
    """A source whose frames come decoded."""

    live = timed = False

    def __init__(self, name: str) -> None:
        self.name = name
        self.counts = Counts(connections=1)
        self._closed = threading.Event()

    def close(self) -> None:
        """End the iteration, from whichever thread."""
        self._closed.set()

    @abstractmethod
    def _images(self) -> Iterator[tuple[int, Frame | WedgeError]]:
        """Times since the first frame, in ns, and frames, or why one cannot be read."""

    def _file(self, index: int) -> str:
        """The name of a frame's file; none where all of them are in one."""
        return ""

    def __iter__(self) -> Iterator[TimedFrame]:
        """Give each frame in turn."""
        for index, (time_ns, found) in enumerate(self._images()):
            if self._closed.is_set():
                return
            arrived_ns = time.time_ns()
            self.counts.received += not isinstance(found, WedgeError)
            yield TimedFrame(
                index=index,
                time_ns=arrived_ns if self.live else time_ns,
                arrived_ns=arrived_ns,
                clock="arrival" if self.live else "file",
                pixels=None if isinstance(found, WedgeError) else found,
                flaw=str(found) if isinstance(found, WedgeError) else "",
                file=self._file(index),
            )


class FolderSource(_Pixels):
    """Images by name, numbers in their order: 2.png comes before 10.png."""

    def __init__(self, folder: Path, names: Sequence[str] = (), fps: float = FOLDER_FPS) -> None:
        """List the images.

        Args:
            folder: where they lie.
            names: files in it, or ``frames.npz#17``; by default all images.
            fps: how quickly they follow each other.

        Raises:
            WedgeError: the folder holds none.
        """
        super().__init__(str(folder))
        self.names = names or picture_names(folder)
        """In their order."""
        self._folder, self._fps = folder, fps
        if not self.names:
            raise WedgeError(f"{folder} holds no PNG, JPEG, BMP or TIFF images.")

    def _images(self) -> Iterator[tuple[int, Frame | WedgeError]]:
        for index, name in enumerate(self.names):
            try:
                found: Frame | WedgeError = read_frame(self._folder, name)
            except WedgeError as error:
                found = error
            yield round(index * 1e9 / self._fps), found

    def _file(self, index: int) -> str:
        return self.names[index]


class VideoSource(_Pixels):
    """A video file, at the rate that it names."""

    def __init__(self, path: Path) -> None:
        """Open the file.

        Raises:
            WedgeError: it is no video that OpenCV reads.
        """
        super().__init__(str(path))
        self._path = path
        capture = cv2.VideoCapture(str(path))
        opened = capture.isOpened()
        self.frames = int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
        fps = capture.get(cv2.CAP_PROP_FPS)
        self._fps = fps if 0 < fps < 1000 else FOLDER_FPS
        capture.release()
        if not opened:
            raise WedgeError(f"{path} cannot be read as a video.")

    def _images(self) -> Iterator[tuple[int, Frame]]:
        capture = cv2.VideoCapture(str(self._path))
        try:
            index = 0
            while (read := capture.read())[0]:
                yield round(index * 1e9 / self._fps), cv2.cvtColor(read[1], cv2.COLOR_BGR2RGB)
                index += 1
            counted = self._path.suffix.lower() in COUNTED
            if counted and index < LEAST_SHARE * self.frames:
                self.counts.remark = (
                    f"{self.name} breaks off: {index} of the {self.frames} frames that it names "
                    "could be read."
                )
        finally:
            capture.release()


class UsbSource(_Pixels):
    """A USB camera, by its number.

    It must give a frame, or the iteration raises ``WedgeError``; one that is lost later is opened
    again until ``close``.
    """

    live = timed = True

    def __init__(self, number: int) -> None:
        """Open the camera.

        Raises:
            WedgeError: there is none of that number.
        """
        super().__init__(f"usb:{number}")
        self._iterated = False
        self._number = number
        self._open()
        if not self._capture.isOpened():
            self._capture.release()
            other = "try usb:0" if number else "plug it in, or try usb:1"
            raise WedgeError(f"usb:{number}: there is no camera with that number; {other}.")

    def close(self) -> None:
        """End the iteration, from whichever thread, and let go of the camera."""
        super().close()
        if not self._iterated:  # else the iteration lets go, once it reads no more
            self._capture.release()

    def _images(self) -> Iterator[tuple[int, Frame]]:
        self._iterated = True
        try:
            while not self._closed.is_set():
                read, image = self._capture.read()
                if not read:
                    self._open_again()
                    continue
                if self.counts.lost:
                    self.counts.remark, self.counts.lost = "", False
                    self.counts.connections += 1
                yield 0, cv2.cvtColor(image, cv2.COLOR_BGR2RGB)
        finally:
            self._iterated = False
            self._capture.release()

    def _open_again(self) -> None:
        """After a pause: whether the camera is there, its next frame tells.

        Raises:
            WedgeError: it never gave a frame.
        """
        self._capture.release()
        if not self.counts.received:
            raise WedgeError(f"{self.name} gives no frames: is another program using it?")
        if self._closed.is_set():
            return
        why = f"{self.name} gives no frames any more: was it unplugged?"
        self.counts.remark, self.counts.lost = f"lost: {why}", True
        if not self._closed.wait(REOPEN_AFTER_S):
            self._open()

    def _open(self) -> None:
        talk = cv2.utils.logging
        before = talk.setLogLevel(talk.LOG_LEVEL_ERROR)  # its warnings would stand beside ours
        self._capture = cv2.VideoCapture(self._number)
        talk.setLogLevel(before)
        if self._capture.isOpened():
            self._capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)


def dataset_source(folder: Path) -> FolderSource:
    """The blank frames of a dataset, then its labelled presses: without any, all its other frames.

    Raises:
        WedgeError: the folder is no dataset folder, or its ``frames.npz`` is damaged.
    """
    dataset = read_dataset(folder, labelled=False)
    blank = {frame_name(name) for name in dataset.card.background}
    frames = [label.file for label in dataset.labels] or _frames_in(folder)
    names = [*dataset.card.background, *(x for x in frames if frame_name(x) not in blank)]
    return FolderSource(folder, names, PRESSES_FPS)


def _frames_in(folder: Path) -> list[str]:
    """Images by name, then those of an archive."""
    archive = folder / "frames.npz"
    inside = frame_count(archive) if archive.is_file() else 0
    return [*picture_names(folder), *(f"{archive.name}#{i}" for i in range(inside))]
