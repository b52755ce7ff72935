# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Traced parts kept in files, so that an interrupted set goes on where it stopped."""

import io
import zipfile
import zlib
from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sensor.files import write_atomic
from simulation.render import Radiance

UNREADABLE = (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error)


@dataclass(frozen=True)
class Kept:
    """A folder of traced parts, each whole or absent; without a folder, nothing is kept."""

    folder: Path | None

    def started(
        self, executor: Executor, name: str, task: Callable[[], Radiance]
    ) -> Future[Radiance]:
        """Start a task, unless what it would trace is there already."""
        if (known := self._load(name)) is None:
            return executor.submit(task)
        future: Future[Radiance] = Future()
        future.set_result(known)
        return future

    def result(self, name: str, future: Future[Radiance]) -> Radiance:
        """What a task has traced, kept from now on.

        Raises:
            WedgeError: the file cannot be written.
        """
        traced = future.result()
        if self.folder is not None and not self._path(name).is_file():
            stream = io.BytesIO()
            np.savez(stream, traced=traced)
            write_atomic(self._path(name), stream.getvalue())
        return traced

    def _path(self, name: str) -> Path:
        assert self.folder is not None
        return self.folder / f"{name}.npz"

    def _load(self, name: str) -> Radiance | None:
        if self.folder is None or not self._path(name).is_file():
            return None
        try:
            content = io.BytesIO(self._path(name).read_bytes())
            with np.load(content, allow_pickle=False) as archive:
                traced: Radiance = archive["traced"]
                return traced
        except UNREADABLE:
            self._path(name).unlink()
            return None
