# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames of a camera server over HTTP, for hours: what breaks is connected again."""

import base64
import errno
import http.client
import re
import socket
import ssl
import threading
import time
import urllib.parse
from collections.abc import Iterator
from contextlib import suppress

from recon.stream.clock import SenderClock, clock_remark
from recon.stream.deadline import DeadlineSocket
from recon.stream.frame import Counts, TimedFrame
from recon.stream.multipart import MultipartReader
from sensor.closing import Closing
from sensor.errors import WedgeError, printable
from sensor.wire import STREAM_PATH, Stamp, read_stamp

STALL_S = 1.5
"""Without a whole frame for so long the connection is taken for dead."""
BACK_OFF_S = (0.05, 0.1, 0.2, 0.4)
"""Pauses between attempts; the last one repeats, so that a frame comes soon after the server."""
FIRST_FRAME_WITHIN_S = 20.0
"""From the first connection on: a camera that is being started takes its time."""
FARTHEST_AHEAD = 10**6
"""Frames that may be missing in a row: hours of them."""
NO_JPEGS = 10
"""Damaged parts before any whole one: it is no stream of JPEGs that something spoils."""
_BOUNDARY = re.compile(r'boundary="?([^";\s]+)', re.IGNORECASE)
_LINK_LOCAL = re.compile(r"fe[89ab][0-9a-f]:|.*:.*%", re.IGNORECASE)
_LOST = (OSError, http.client.HTTPException, EOFError, ValueError)


