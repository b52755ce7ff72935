# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The process that writes a recording outlives the recorder, and is there or nothing is."""

import errno
import os
import signal
import subprocess
import sys
from pathlib import Path
from subprocess import PIPE

import pytest

from recon.stream import Recorder, keeper
from sensor.errors import WedgeError
from tests.recon.stream.test_recording import read_with_mcap, record


def test_what_asks_all_processes_to_end_costs_no_frame(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = tmp_path / "asked.py"  # at the writer's first moment
    asked.write_text(
        "import os, runpy, signal\n"
        "for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT):\n"
        "    os.kill(os.getpid(), number)\n"
        f"runpy.run_path({keeper.__file__!r}, run_name='__main__')\n"
    )
    monkeypatch.setattr(keeper, "__file__", str(asked))
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    assert len(read_with_mcap(record(tmp_path / "touch.mcap", 90))) == 90
    assert signal.pthread_sigmask(signal.SIG_BLOCK, ()) == blocked


def test_a_writer_whose_recorder_is_gone_finishes_and_says_nothing(tmp_path: Path) -> None:
    with (tmp_path / "file").open("wb") as file:
        command = [sys.executable, "-I", "-S", keeper.__file__, str(file.fileno())]
        with subprocess.Popen(
            command, stdin=PIPE, stdout=PIPE, stderr=PIPE, pass_fds=(file.fileno(),)
        ) as process:
            process.stdout.close()
            process.stdin.write(keeper.request((0, b"whole")))
            process.stdin.write(keeper.request((5, b"more"), (9, b"half"))[:-1])
            process.stdin.close()
            assert process.stderr.read() == b""
    assert process.returncode == 0 and (tmp_path / "file").read_bytes() == b"whole"


def lowest_free() -> int:
    """The number that the next file to be opened gets."""
    number = os.dup(0)
    os.close(number)
    return number


def test_where_no_process_can_be_begun_nothing_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(*_: object, **_options: object) -> None:
        raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))

    path = tmp_path / "touch.mcap"
    monkeypatch.setattr(subprocess, "Popen", none)
    before = lowest_free()
    with pytest.raises(WedgeError, match=r"touch\.mcap cannot be written: Resource temporarily"):
        Recorder(path, {"wedge": None})
    assert not path.exists() and lowest_free() == before
