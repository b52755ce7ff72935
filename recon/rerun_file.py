# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What a stream showed, for Rerun's viewer: frames, depth and latency on one timeline."""

from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

import numpy as np

from recon.stream.frame import TimedFrame
from sensor.errors import WedgeError
from sensor.extras import how_to_install

if TYPE_CHECKING:
    from recon.fast import Touch

PER_METER = 1000.0
"""Depths are in mm."""


class RerunFile:
    """Writes an .rrd file; it bears its name once it is whole.

    Entities: ``raw``, ``depth`` (mm), ``deepest_mm``, ``contact_mm2`` and ``latency_ms``, by the
    time of exposure.
    """

    def __init__(self, path: Path) -> None:
        """Open a file that does not exist yet.

        Raises:
            WedgeError: Rerun is not installed, or the file cannot be written.
        """
        try:
            import rerun
        except ModuleNotFoundError as error:
            raise WedgeError(
                f"Rerun's files need its package: {how_to_install('rerun')}."
            ) from error
        self._rerun, self._path = rerun, path
        self._part = path.with_name(f".{path.name}.part")
        try:
            self._part.touch()
        except OSError as error:
            raise WedgeError(f"{path} cannot be written: {error.strerror}.") from error
        self._recording = rerun.RecordingStream("gelsight_wedge")
        self._recording.save(self._part)

    def __enter__(self) -> "RerunFile":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._recording.flush()
        self._recording.disconnect()
        if isinstance(error, Exception):  # Ctrl-C is the way to end a stream
            self._part.unlink()
        else:
            self._part.replace(self._path)

    def add(self, frame: TimedFrame, touch: "Touch | None") -> None:
        """Write one frame and what it says."""
        rerun, recording = self._rerun, self._recording
        recording.set_time("exposed", timestamp=np.datetime64(frame.time_ns, "ns"))
        if frame.jpeg is not None:
            raw = rerun.EncodedImage(contents=frame.jpeg, media_type="image/jpeg")
        else:
            raw = rerun.Image(frame.image())
        recording.log("raw", raw)
        if frame.latency_ms is not None:
            recording.log("latency_ms", rerun.Scalars(frame.latency_ms))
        if touch is not None:
            depth_mm = touch.depth_mm.copy()  # written later, when the next frame has come
            recording.log("depth", rerun.DepthImage(depth_mm, meter=PER_METER))
            recording.log("deepest_mm", rerun.Scalars(touch.deepest_mm))
            recording.log("contact_mm2", rerun.Scalars(touch.contact_mm2))