class HttpSource(Closing):
    """A multipart stream of JPEGs, such as ``http://10.55.0.1:8080/stream.mjpg``.

    The first connection must succeed and give a frame, or the iteration raises ``WedgeError``;
    later ones are tried again until ``close``.
    """

    live = timed = True

    def __init__(self, url: str, stall_s: float = STALL_S) -> None:
        """Connect.

        Args:
            url: address, with ``user:password@`` where the server asks; without a path, the
                path of this project's server.
            stall_s: silence after which the connection is taken for dead.

        Raises:
            WedgeError: no such host, nothing listens, a wrong password, or no stream of JPEGs.
        """
        self._url = _checked(url)
        self.name = f"{self._url.scheme}://{_without_login(self._url.netloc)}{self._url.path}"
        self.counts = Counts()
        self._stall_s = stall_s
        self._closed = threading.Event()
        self._socket: socket.socket | None = None
        self._answer: http.client.HTTPResponse | None = None
        self._deadline = 0.0
        self._iterated = False
        self._clock = SenderClock()
        self._last = Stamp()
        self._damaged = 0
        """Parts since the last numbered frame."""
        self._first = self._connect()

    def close(self) -> None:
        """End the stream, from whichever thread."""
        self._closed.set()
        connected = self._socket
        if connected is not None:
            with suppress(OSError):  # wakes a thread that waits for bytes and then hangs up
                connected.shutdown(socket.SHUT_RDWR)
        if not self._iterated:
            self._hang_up()

    def __iter__(self) -> Iterator[TimedFrame]:
        """Give each whole frame as it comes, over as many connections as it takes."""
        self._iterated = True
        try:
            yield from self._forever()
        finally:
            self._iterated = False
            self._hang_up()

    def _forever(self) -> Iterator[TimedFrame]:
        stream: MultipartReader | None = self._first
        attempt = 0
        begun_s = time.monotonic()
        while not self._closed.is_set():
            if stream is not None:
                for frame in self._frames(stream):
                    attempt = 0
                    yield frame
                if self.counts.received:
                    self._say_lost(f"{self.name} sends no frames any more.")
            if not self.counts.received and not self._closed.is_set():
                self._refuse_no_frames(time.monotonic() - begun_s)
            if self._closed.wait(BACK_OFF_S[min(attempt, len(BACK_OFF_S) - 1)]):
                return
            attempt += 1
            try:
                stream = self._connect()
            except WedgeError as error:
                stream = None
                self._say_lost(str(error))

    def _say_lost(self, why: str) -> None:
        """Tell who watches, before it is tried again: that may take as long as the silence did."""
        if not self._closed.is_set():
            self.counts.remark, self.counts.lost = f"lost: {why}", True

    def _refuse_no_frames(self, waited_s: float) -> None:
        """Say what a server does that has not given a frame yet; in the end refuse it.

        Raises:
            WedgeError: what comes are no JPEGs, or nothing has come for too long.
        """
        damaged = self.counts.corrupt
        if damaged >= NO_JPEGS:
            raise WedgeError(
                f"{self.name} sends no JPEGs: none of its first {damaged} parts is one. Set the "
                "camera server to MJPEG."
            )
        nothing = f"{self.name} answers but sends no frame: does its camera run?"
        if waited_s > FIRST_FRAME_WITHIN_S:
            raise WedgeError(nothing)
        self.counts.remark = nothing

    def _frames(self, stream: MultipartReader) -> Iterator[TimedFrame]:
        counted = 0
        parts = iter(stream)
        while True:
            self._deadline = time.monotonic() + self._stall_s
            try:
                part = next(parts, None)
            except _LOST:
                part = None
            arrived_ns = time.time_ns()
            # Who closes cuts a part off too; before any frame it tells nothing of what is sent.
            cut = stream.cut and self.counts.received > 0 and not self._closed.is_set()
            damaged, counted = stream.corrupt - counted + cut, stream.corrupt
            self.counts.add_corrupt(damaged)
            self._damaged += damaged
            if part is None:
                self._hang_up()
                return
            jpeg, head = part
            stamp = read_stamp(head)
            if stamp.index is not None:
                if stamp == self._last:  # sent again on a new connection
                    continue
                self._count_dropped(stamp.index)
                self._last, self.counts.numbered = stamp, True
            time_ns, clock = self._clock.time_ns(stamp, arrived_ns)
            frame = TimedFrame(
                index=self.counts.received + self.counts.dropped,
                time_ns=time_ns,
                arrived_ns=arrived_ns,
                clock=clock,
                jpeg=jpeg,
            )
            self.counts.received += 1
            self.counts.remark, self.counts.lost = clock_remark(self.name, stamp, clock), False
            yield frame

    def _count_dropped(self, index: int) -> None:
        """Count what is missing before a frame, also over a connection that broke.

        Numbers that fall or leap are those of a server that was started anew.
        """
        if self._last.index is not None and 0 < index - self._last.index < FARTHEST_AHEAD:
            self.counts.dropped += max(0, index - self._last.index - 1 - self._damaged)
        self._damaged = 0

    def _connect(self) -> MultipartReader:
        url = self._url
        secure = url.scheme == "https"
        kind = http.client.HTTPSConnection if secure else http.client.HTTPConnection
        connection = kind(url.hostname or "", url.port, timeout=self._stall_s)
        try:
            connection.connect()
            self._socket = connection.sock
            self._deadline = time.monotonic() + self._stall_s
            connection.sock = DeadlineSocket(connection.sock, lambda: self._deadline)
            connection.request("GET", _target(url), headers=_credentials(url))
            self._answer = answer = connection.getresponse()
            boundary = self._boundary(answer)
        except _LOST as error:
            self._hang_up()
            raise WedgeError(f"{self.name} gives no stream: {_reason(error)}.") from error
        except WedgeError:
            self._hang_up()
            raise
        self.counts.connections += 1
        return MultipartReader(answer.read1, boundary)

    def _boundary(self, answer: http.client.HTTPResponse) -> str:
        """The boundary that an answer names.

        Raises:
            WedgeError: it is no stream of JPEGs.
        """
        if answer.status == http.HTTPStatus.UNAUTHORIZED:
            raise WedgeError(
                f"{self.name} refuses the name and password: give them as "
                f"{self._url.scheme}://NAME:PASSWORD@{_without_login(self._url.netloc)}."
            )
        if answer.status != http.HTTPStatus.OK:
            raise WedgeError(
                f"{self.name} answers {answer.status} {printable(answer.reason)}, not a stream."
            )
        kind = answer.getheader("Content-Type", "")
        found = _BOUNDARY.search(kind)
        named = printable(kind.partition(";")[0]) or "something unnamed"
        if not kind.lower().startswith("multipart/") or not found:
            raise WedgeError(
                f"{self.name} sends {named}, not a stream of JPEGs: is the path right? "
                f"This project's server has it at {STREAM_PATH}."
            )
        return found[1]

    def _hang_up(self) -> None:
        """Let go of the connection."""
        answer, self._answer = self._answer, None
        connected, self._socket = self._socket, None
        if connected is not None:
            connected.close()
        if answer is not None:
            answer.close()


