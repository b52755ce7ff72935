# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Servers and recordings that mean harm cost no more time and memory than those that are broken."""

import io
import itertools
import os
import socket
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from recon.images import MOST_SCANS, read_image
from recon.stream import http
from recon.stream.http import FARTHEST_AHEAD, HttpSource
from recon.stream.jpeg import decode_jpeg
from recon.stream.recording import McapSource
from sensor.errors import WedgeError
from sensor.wire import CONTENT_TYPE, DELIMITER, Stamp, part
from tests.recon.stream.servers import FRAMES, ScriptedServer, chunked, stream

STALL_S = 0.2
TRICKLED_HEADS = {
    "a line": (b"HTTP/1.1 200 OK\r\nX-Long: ", b"n"),
    "a status": (b"", b"H"),
    "interim answers": (b"", b"HTTP/1.1 100 Continue\r\n\r\n"),
}
CHUNKED = (
    f"HTTP/1.1 200 OK\r\nContent-Type: {CONTENT_TYPE}\r\nTransfer-Encoding: chunked\r\n\r\n"
).encode()
FIRST = CHUNKED + chunked(DELIMITER + part(FRAMES[0], Stamp()), 100)
TRICKLED_CHUNKS = {
    "a chunk's size": (FIRST, b"0"),
    "an extension of a chunk": (FIRST + b"5;", b"x"),
    "trailers": (FIRST + b"0\r\n", b"X: y\r\n"),
}


@pytest.fixture(autouse=True)
def no_pause(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(http, "BACK_OFF_S", (0.001,))


def trickling(server: list[ScriptedServer], begun: bytes, again: bytes):
    """What is begun, then the same bytes again and again, for as long as somebody listens."""

    def script(connection: socket.socket) -> None:
        connection.sendall(begun)
        while not server[0].over.wait(0.01):
            connection.sendall(again)

    return script


@pytest.mark.parametrize(("begun", "again"), TRICKLED_HEADS.values(), ids=TRICKLED_HEADS)
def test_a_head_without_an_end_is_left(begun: bytes, again: bytes) -> None:
    servers: list[ScriptedServer] = []
    with ScriptedServer(trickling(servers, begun, again)) as server:
        servers.append(server)
        with pytest.raises(WedgeError, match="nothing answers in time"):
            HttpSource(server.url, stall_s=STALL_S)


@pytest.mark.parametrize(("begun", "again"), TRICKLED_CHUNKS.values(), ids=TRICKLED_CHUNKS)
def test_what_stands_between_chunks_without_an_end_is_left(begun: bytes, again: bytes) -> None:
    servers: list[ScriptedServer] = []
    with ScriptedServer(trickling(servers, begun, again), stream(*FRAMES[1:])) as server:
        servers.append(server)
        with HttpSource(server.url, stall_s=STALL_S) as source:
            found = [frame.jpeg for frame in itertools.islice(source, len(FRAMES))]
            assert found == FRAMES and source.counts.connections == 2


def test_a_server_s_words_steer_no_terminal_and_are_cut() -> None:
    for head in (
        b"HTTP/1.1 404 \x1b[2J" + b"x" * 9000,
        b"HTTP/1.1 200 OK\r\nContent-Type: \x1b]0;a",
    ):
        with ScriptedServer(head + b"\r\n\r\n") as server:
            with pytest.raises(WedgeError) as said:
                HttpSource(server.url)
        assert str(said.value).isprintable() and len(str(said.value)) < 300


def test_a_number_that_leaps_is_a_server_started_anew() -> None:
    far = [
        Stamp(1, 1, 1),
        Stamp(2, 2, 10**9),
        Stamp(3, 3, 10**9 + 3),
        Stamp(4, 4, FARTHEST_AHEAD),
    ]
    with ScriptedServer(stream(*FRAMES[:4], stamps=far)) as server:
        with HttpSource(server.url) as source:
            frames = list(itertools.islice(source, 4))
            assert source.counts.dropped == 2
    assert [frame.index for frame in frames] == [0, 1, 4, 5]


def test_a_jpeg_of_thousands_of_scans_is_not_decoded(tmp_path: Path) -> None:
    picture = io.BytesIO()
    pixels = np.random.default_rng(0).integers(0, 256, (64, 64, 3), np.uint8)
    Image.fromarray(pixels).save(picture, "JPEG", progressive=True)
    whole = picture.getvalue()
    assert decode_jpeg(whole).shape == pixels.shape
    last = whole.rindex(b"\xff\xda")
    bomb = whole[:last] + (MOST_SCANS + 1) * whole[last:-2] + whole[-2:]
    (tmp_path / "frame.jpg").write_bytes(bomb)
    assert (
        decode_jpeg(whole + b"\xff\xda" * (MOST_SCANS + 1)).shape == pixels.shape
    )  # behind its end
    for read in (lambda: decode_jpeg(bomb), lambda: read_image(tmp_path / "frame.jpg")):
        with pytest.raises(WedgeError, match=f"{MOST_SCANS} scans"):
            read()


def test_a_pipe_is_no_recording(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.mcap")
    with pytest.raises(WedgeError, match="is a pipe"):
        McapSource(tmp_path / "pipe.mcap")
