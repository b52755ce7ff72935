# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A stream over TLS is read like any other, and left like any other where it trickles."""

import contextlib
import itertools
import shutil
import socket
import ssl
import subprocess
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from recon.stream.http import HttpSource
from sensor.errors import WedgeError
from tests.recon.stream.servers import FRAMES, stream

pytestmark = pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl is missing")


@pytest.fixture
def certified(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ssl.SSLContext:
    """Of a server on this computer, whose certificate is trusted by its file."""
    key, certificate = tmp_path / "key.pem", tmp_path / "certificate.pem"
    subject = ["-subj", "/CN=wedge", "-addext", "subjectAltName=IP:127.0.0.1"]
    files = ["-keyout", str(key), "-out", str(certificate)]
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2"]
    subprocess.run([*command, *subject, *files], check=True, capture_output=True)
    monkeypatch.setenv("SSL_CERT_FILE", str(certificate))
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(certificate, key)
    return context


@contextlib.contextmanager
def serving(context: ssl.SSLContext, script: Callable[[ssl.SSLSocket], None]) -> Iterator[str]:
    """The address of a server that answers one connection after the other by a script."""
    over = threading.Event()

    def serve() -> None:
        while not over.is_set():
            with contextlib.suppress(OSError):
                plain, _ = listening.accept()
                with plain, context.wrap_socket(plain, server_side=True) as connection:
                    connection.recv(65536)
                    script(connection)

    with socket.create_server(("127.0.0.1", 0)) as listening:
        port = listening.getsockname()[1]
        thread = threading.Thread(target=serve)
        thread.start()
        try:
            yield f"https://127.0.0.1:{port}/stream.mjpg"
        finally:
            over.set()
            with contextlib.suppress(OSError):
                listening.shutdown(socket.SHUT_RDWR)
            thread.join()


def test_frames_come_over_several_connections(certified: ssl.SSLContext) -> None:
    with serving(certified, lambda connection: connection.sendall(stream(*FRAMES[:3]))) as url:
        with HttpSource(url) as source:
            found = [frame.jpeg for frame in itertools.islice(source, 6)]
            assert found == 2 * FRAMES[:3] and source.counts.connections == 2


def test_a_head_without_an_end_is_left(certified: ssl.SSLContext) -> None:
    paused = threading.Event()

    def trickle(connection: ssl.SSLSocket) -> None:
        connection.sendall(b"HTTP/1.1 200 OK\r\nX-Long: ")
        while not paused.wait(0.01):
            connection.sendall(b"n")

    with serving(certified, trickle) as url:
        try:
            with pytest.raises(WedgeError, match="nothing answers in time"):
                HttpSource(url, stall_s=0.2)
        finally:
            paused.set()
