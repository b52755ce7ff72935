# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The HTTP server: the newest frame to each client, and nothing that a client may change."""

import base64
import errno
import hmac
import io
import ipaddress
import json
import select
import socket
import socketserver
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler
from typing import Any

from firmware_pi.newest import Frame, Newest
from sensor.errors import WedgeError
from sensor.wire import (
    CONTENT_TYPE,
    DELIMITER,
    HEALTH_PATH,
    SETTINGS_PATH,
    SNAPSHOT_PATH,
    STREAM_PATH,
    stamp_lines,
)

REQUEST_WITHIN_S = 5.0
REQUEST_BYTES = 8192
WRITE_WITHIN_S = 5.0
FRAME_WITHIN_S = 2.0
OTHER_REQUESTS = 8
"""Connections beside the streams, so that /health answers while every stream is taken."""
UNSENT_BYTES = 16 * 1024
"""A frame is chosen when no more than this waits to be sent: a slow client's next one is fresh."""
NO_FRAME = "no frames arrive"
PATHS = {
    STREAM_PATH: "the stream",
    SNAPSHOT_PATH: "the newest frame",
    SETTINGS_PATH: "the settings requested from the camera, and those it uses",
    HEALTH_PATH: "rate, clients, age of the newest frame",
}
"""What a browser is shown that asks for no path."""
_GONE = select.POLLERR | select.POLLHUP | select.POLLRDHUP
_IP_FREEBIND = 15  # Linux; socket has no name for it


class StreamServer(socketserver.ThreadingTCPServer):
    """Serves one camera at one address.

    Args:
        address: The one IP address to listen at.
        port: TCP port; 0 takes a free one.
        newest: Where the frames come from.
        describe: Gives the document of ``/settings``.
        max_clients: Streams served at once.
        credentials: "user:password" that every request must bring, if any.
        before_up: Listen also where no interface has that IPv4 address yet: the Pi's USB cable may
            be plugged in later.

    Raises:
        WedgeError: the port is in use, or the address is not to be listened at.
    """

    daemon_threads = True
    block_on_close = False
    allow_reuse_address = True

    def __init__(
        self,
        address: str,
        port: int,
        newest: Newest,
        describe: Callable[[], dict[str, Any]],
        *,
        max_clients: int = 4,
        credentials: str | None = None,
        before_up: bool = False,
    ) -> None:
        self.newest = newest
        self._before_up = before_up
        self.describe = describe
        self.expected = None
        if credentials is not None:
            self.expected = b"Basic " + base64.b64encode(credentials.encode())
        self.stopping = threading.Event()
        self._streams = threading.BoundedSemaphore(max_clients)
        self._connections = threading.BoundedSemaphore(max_clients + OTHER_REQUESTS)
        self._clients = 0
        self._counting = threading.Lock()
        if ipaddress.ip_address(address).version == 6:
            self.address_family = socket.AF_INET6
        try:
            super().__init__((address, port), Handler)
        except OSError as error:
            reason = {
                errno.EADDRINUSE: "another program uses it; stop that program, or set another port",
                errno.EADDRNOTAVAIL: "this machine has no such address; set one that it has",
                errno.EACCES: "only root may use a port below 1024; set another port",
            }.get(error.errno or 0, error.strerror)
            raise WedgeError(f"cannot listen on {address} port {port}: {reason}.") from error

    @property
    def clients(self) -> int:
        """Streams being served."""
        return self._clients

    @property
    def fresh(self) -> bool:
        """Whether frames come."""
        return self.newest.count > 0 and self.newest.age_s < FRAME_WITHIN_S

    @contextmanager
    def one_stream(self) -> Iterator[bool]:
        """Take one of the streams; yields whether there was one left."""
        taken = self._streams.acquire(blocking=False)
        with self._counting:
            self._clients += taken
        try:
            yield taken
        finally:
            if taken:
                self._streams.release()
                with self._counting:
                    self._clients -= 1

    def stop(self) -> None:
        """Send no further frame, close every stream and the port."""
        self.stopping.set()
        self.shutdown()
        self.server_close()

    def server_bind(self) -> None:
        """Bind, before the interface is up where that may be so."""
        if self._before_up and self.address_family == socket.AF_INET and sys.platform == "linux":
            self.socket.setsockopt(socket.IPPROTO_IP, _IP_FREEBIND, 1)
        super().server_bind()

    def process_request(self, request: Any, client_address: Any) -> None:
        """Give the connection a thread, or close it where there are too many."""
        if not self._connections.acquire(blocking=False):
            self.shutdown_request(request)
            return
        try:
            super().process_request(request, client_address)
        except BaseException:
            self._connections.release()
            raise

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Serve the connection and count it out."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._connections.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing of a client that went away."""


