# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A server on a real socket, and clients that read from it as a test tells them."""

import http.client
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from email.parser import BytesHeaderParser
from typing import Any

from firmware_pi.newest import Newest
from firmware_pi.server import StreamServer
from sensor.wire import CONTENT_TYPE, DELIMITER, Stamp, read_stamp

WITHIN_S = 20


@contextmanager
def serving(newest: Newest, **more: Any) -> Iterator[StreamServer]:
    server = StreamServer("127.0.0.1", 0, newest, lambda: {"asked": {"rate_hz": 58}}, **more)
    thread = threading.Thread(target=server.serve_forever, args=(0.01,))
    thread.start()
    try:
        yield server
    finally:
        server.stop()
        thread.join()


def put(newest: Newest, jpeg: bytes) -> None:
    newest.put(jpeg, time.clock_gettime_ns(time.CLOCK_BOOTTIME))


def connect(server: StreamServer) -> socket.socket:
    return socket.create_connection(server.server_address[:2], timeout=WITHIN_S)


def ask(
    server: StreamServer, path: str, method: str = "GET", headers: dict[str, str] | None = None
) -> tuple[http.client.HTTPResponse, bytes]:
    host, port = server.server_address[:2]
    connection = http.client.HTTPConnection(str(host), port, timeout=WITHIN_S)
    connection.request(method, path, headers=headers or {})
    answer = connection.getresponse()
    body = answer.read()
    connection.close()
    return answer, body


def until(true: Callable[[], bool]) -> None:
    """Wait for what must come to pass."""
    end = time.monotonic() + WITHIN_S
    while not true():
        assert time.monotonic() < end
        time.sleep(0.001)


class Stream:
    """A client that reads part by part, when it is told to."""

    def __init__(self, server: StreamServer) -> None:
        host, port = server.server_address[:2]
        self._connection = http.client.HTTPConnection(str(host), port, timeout=WITHIN_S)
        self._connection.request("GET", "/stream.mjpg")
        self.answer = self._connection.getresponse()
        if self.answer.status == 200:
            assert self.answer.getheader("Content-Type") == CONTENT_TYPE
            assert self.answer.readline() == DELIMITER

    def part(self) -> tuple[bytes, Stamp]:
        head = bytearray()
        while not head.endswith(b"\r\n\r\n"):
            line = self.answer.readline()
            if not line:
                raise EOFError
            head += line
        fields = BytesHeaderParser().parsebytes(bytes(head))
        jpeg = self.answer.read(int(fields["Content-Length"]))
        assert self.answer.readline() == b"\r\n"
        assert self.answer.readline() == DELIMITER
        return jpeg, read_stamp({key.lower(): value for key, value in fields.items()})

    def close(self) -> None:
        self.answer.close()
        self._connection.close()
