# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A stream goes on through whatever happens to it, and says in a sentence what cannot be helped."""

import base64
import errno
import itertools
import os
import shutil
import socket
import ssl
import threading
import time
from http.client import HTTPSConnection

import pytest

from recon.stream import http
from recon.stream.frame import TimedFrame
from recon.stream.http import BACK_OFF_S, STALL_S, HttpSource, hidden_login, shown_address
from recon.stream.sources import open_source
from sensor.errors import WedgeError
from sensor.wire import CONTENT_TYPE, DELIMITER, Stamp, part
from tests.recon.stream.servers import (
    FRAMES,
    HEAD,
    ScriptedServer,
    chunked,
    debian_server,
    free_port,
    reset,
    stream,
)

SECOND_NS = 10**9


@pytest.fixture(autouse=True)
def no_pause(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(http, "BACK_OFF_S", (0.001,))


def jpegs(source: HttpSource, count: int) -> list[bytes]:
    return [frame.jpeg for frame in itertools.islice(source, count)]


def test_it_is_back_within_two_seconds() -> None:
    # A server that comes back to life just after an attempt, or falls silent on a connection.
    assert max(STALL_S, 0.2) + max(BACK_OFF_S) <= 2


def test_frames_bear_the_sensor_s_time_and_gaps_are_counted() -> None:
    sent_ns = time.time_ns() - 5_000_000
    stamps = [Stamp(sent_ns + i, 77 + i, index) for i, index in enumerate((0, 1, 5, 6))]
    with ScriptedServer(stream(*FRAMES[:4], stamps=stamps)) as server:
        with HttpSource(server.url) as source:
            frames = list(itertools.islice(source, 4))
            counts = source.counts
    assert [frame.jpeg for frame in frames] == FRAMES[:4]
    assert [frame.time_ns for frame in frames] == [sent_ns + i for i in range(4)]
    assert [frame.index for frame in frames] == [0, 1, 5, 6]
    assert all(frame.clock == "sensor" and frame.latency_ms >= 5 for frame in frames)
    assert (counts.received, counts.dropped, counts.corrupt, counts.remark) == (4, 3, 0, "")


def numbered(*indexes: int, begun_ns: int = 10**12) -> bytes:
    """A whole answer with frames of these numbers, taken as they were numbered."""
    stamps = [Stamp(sensor_timestamp_ns=begun_ns + i, index=i) for i in indexes]
    return stream(*(FRAMES[i % len(FRAMES)] for i in indexes), stamps=stamps)


def test_frames_that_a_broken_connection_costs_are_counted() -> None:
    damaged = numbered(0, 1, 2).replace(FRAMES[2], b"no JPEG")
    anew = numbered(0, 1, 3, begun_ns=10**9)
    with ScriptedServer(damaged, numbered(90, 91), anew) as server:
        with HttpSource(server.url) as source:
            frames = [frame.index for frame in itertools.islice(source, 7)]
            assert (source.counts.dropped, source.counts.corrupt) == (87 + 1, 1)
    assert frames == [0, 1, 89, 90, 91, 92, 94]


def test_a_frame_that_is_sent_again_on_a_new_connection_is_given_once() -> None:
    with ScriptedServer(numbered(0, 1), numbered(1), numbered(1, 2)) as server:
        with HttpSource(server.url) as source:
            assert jpegs(source, 3) == FRAMES[:3]
            assert (source.counts.received, source.counts.dropped) == (3, 0)


def test_what_is_damaged_within_counts_beside_what_is_damaged_on_the_way() -> None:
    within = FRAMES[1][:200] + bytes(40) + FRAMES[1][-2:]
    sent = stream(FRAMES[0], within, FRAMES[2], *FRAMES[:3]).replace(FRAMES[2], b"no JPEG", 1)
    with ScriptedServer(sent) as server:
        with HttpSource(server.url) as source:
            for frame in itertools.islice(source, 5):
                try:
                    frame.image()
                except WedgeError:
                    source.counts.add_corrupt()
            assert source.counts.corrupt == 2


PAGE = b"HTTP/1.1 200 OK\r\nContent-Type: text/html\r\n\r\n<p>"
BROKEN = {
    "ends": stream(*FRAMES[:3]),
    "ends in a frame": stream(*FRAMES[:4])[: -len(FRAMES[3]) // 2],
    "ends in a head": stream(*FRAMES[:3]) + b"Content-Ty",
    "reset": lambda connection: (connection.sendall(stream(*FRAMES[:3])), reset(connection)),
    "chunks of no size": HEAD.replace(b"\r\n\r\n", b"\r\nTransfer-Encoding: chunked\r\n\r\n")
    + chunked(DELIMITER + b"".join(part(x, Stamp()) for x in FRAMES[:3]), 99)
    + b"zzz\r\n",
}


@pytest.mark.parametrize("broken", BROKEN.values(), ids=BROKEN)
def test_a_broken_connection_is_made_anew(broken: object) -> None:
    with ScriptedServer(broken, stream(*FRAMES[4:])) as server, HttpSource(server.url) as source:
        assert jpegs(source, 7) == FRAMES[:3] + FRAMES[4:]
        assert source.counts.connections == 2


CUT = {
    "ends": lambda connection: connection.sendall(BROKEN["ends in a frame"]),
    "reset": lambda connection: (connection.sendall(BROKEN["ends in a frame"]), reset(connection)),
    "falls silent": lambda connection: (
        connection.sendall(BROKEN["ends in a frame"]),
        connection.recv(1),
    ),
}


@pytest.mark.parametrize("cut", CUT.values(), ids=CUT)
def test_a_frame_that_is_cut_off_with_its_connection_is_counted(cut: object) -> None:
    with ScriptedServer(cut, cut, stream(*FRAMES)) as server:
        with HttpSource(server.url, stall_s=0.15) as source:
            assert len(jpegs(source, 14)) == 14
            assert (source.counts.corrupt, source.counts.connections) == (2, 3)


def test_a_frame_that_who_closes_cuts_off_is_not_counted() -> None:
    def send(connection: socket.socket) -> None:
        connection.sendall(BROKEN["ends in a frame"])
        server.over.wait()

    with ScriptedServer(send) as server, HttpSource(server.url, stall_s=60.0) as source:
        frames = iter(source)
        assert [next(frames).jpeg for _ in range(3)] == FRAMES[:3]
        reader = threading.Thread(target=lambda: list(frames))
        reader.start()
        source.close()
        reader.join()
        assert source.counts.corrupt == 0


def test_a_silent_or_trickling_server_is_left() -> None:
    def silent(connection: socket.socket) -> None:
        connection.sendall(stream(*FRAMES[:1]))
        server.over.wait()

    def trickle(connection: socket.socket) -> None:
        connection.sendall(HEAD + DELIMITER)
        while not server.over.wait(0.01):
            connection.sendall(b"X")

    with (
        ScriptedServer(silent, trickle, stream(*FRAMES[1:])) as server,
        HttpSource(server.url, stall_s=0.15) as source,
    ):
        assert jpegs(source, 8) == FRAMES
        assert source.counts.connections == 3


def test_a_server_may_be_gone_for_a_while() -> None:
    first = ScriptedServer(stream(*FRAMES[:2]))
    with HttpSource(first.url) as source:
        frames = iter(source)
        assert [next(frames).jpeg for _ in range(2)] == FRAMES[:2]
        assert not source.counts.lost
        first.__exit__()
        found: list[bytes] = []
        reader = threading.Thread(target=lambda: found.append(next(frames).jpeg))
        reader.start()
        while not source.counts.lost:
            reader.join(0.001)
        assert "lost: " in source.counts.remark
        with ScriptedServer(stream(FRAMES[2]), port=first.port):
            reader.join()
        assert found == FRAMES[2:3]
        assert not source.counts.lost


def test_a_frame_makes_the_next_pause_short_again(monkeypatch: pytest.MonkeyPatch) -> None:
    class Pauses(tuple[float, ...]):
        def __getitem__(self, index):
            asked.append(index)
            return super().__getitem__(index)

    asked: list[int] = []
    monkeypatch.setattr(http, "BACK_OFF_S", Pauses((0.001,) * 4))
    none = b"HTTP/1.1 503 Service Unavailable\r\n\r\n"
    streams = [stream(frame) for frame in FRAMES]
    with ScriptedServer(*streams[:3], none, none, *streams[3:]) as server:
        with HttpSource(server.url) as source:
            assert jpegs(source, 6) == FRAMES[:6]
    assert asked == [0, 0, 0, 1, 2, 0, 0]


@pytest.mark.parametrize("size", [1, 7, 5000])
def test_chunks_do_not_matter(size: int) -> None:
    head = f"HTTP/1.1 200 OK\r\ncontent-type: {CONTENT_TYPE}\r\ntransfer-encoding: chunked\r\n\r\n"
    body = DELIMITER + b"".join(part(jpeg, Stamp()) for jpeg in FRAMES)
    with ScriptedServer(head.encode() + chunked(body, size)) as server:
        with HttpSource(server.url) as source:
            assert jpegs(source, 8) == FRAMES


@pytest.mark.parametrize(
    ("answer", "sentence"),
    {
        "wrong password": (b"HTTP/1.1 401 Unauthorized\r\n\r\n", "refuses the name and password"),
        "wrong path": (b"HTTP/1.1 404 Not Found\r\n\r\n", "answers 404 Not Found"),
        "a page": (
            b"HTTP/1.1 200 OK\r\nContent-Type: text/html\r\n\r\n<p>",
            "sends text/html, not",
        ),
        "no boundary": (
            b"HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace\r\n\r\n",
            "not a stream of JPEGs",
        ),
        "no HTTP": (b"SSH-2.0-OpenSSH\r\n", "the answer is not HTTP"),
        "an endless head": (b"HTTP/1.1 200 OK\r\nX: " + b"x" * 200_000, "the answer is not HTTP"),
        "nothing": (b"", "it hung up without an answer; check that the server"),
    }.values(),
)
def test_what_is_no_stream_is_refused_in_a_sentence(answer: bytes, sentence: str) -> None:
    with ScriptedServer(answer) as server:
        address = server.url.replace("//", "//me:secret@", 1)
        with pytest.raises(WedgeError, match=sentence) as refused:
            HttpSource(address)
    assert "secret" not in str(refused.value)


def test_no_camera_at_the_other_end_is_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(WedgeError, match=r"at that port; start the camera server there\.$"):
        open_source(f"http://127.0.0.1:{free_port()}")

    def unknown(*_: object, **__: object) -> None:
        raise socket.gaierror(-2, "Name or service not known")

    monkeypatch.setattr(socket, "getaddrinfo", unknown)
    with pytest.raises(WedgeError, match="no machine with that name"):
        open_source("http://wedge-pi.local:8080")
    for address in ("http://", "http://:8080/", "http://pi:notaport/", "http://pi:0/"):
        with pytest.raises(WedgeError, match="not the address of a stream"):
            open_source(address)
    for address in ("http://[fe80::1%25lo]:1/", "http://[FEBF::1]:1", "http://[fd00::1%lo]:1/"):
        with pytest.raises(WedgeError, match="known on one link only"):
            open_source(address)


@pytest.mark.parametrize(
    ("number", "sentence"),
    [
        (errno.EHOSTUNREACH, "no route to it; check the cable"),
        (errno.ENETUNREACH, "no route to it; check the cable"),
        (errno.ETIMEDOUT, "nothing answers in time"),
    ],
)
def test_no_way_there_is_a_sentence(
    number: int, sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(socket, "create_connection", fail)
    with pytest.raises(WedgeError, match=sentence):
        HttpSource("http://10.55.0.1:8080")


def test_a_certificate_that_nobody_vouches_for_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def distrust(*_: object) -> None:
        error = ssl.SSLCertVerificationError(1, "[SSL: CERTIFICATE_VERIFY_FAILED]")
        error.verify_message = "self-signed certificate"  # as Python sets it
        raise error

    monkeypatch.setattr(HTTPSConnection, "connect", distrust)
    with pytest.raises(
        WedgeError, match=r"not trusted \(self-signed certificate\); .*SSL_CERT_FILE"
    ):
        HttpSource("https://wedge-pi.local:8080")


def test_parts_that_are_no_jpegs_are_refused() -> None:
    picture = b"\x89PNG\r\n\x1a\n" + bytes(100)
    with ScriptedServer(stream(*[picture] * http.NO_JPEGS)) as server:
        with HttpSource(server.url) as source, pytest.raises(WedgeError, match="sends no JPEGs"):
            next(iter(source))


def test_a_camera_that_never_gives_a_frame_is_said_and_left(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with ScriptedServer(HEAD) as server, HttpSource(server.url) as source:
        remarks: list[str] = []

        def patience(_self: HttpSource, waited_s: float) -> None:
            refuse(source, waited_s + 7 * len(remarks))
            remarks.append(source.counts.remark)

        refuse = HttpSource._refuse_no_frames
        monkeypatch.setattr(HttpSource, "_refuse_no_frames", patience)
        with pytest.raises(WedgeError, match="sends no frame: does its camera run"):
            next(iter(source))
    assert len(remarks) == 3
    assert all("sends no frame" in remark for remark in remarks)


def test_name_and_password_reach_the_server_alone() -> None:
    with ScriptedServer(stream(*FRAMES)) as server:
        with HttpSource(server.url.replace("//", "//me:s%3Acret@", 1)) as source:
            assert "cret" not in source.name
            assert jpegs(source, 8) == FRAMES
        (request,) = server.requests[:1]
    assert b"Basic " + base64.b64encode(b"me:s:cret") in request


def test_what_an_address_may_not_hold_is_coded() -> None:
    with ScriptedServer(stream(*FRAMES)) as server:
        with HttpSource(f"http://127.0.0.1:{server.port}/a b?x=u y&z=%20") as source:
            assert jpegs(source, 8) == FRAMES
    assert server.requests[0].startswith(b"GET /a%20b?x=u%20y&z=%20 HTTP/1.1\r\n")


def test_closing_wakes_who_waits() -> None:
    with ScriptedServer(
        lambda connection: (connection.sendall(HEAD), server.over.wait())
    ) as server:
        source = HttpSource(server.url, stall_s=60.0)
        reader = threading.Thread(target=lambda: list(source))
        reader.start()
        source.close()
        reader.join()


def test_a_clock_that_is_not_set_is_said() -> None:
    stamps = [Stamp(3600 * SECOND_NS + i, 50 + i, i) for i in range(2)]
    with ScriptedServer(stream(*FRAMES[:2], stamps=stamps)) as server:
        with HttpSource(server.url) as source:
            frames = list(itertools.islice(source, 2))
            assert "is not set" in source.counts.remark
    assert all(frame.clock == "mapped" and frame.latency_ms is None for frame in frames)


@pytest.mark.parametrize(
    "address",
    [
        "http://robot:geheim@127.0.0.1:99999",
        "http://robot:ge#heim@127.0.0.1",
        "http://robot:12#heim@127.0.0.1",
        "http://robot:ge/heim@127.0.0.1:8080/stream.mjpg",
        "http://robot:geheim@",
        "http://robot:geheim@[::1",
        "robot:geheim@host:9",
        "rtsp://robot:geheim@host/live",
    ],
)
def test_a_password_is_not_said_where_its_address_has_a_slip(address: str) -> None:
    with pytest.raises(WedgeError) as refused:
        open_source(address)
    assert "heim" not in str(refused.value) and "robot" not in str(refused.value)


def test_an_address_is_shown_without_its_login_alone() -> None:
    assert shown_address("http://a:b@host:1/s?tok=c@d") == "http://host:1/s?tok=c@d"
    assert shown_address("HTTP://host/s") == "http://host/s"
    assert hidden_login("my@folder") == "my@folder"


def test_latency_is_in_milliseconds() -> None:
    frame = TimedFrame(index=0, time_ns=10**18, arrived_ns=10**18 + 7_000_000, clock="sensor")
    assert frame.latency_ms == 7


@pytest.mark.parametrize("name", ["ffmpeg", "ustreamer", "motion", "cvlc"])
def test_other_projects_servers_are_read(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if shutil.which(name) is None:
        pytest.skip(f"{name} is not installed: see requirements/debian.txt")
    monkeypatch.setattr(http, "BACK_OFF_S", (0.02,))
    with debian_server(name) as url:
        for _ in range(1000):
            try:
                source = open_source(url)
                break
            except WedgeError:
                threading.Event().wait(0.02)
        with source:
            frames = list(itertools.islice(source, 3 if name == "ustreamer" else 12))
            counts = source.counts
    assert all(frame.image().shape[2] == 3 for frame in frames)
    assert (counts.corrupt, counts.connections) == (0, 1)