class Handler(BaseHTTPRequestHandler):
    """Answers one request."""

    server: StreamServer
    protocol_version = "HTTP/1.1"
    default_request_version = "HTTP/1.0"  # else nonsense is answered without a status line
    timeout = REQUEST_WITHIN_S

    def handle(self) -> None:
        """Read a request head of bounded size and time, answer it, close."""
        self.close_connection = True
        self.requestline, self.request_version, self.command = "", "HTTP/1.1", ""
        try:
            head = _read_head(self.connection)
            if head is None:
                self.send_error(431)
            elif head:
                self.connection.settimeout(WRITE_WITHIN_S)
                self.rfile = io.BytesIO(head)
                self.handle_one_request()
        except OSError:  # the client went away, or takes nothing
            pass

    def do_GET(self) -> None:
        """Answer by path."""
        self.close_connection = True
        if not self._is_allowed():
            self._answer(401, b"", "text/plain", ['WWW-Authenticate: Basic realm="camera"'])
            return
        match self.path.partition("?")[0]:
            case p if p == STREAM_PATH:
                self._stream()
            case p if p == SNAPSHOT_PATH:
                self._snapshot()
            case p if p == SETTINGS_PATH:
                self._json(200, self.server.describe())
            case p if p == HEALTH_PATH:
                self._health()
            case "/":
                self._answer(200, _overview(), "text/html", [])
            case _:
                self.send_error(404)

    do_HEAD = do_GET  # noqa: N815

    def _is_allowed(self) -> bool:
        expected = self.server.expected
        given = self.headers.get("Authorization", "").encode("latin-1", "replace")
        return expected is None or hmac.compare_digest(given, expected)

    def _stream(self) -> None:
        with self.server.one_stream() as taken:
            if not taken or self._newest() is None:
                self.send_error(503, NO_FRAME if taken else "all streams are in use")
                return
            self._head(200, CONTENT_TYPE, [])
            if self.command == "HEAD":
                return
            connection = self.connection
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            if hasattr(socket, "TCP_NOTSENT_LOWAT"):
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, UNSENT_BYTES)
            connection.sendall(DELIMITER)
            index = -1
            while not self.server.stopping.is_set() and _takes_more(connection):
                frame = self.server.newest.after(index, FRAME_WITHIN_S)
                if frame is not None and frame.stamp.index is not None:
                    connection.sendall(frame.part)
                    index = frame.stamp.index

    def _snapshot(self) -> None:
        frame = self._newest()
        if frame is None:
            self.send_error(503, NO_FRAME)
        else:
            self._answer(200, frame.jpeg, "image/jpeg", stamp_lines(frame.stamp))

    def _newest(self) -> Frame | None:
        """The newest frame, the first one waited for; none where the camera has stopped."""
        frame = self.server.newest.after(-1, FRAME_WITHIN_S)
        return frame if self.server.fresh else None

    def _health(self) -> None:
        newest, fresh = self.server.newest, self.server.fresh
        document = {
            "fresh": fresh,
            "frames": newest.count,
            "rate_hz": newest.rate_hz and round(newest.rate_hz, 2),
            "newest_frame_age_s": round(newest.age_s, 3),
            "clients": self.server.clients,
            "time": time.time(),
        }
        self._json(200 if fresh else 503, document)

    def _json(self, status: int, document: dict[str, Any]) -> None:
        content = json.dumps(document, indent=2) + "\n"
        self._answer(status, content.encode(), "application/json", [])

    def _answer(self, status: int, body: bytes, kind: str, lines: list[str]) -> None:
        self._head(status, kind, [f"Content-Length: {len(body)}", *lines])
        if self.command != "HEAD":
            self.wfile.write(body)

    def _head(self, status: int, kind: str, lines: list[str]) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Cache-Control", "no-store")
        self.send_header("Connection", "close")
        self.send_header("X-Content-Type-Options", "nosniff")
        for line in lines:
            name, _, value = line.partition(": ")
            self.send_header(name, value)
        self.end_headers()

    def version_string(self) -> str:
        """Name the server and nothing of the Pi."""
        return "gelsight-wedge"

    def log_message(self, format: str, *args: Any) -> None:
        """Keep no record of requests: the journal is for faults."""


def _overview() -> bytes:
    rows = (f'<p><a href="{path}">{path}</a>: {words}\n' for path, words in PATHS.items())
    return ("<!doctype html><title>GelSight Wedge</title>\n" + "".join(rows)).encode()


def _read_head(connection: socket.socket) -> bytes | None:
    """The lines of a request up to the empty one; empty if none came in time, None if too long."""
    end = time.monotonic() + REQUEST_WITHIN_S
    received = bytearray()
    head = b""
    while b"\r\n\r\n" not in head and b"\n\n" not in head:
        if len(received) >= REQUEST_BYTES:
            return None
        left_s = end - time.monotonic()
        if left_s <= 0:
            return b""
        connection.settimeout(left_s)
        more = connection.recv(REQUEST_BYTES - len(received))
        if not more:
            return b""
        received += more
        head = bytes(received).lstrip(b"\r\n")  # empty lines before a request: RFC 9112, 2.2
    return head


def _takes_more(connection: socket.socket) -> bool:
    """Wait until little is left to be sent; false if that takes too long or the client is gone."""
    ready = select.poll()
    ready.register(connection, select.POLLOUT | select.POLLRDHUP)
    events = ready.poll(WRITE_WITHIN_S * 1000)
    return bool(events) and not events[0][1] & _GONE