def hidden_login(text: str) -> str:
    """What somebody typed for an address, without the name and the password that it may hold.

    With a slip in it nobody knows where they end: all before the last ``@`` goes.
    """
    scheme, mark, rest = text.rpartition("://")
    before, at, place = rest.rpartition("@")
    return f"{scheme}{mark}…@{place}" if at and (mark or ":" in before) else text


def shown_address(url: str) -> str:
    """An address without the name and the password that it may hold."""
    parts = urllib.parse.urlsplit(url)
    return parts._replace(netloc=_without_login(parts.netloc)).geturl()


def _without_login(netloc: str) -> str:
    return netloc.rpartition("@")[2]


def _checked(url: str) -> urllib.parse.SplitResult:
    try:
        parts = urllib.parse.urlsplit(url)
        if parts.scheme not in ("http", "https") or not parts.hostname or parts.port == 0:
            raise ValueError
        if "@" in parts.fragment:  # what seemed the host was the name
            raise ValueError
    except ValueError as error:
        spelt = " In a password #, / and @ are written %23, %2F and %40." if "@" in url else ""
        raise WedgeError(
            f"{hidden_login(url)!r} is not the address of a stream, such as "
            f"http://10.55.0.1:8080{STREAM_PATH}.{spelt}"
        ) from error
    if _LINK_LOCAL.match(parts.hostname or ""):
        raise WedgeError(
            f"{hidden_login(url)!r} holds an IPv6 address that is known on one link only: give "
            "another of the sender's, such as its IPv4 address."
        )
    return parts if parts.path not in ("", "/") or parts.query else parts._replace(path=STREAM_PATH)


def _target(url: urllib.parse.SplitResult) -> str:
    path = urllib.parse.quote(url.path or "/", safe="/%")
    query = urllib.parse.quote(url.query, safe="/%?:@!$&'()*+,;=")
    return f"{path}?{query}" if query else path


def _credentials(url: urllib.parse.SplitResult) -> dict[str, str]:
    if url.username is None:
        return {}
    pair = f"{urllib.parse.unquote(url.username)}:{urllib.parse.unquote(url.password or '')}"
    return {"Authorization": "Basic " + base64.b64encode(pair.encode()).decode()}


def _reason(error: Exception) -> str:
    if isinstance(error, TimeoutError):
        return "nothing answers in time; check that it is on, and that this is the right network"
    if isinstance(error, OSError) and error.errno in (errno.EHOSTUNREACH, errno.ENETUNREACH):
        return "there is no route to it; check the cable, and that this is the right network"
    if isinstance(error, ConnectionRefusedError):
        return "nothing listens at that port; start the camera server there"
    if isinstance(error, socket.gaierror):
        return "no machine with that name is known"
    if isinstance(error, ssl.SSLCertVerificationError):  # a ValueError, too
        why = error.verify_message.rstrip(".")
        return (
            f"its certificate is not trusted ({why}); if it is your own, name its file in the "
            "environment variable SSL_CERT_FILE, or begin the address with http://"
        )
    if isinstance(error, http.client.RemoteDisconnected):
        return "it hung up without an answer; check that the server behind it runs"
    if isinstance(error, http.client.HTTPException | ValueError):
        return "the answer is not HTTP"
    return str(getattr(error, "strerror", None) or error or type(error).__name__)
