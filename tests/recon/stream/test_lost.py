# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A stream is said to be lost as soon as it is given up, and by nobody but who still wants it."""

import socket
from itertools import islice

import pytest

from recon.stream import http
from recon.stream.http import HttpSource
from recon.stream.multipart import MultipartReader
from sensor.errors import WedgeError
from tests.recon.stream.servers import FRAMES, ScriptedServer, stream


@pytest.fixture(autouse=True)
def no_pause(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(http, "BACK_OFF_S", (0.001,))


def test_a_stream_is_said_to_be_lost_before_it_is_connected_again() -> None:
    def silent(connection: socket.socket) -> None:
        connection.sendall(stream(*FRAMES[:1]))
        server.over.wait()

    with ScriptedServer(silent) as server, HttpSource(server.url, stall_s=0.1) as source:
        told: list[tuple[bool, str]] = []
        connect = source._connect

        def connect_again() -> MultipartReader:
            told.append((source.counts.lost, source.counts.remark))
            return connect()

        source._connect = connect_again
        assert [frame.jpeg for frame in islice(source, 2)] == FRAMES[:1] * 2
        assert told == [(True, f"lost: {source.name} sends no frames any more.")]
        assert (source.counts.lost, source.counts.remark) == (False, "")


@pytest.mark.parametrize("when", ["while it sends", "while it is connected again"])
def test_who_closes_a_stream_has_not_lost_it(when: str) -> None:
    with ScriptedServer(stream(*FRAMES[:1])) as server, HttpSource(server.url) as source:
        frames, remarks = iter(source), []
        next(frames)

        def closed() -> MultipartReader:
            remarks.append(source.counts.remark)
            source.close()
            raise WedgeError("cut off")

        source._connect = closed
        if when == "while it sends":
            source.close()
        assert list(frames) == []
        assert source.counts.remark == "".join(remarks)
