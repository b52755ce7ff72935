# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A file that a process of its own writes (``keeper.py``): what it was given is written whole.

That process outlives this one, whatever ends it.
"""

import errno
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from recon.stream import keeper
from recon.stream.uninterrupted import ASKING_TO_END


class OutlivingFile:
    """A new file, and the process that writes it."""

    def __init__(self, path: Path) -> None:
        """Begin it, empty.

        Raises:
            OSError: it exists or cannot be written, or no process can be begun; none is left then.
        """
        path.parent.mkdir(parents=True, exist_ok=True)
        self._path = path
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644)
        try:
            with _deaf():
                self._keeper = subprocess.Popen(
                    [sys.executable, "-I", "-S", keeper.__file__, str(self._file)],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    pass_fds=(self._file,),
                    start_new_session=True,
                )
        except BaseException:
            os.close(self._file)
            path.unlink(missing_ok=True)
            raise

    @property
    def closed(self) -> bool:
        """Whether it was let go of."""
        return self._file < 0

    def put(self, *pieces: keeper.Piece) -> None:
        """Have all of them written, and the file end with the last.

        Raises:
            OSError: the disk is full.
        """
        assert self._keeper.stdin and self._keeper.stdout
        self._keeper.stdin.write(keeper.request(*pieces))
        self._keeper.stdin.flush()
        answer = self._keeper.stdout.read(keeper.ANSWER.size)
        number = keeper.ANSWER.unpack(answer)[0] if answer else errno.EPIPE
        if number:
            raise OSError(number, os.strerror(number))

    def sync(self) -> None:
        """Have what was written be on the disk.

        Raises:
            OSError: the disk turns out to be full.
        """
        os.fsync(self._file)

    def close(self) -> None:
        """End the process and let go of the file."""
        self._keeper.communicate()
        os.close(self._file)
        self._file = -1

    def remove(self) -> None:
        """Leave no file."""
        self.close()
        self._path.unlink(missing_ok=True)


@contextmanager
def _deaf() -> Iterator[None]:
    """Begin a process that signals do not end: they are for the recorder, which then finishes.

    A service that is stopped sends them to all its processes. What is blocked here stays so there,
    from its first instruction on; this process hears of it afterwards, or in another thread.
    """
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ASKING_TO_END)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
