# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The newest frame of a live source: who is slow skips frames and is never behind."""

import math
import threading
import time
from collections.abc import Iterator

from recon.stream.frame import FrameSource, TimedFrame
from sensor.closing import Closing
from sensor.errors import WedgeError

DAMAGED_FRAMES = 5
"""So many in a row are said."""


class Newest(Closing):
    """Reads a source in a thread of its own and keeps the newest frame alone.

        with Newest(open_source("http://10.55.0.1:8080")) as frames:
            for frame in frames:
                ...  # may take as long as it likes

    The source is closed with it.
    """

    def __init__(self, source: FrameSource) -> None:
        self.source = source
        self.skipped = 0
        """Frames that a newer one replaced before anybody asked."""
        self._damaged = 0
        """Frames one after the other that could not be decoded."""
        self.flaw = ""
        """Why the last of them could not be."""
        self.came_s = -math.inf
        """When the frame that was taken last had come here, as ``time.monotonic`` tells it."""
        self._changed = threading.Condition()
        self._frame: TimedFrame | None = None
        self._waits_since_s = -math.inf
        self._ended = False
        self._error: Exception | None = None
        self._thread = threading.Thread(target=self._read, name=source.name, daemon=True)
        self._thread.start()

    def __iter__(self) -> Iterator[TimedFrame]:
        """Wait for the next frame, again and again, until the source ends."""
        while (frame := self.take()) is not None:
            yield frame

    def take(self, timeout_s: float | None = None) -> TimedFrame | None:
        """The newest frame that was not taken yet, decoded; waits for it.

        A JPEG that is whole but damaged within is counted as corrupt, and the next one awaited.

        Returns:
            ``None`` where the source has ended or the time is over.

        Raises:
            WedgeError: the source has failed; what else it raises is raised here too.
        """
        until_s = None if timeout_s is None else time.monotonic() + timeout_s
        while True:
            left_s = None if until_s is None else max(0.0, until_s - time.monotonic())
            with self._changed:
                self._changed.wait_for(lambda: self._frame is not None or self._ended, left_s)
                frame, self._frame, came_s = self._frame, None, self._waits_since_s
                if frame is None and self._error is not None:
                    raise self._error
            if frame is None:
                return None
            try:
                decoded = frame.decoded()
            except WedgeError as error:
                self.source.counts.add_corrupt()
                self._damaged, self.flaw = self._damaged + 1, str(error)
            else:
                self._damaged, self.came_s = 0, came_s
                return decoded

    @property
    def remark(self) -> str:
        """What a person should know of the source or of its frames; nothing where all is well."""
        if not self.all_damaged:
            return self.source.counts.remark
        return f"no frame of {self.source.name} can be shown; the last one: {self.flaw}"

    @property
    def all_damaged(self) -> bool:
        """Whether frames come, but none for a while that can be decoded."""
        return self._damaged >= DAMAGED_FRAMES

    @property
    def ended(self) -> bool:
        """Whether the source gives nothing more."""
        return self._ended and self._frame is None

    def close(self) -> None:
        """Close the source and wait for the thread."""
        self.source.close()
        self._thread.join()

    def _read(self) -> None:
        try:
            for frame in self.source:
                with self._changed:
                    if frame.flaw and self._frame is not None:  # a frame to look at stays
                        self.source.counts.add_corrupt()
                        continue
                    self.skipped += self._frame is not None
                    self._frame, self._waits_since_s = frame, time.monotonic()
                    self._changed.notify_all()
        except Exception as error:  # else the stream would seem to have ended
            self._error = error
        finally:
            with self._changed:
                self._ended = True
                self._changed.notify_all()
