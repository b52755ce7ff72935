# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A connection whose every read ends at one moment, however slowly bytes trickle in."""

import io
import socket
import time
from collections.abc import Callable
from typing import Any


class DeadlineSocket:
    """What ``http.client`` asks of a socket; who made the socket closes it."""

    def __init__(self, connected: socket.socket, deadline_s: Callable[[], float]) -> None:
        """Wrap a connected socket.

        Args:
            connected: the socket.
            deadline_s: when reading ends, as ``time.monotonic`` tells it; asked at every read.
        """
        self._connected, self._deadline_s = connected, deadline_s

    def sendall(self, data: bytes) -> None:
        """Send all of it."""
        self._connected.sendall(data)

    def makefile(self, _mode: str) -> io.BufferedReader:
        """A stream of what comes."""
        return io.BufferedReader(_Incoming(self._connected, self._deadline_s))

    def close(self) -> None:
        """Nothing: an answer is read from it still."""


class _Incoming(io.RawIOBase):
    def __init__(self, connected: socket.socket, deadline_s: Callable[[], float]) -> None:
        self._connected, self._deadline_s = connected, deadline_s

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        left_s = self._deadline_s() - time.monotonic()
        if left_s <= 0:
            raise TimeoutError
        self._connected.settimeout(left_s)
        return self._connected.recv_into(buffer)
