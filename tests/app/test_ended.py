# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A command that is asked to end takes its workers and its half-written folder with it."""

import contextlib
import json
import os
import select
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path

import pytest

import app.__main__
from app._workers import process_pool
from recon.stream import McapSource, open_source
from sensor.errors import WedgeError
from sensor.files import new_folder
from sensor.wire import DELIMITER, Stamp, part
from tests.app.served import serving, until_it_answers
from tests.recon.stream.servers import FRAMES, HEAD, ScriptedServer, write_clip
from tests.synthetic import make_dataset

ROOT = Path(__file__).resolve().parents[2]


def never_ends(pipe: Path) -> None:
    """Say which process runs, then wait for what never comes."""
    pipe.write_text(str(os.getpid()))
    select.select([], [], [])


def command(folder: Path) -> None:
    """`wedge`, as if its subcommand wrote a folder with a worker that is slow."""

    def dispatch(_: list[str]) -> int:
        with new_folder(folder / "unit") as unit, process_pool() as pool:
            (unit / "half").write_text("written")
            pool.submit(never_ends, folder / "pipe").result()
        return 0

    app.__main__._dispatch = dispatch
    wedge([])


def wedge(words: list[str]) -> None:
    """The command line; whoever started the tests may have told them to ignore some signals."""
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    app.__main__.main(words)


def started(folder: Path) -> tuple[subprocess.Popen, int]:
    """The command, once its worker runs, and that worker."""
    os.mkfifo(folder / "pipe")
    words = (
        "-c",
        "import sys, pathlib; from tests.app.test_ended import command\n"
        "if __name__ == '__main__': command(pathlib.Path(sys.argv[1]))",
    )
    run = subprocess.Popen([sys.executable, *words, str(folder)], cwd=ROOT)
    return run, int((folder / "pipe").read_text())


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_nothing_is_left_behind(tmp_path: Path, number: signal.Signals) -> None:
    run, worker = started(tmp_path)
    run.send_signal(number)
    assert run.wait() == 128 + number
    with pytest.raises(ProcessLookupError):
        os.kill(worker, 0)
    assert [path.name for path in tmp_path.iterdir()] == ["pipe"]


def test_a_command_that_is_killed_takes_its_worker_along_and_the_next_its_folder(tmp_path) -> None:
    run, worker = started(tmp_path)
    ended = os.pidfd_open(worker)
    try:
        with pytest.raises(WedgeError), new_folder(tmp_path / "unit"):
            assert len(list(tmp_path.glob(".unit.*"))) == 2  # the other is still at work
            raise WedgeError("not whole.")
        run.kill()
        assert run.wait() == -signal.SIGKILL
        assert select.select([ended], [], [], 60)[0]
    finally:
        os.close(ended)
    assert [path.name for path in tmp_path.glob(".unit.*/*")] == ["half"]
    with new_folder(tmp_path / "unit"):
        pass
    assert {path.name for path in tmp_path.iterdir()} == {"pipe", "unit"}


@pytest.mark.parametrize(
    ("number", "to_all"),
    [(signal.SIGTERM, False), (signal.SIGTERM, True), (signal.SIGHUP, True), (signal.SIGINT, True)],
)
def test_a_recording_that_is_asked_to_end_keeps_and_tells_all_that_came(
    tmp_path: Path, number: signal.Signals, to_all: bool
) -> None:
    large = FRAMES[0][:2] + (b"\xff\xfe\xff\xff" + bytes(65533)) * 14 + FRAMES[0][2:]
    pause, connections = threading.Event(), []

    def send(connection: socket.socket) -> None:
        connections.append(connection)
        connection.sendall(HEAD + DELIMITER)
        while not pause.wait(0.005) and not server.over.is_set():
            connection.sendall(part(large, Stamp()))

    out, numbers = tmp_path / "touch.mcap", tmp_path / "numbers.json"
    words = ("record", "--out", str(out), "--json", str(numbers))
    start = "import sys; from tests.app.test_ended import wedge; wedge(sys.argv[1:])"
    with ScriptedServer(send) as server:
        command = [sys.executable, "-c", start, *words, server.url]
        with subprocess.Popen(
            command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        ) as run:
            # A chunk is written as the next one's first frame has come, which is then in memory.
            while not (out.exists() and out.stat().st_size > len(large)) and run.poll() is None:
                pause.wait(0.01)
            children = Path(f"/proc/{run.pid}/task/{run.pid}/children").read_text().split()
            assert len(children) == 1  # the writer
            for process in [*map(int, children), run.pid] if to_all else [run.pid]:
                os.kill(process, number)
            if number != signal.SIGINT:  # a second Ctrl-C waits for nothing
                os.kill(run.pid, number)  # as `timeout` does
            said, complained = run.communicate()
        with contextlib.suppress(OSError):  # what nobody takes any more would be sent forever
            connections[0].shutdown(socket.SHUT_RDWR)
    assert (run.returncode, complained) == (0, "")
    counts = json.loads(numbers.read_text())["sensors"]["wedge"]
    assert counts["recorded"] == counts["received"] == len(list(McapSource(out))) > 1
    assert f"{counts['recorded']} frames of wedge, " in said


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_a_replay_that_is_asked_to_end_tells_what_was_sent(
    tmp_path: Path, number: signal.Signals
) -> None:
    clip, numbers = write_clip(tmp_path / "clip.avi", 6), tmp_path / "numbers.json"
    words = ("replay", str(clip), "--repeat", "--port", "0", "--json", str(numbers))
    start = "import sys; from tests.app.test_ended import wedge; wedge(sys.argv[1:])"
    with subprocess.Popen(
        [sys.executable, "-c", start, *words], cwd=ROOT, stdout=subprocess.PIPE, text=True
    ) as run:
        assert run.stdout is not None
        with open_source(run.stdout.readline().split()[0]) as source:
            assert len(list(zip(source, range(3), strict=False))) == 3
            run.send_signal(number)
            said, _ = run.communicate()
    assert run.returncode == 0
    sent = json.loads(numbers.read_text())["sent"]
    assert sent >= 3 and f"{sent} frames sent, corrupt 0" in said


@pytest.mark.parametrize("words", [(), ("--corners",)])
def test_ctrl_c_ends_a_page_well_and_leaves_the_set_as_it_was(
    tmp_path: Path, words: tuple[str, ...]
) -> None:
    folder = make_dataset(tmp_path / "set", presses=2).folder
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    with serving("label", folder, *words) as (address, server):
        until_it_answers(address)
        server.send_signal(signal.SIGINT)
        assert server.wait(timeout=60) == 0
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_what_ignores_a_hangup_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    seen = []
    monkeypatch.setattr(
        app.__main__, "_dispatch", lambda _: seen.append(signal.getsignal(signal.SIGHUP)) or 0
    )
    try:
        with pytest.raises(SystemExit):
            app.__main__.main([])
    finally:
        signal.signal(signal.SIGHUP, before)
    assert seen == [signal.SIG_IGN]
