# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A camera that hangs: no old frame is sent as new, and no client that left keeps a stream."""

import json
import socket

import pytest

import firmware_pi.server
from firmware_pi.newest import Frame, Newest
from tests.firmware_pi.clients import Stream, ask, connect, put, serving, until


def test_an_old_frame_is_not_given_as_the_newest(monkeypatch: pytest.MonkeyPatch) -> None:
    newest = Newest()
    put(newest, b"old")
    monkeypatch.setattr(Newest, "age_s", 5.0)
    with serving(newest) as server:
        for path in ("/stream.mjpg", "/snapshot.jpg"):
            answer = ask(server, path)[0]
            assert (answer.status, answer.reason) == (503, "no frames arrive")
        answer, body = ask(server, "/health")
        assert (answer.status, json.loads(body)["clients"]) == (503, 0)


@pytest.mark.parametrize("how", [socket.SHUT_RDWR, socket.SHUT_WR])
def test_a_client_that_leaves_a_camera_that_hangs_makes_room(
    monkeypatch: pytest.MonkeyPatch, how: int
) -> None:
    monkeypatch.setattr(firmware_pi.server, "FRAME_WITHIN_S", 0.05)
    monkeypatch.setattr(Newest, "age_s", 0.0)
    newest = Newest()
    put(newest, b"the last one")
    with serving(newest, max_clients=1) as server, connect(server) as connection:
        connection.sendall(b"GET /stream.mjpg HTTP/1.1\r\n\r\n")
        until(lambda: server.clients == 1)
        connection.shutdown(how)
        until(lambda: server.clients == 0)


def test_a_client_that_stays_has_the_frames_after_a_pause(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[Frame | None] = []
    usual = Newest.after

    def after(newest: Newest, index: int, timeout_s: float) -> Frame | None:
        given.append(usual(newest, index, timeout_s))
        return given[-1]

    monkeypatch.setattr(firmware_pi.server, "FRAME_WITHIN_S", 0.05)
    monkeypatch.setattr(Newest, "age_s", 0.0)
    monkeypatch.setattr(Newest, "after", after)
    newest = Newest()
    put(newest, b"before")
    with serving(newest) as server:
        stream = Stream(server)
        assert stream.part()[0] == b"before"
        until(lambda: given.count(None) >= 2)
        put(newest, b"behind")
        assert stream.part()[0] == b"behind"
        stream.close()
