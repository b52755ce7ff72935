# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Another project's server behind a proxy that spoils what it sends."""

import itertools
import shutil
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from functools import partial
from urllib.parse import urlsplit

import pytest

from recon.stream import http
from recon.stream.http import HttpSource
from recon.stream.newest import Newest
from sensor.errors import WedgeError
from tests.recon.stream.servers import ScriptedServer, debian_server, reset

Spoil = Callable[[Iterator[bytes], socket.socket, threading.Event], None]
HEALTHY_BYTES = 6000
"""A few frames, before anything goes wrong."""


def pass_on(pieces: Iterator[bytes], out: socket.socket, most: int | None = None) -> None:
    sent = 0
    for piece in pieces:
        out.sendall(piece)
        sent += len(piece)
        if most is not None and sent >= most:
            return


def drop_bytes(pieces: Iterator[bytes], out: socket.socket, over: threading.Event) -> None:
    pass_on(pieces, out, HEALTHY_BYTES)
    out.sendall(next(pieces)[:-150])
    pass_on(pieces, out)


def add_garbage(pieces: Iterator[bytes], out: socket.socket, over: threading.Event) -> None:
    pass_on(pieces, out, HEALTHY_BYTES)
    out.sendall(b"\xff\xd8 garbage \xff\xd9\r\n" * 9)
    pass_on(pieces, out)


def reset_it(pieces: Iterator[bytes], out: socket.socket, over: threading.Event) -> None:
    pass_on(pieces, out, HEALTHY_BYTES)
    reset(out)


def fall_silent(pieces: Iterator[bytes], out: socket.socket, over: threading.Event) -> None:
    pass_on(pieces, out, HEALTHY_BYTES)
    over.wait()


@pytest.fixture(scope="module")
def camera() -> Iterator[tuple[str, int, str]]:
    """Host, port and path of a running VLC, which serves any number of readers."""
    if shutil.which("cvlc") is None:
        pytest.skip("cvlc is not installed: see requirements/debian.txt")
    with debian_server("cvlc") as url:
        for _ in range(1000):
            try:
                HttpSource(url).close()
                break
            except WedgeError:
                threading.Event().wait(0.02)
        parts = urlsplit(url)
        yield str(parts.hostname), int(parts.port or 0), parts.path


def from_camera(host: str, port: int, path: str) -> tuple[socket.socket, Iterator[bytes]]:
    """A connection to VLC, which now and then hangs up before it answers, and what it sends."""
    for _ in range(100):
        with suppress(OSError), ExitStack() as unanswered:
            behind = unanswered.enter_context(socket.create_connection((host, port)))
            behind.sendall(f"GET {path} HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
            if first := behind.recv(500):
                unanswered.pop_all()
                return behind, itertools.chain([first], iter(partial(behind.recv, 500), b""))
        threading.Event().wait(0.02)
    raise AssertionError("VLC never answered")


@pytest.mark.parametrize("spoil", [drop_bytes, add_garbage, reset_it, fall_silent])
def test_only_what_is_spoilt_is_lost(
    spoil: Spoil, camera: tuple[str, int, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(http, "BACK_OFF_S", (0.001,))
    host, port, path = camera

    def through(connection: socket.socket) -> None:
        behind, pieces = from_camera(host, port, path)
        with behind:
            if len(proxy.requests) == 1:
                spoil(pieces, connection, proxy.over)
            else:
                pass_on(pieces, connection)

    with ScriptedServer(through) as proxy, Newest(HttpSource(proxy.url, stall_s=0.5)) as newest:
        frames = list(itertools.islice(newest, 40))
        counts = newest.source.counts
    assert all(frame.pixels.shape == (120, 160, 3) for frame in frames)
    assert counts.corrupt <= 1
    assert counts.connections > 1 or spoil in (drop_bytes, add_garbage)
