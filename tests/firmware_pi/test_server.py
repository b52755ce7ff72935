# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The server on a real socket: the newest frame to everyone, harm to nobody."""

import base64
import http.client
import io
import json
import shutil
import subprocess
import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest
from PIL import Image

import firmware_pi.server
from firmware_pi.newest import Newest
from firmware_pi.server import OTHER_REQUESTS, REQUEST_BYTES, StreamServer
from sensor.errors import WedgeError
from tests.firmware_pi.clients import WITHIN_S, Stream, ask, connect, put, serving, until


@pytest.fixture
def newest() -> Newest:
    return Newest()


@pytest.fixture
def server(newest: Newest) -> Iterator[StreamServer]:
    with serving(newest) as server:
        yield server


def test_a_client_gets_each_frame_as_it_comes(newest: Newest, server: StreamServer) -> None:
    put(newest, b"frame 0")
    stream = Stream(server)
    for number in range(20):
        if number:
            put(newest, b"frame %d" % number)
        jpeg, stamp = stream.part()
        assert jpeg == b"frame %d" % number
        assert stamp.index == number
        assert stamp.timestamp_ns is not None
        assert abs(stamp.timestamp_ns - time.time_ns()) < WITHIN_S * 1e9
    stream.close()


def test_a_frame_is_stamped_with_the_time_it_was_taken(newest: Newest) -> None:
    taken_ns = time.clock_gettime_ns(time.CLOCK_BOOTTIME) - 5_000_000_000
    before_ns = time.time_ns()
    newest.put(b"", taken_ns)
    frame = newest.after(-1, 0)
    assert frame is not None
    assert frame.stamp.sensor_timestamp_ns == taken_ns
    assert frame.stamp.timestamp_ns is not None
    assert abs(before_ns - frame.stamp.timestamp_ns - 5_000_000_000) < 1_000_000_000


def test_a_frame_is_given_once_and_waited_for(newest: Newest) -> None:
    assert newest.after(-1, 0) is None
    put(newest, b"0")
    assert newest.after(0, 0) is None
    given: list[Any] = []
    waits = threading.Thread(target=lambda: given.append(newest.after(0, WITHIN_S)))
    waits.start()
    put(newest, b"1")
    waits.join()
    assert [frame.jpeg for frame in given] == [b"1"]


def test_a_client_that_reads_nothing_delays_nobody(newest: Newest, server: StreamServer) -> None:
    frames, size = 200, 150_000  # more than the buffers of a connection hold
    put(newest, bytes(size))
    idle, fast = Stream(server), Stream(server)
    for number in range(frames):
        if number:
            put(newest, bytes(size))
        assert fast.part()[1].index == number
    seen = [idle.part()[1].index]
    while seen[-1] != frames - 1:
        seen.append(idle.part()[1].index)
    assert len(seen) < frames  # it missed some and then had the newest
    assert seen == sorted(set(seen))
    idle.close()
    fast.close()


def test_a_client_that_takes_nothing_is_let_go(
    newest: Newest, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(firmware_pi.server, "WRITE_WITHIN_S", 0.2)
    with serving(newest) as server:
        put(newest, bytes(150_000))
        idle = Stream(server)
        until(lambda: server.clients == 1)

        def is_gone() -> bool:
            put(newest, bytes(150_000))
            return server.clients == 0

        until(is_gone)
        idle.close()


def test_a_client_that_goes_away_makes_room(newest: Newest) -> None:
    with serving(newest, max_clients=1) as server:
        put(newest, b"x")
        first = Stream(server)
        assert Stream(server).answer.status == 503
        answer, body = ask(server, "/health")
        assert (answer.status, json.loads(body)["clients"]) == (200, 1)
        first.close()

        def is_free() -> bool:
            put(newest, b"x")
            return server.clients == 0

        until(is_free)
        second = Stream(server)
        assert second.answer.status == 200
        second.close()


def test_many_clients_see_the_same_frame(newest: Newest) -> None:
    with serving(newest, max_clients=16) as server:
        put(newest, b"the frame")
        streams = [Stream(server) for _ in range(16)]
        assert [stream.part()[0] for stream in streams] == [b"the frame"] * 16
        for stream in streams:
            stream.close()


def test_connections_beyond_measure_are_closed_and_the_others_stay(newest: Newest) -> None:
    with serving(newest, max_clients=1) as server:
        put(newest, b"x")
        idle = [connect(server) for _ in range(1 + OTHER_REQUESTS)]
        with connect(server) as refused:
            assert refused.recv(1) == b""
        for connection in idle:
            connection.close()

        def answers() -> bool:
            try:
                return ask(server, "/health")[0].status == 200
            except (http.client.HTTPException, ConnectionError):
                return False

        until(answers)


def test_what_is_asked_for_is_what_is_given(newest: Newest, server: StreamServer) -> None:
    put(newest, b"a picture")
    answer, body = ask(server, "/snapshot.jpg")
    assert (answer.status, answer.getheader("Content-Type"), body) == (
        200,
        "image/jpeg",
        b"a picture",
    )
    assert answer.getheader("X-Frame-Index") == "0"
    assert json.loads(ask(server, "/settings")[1]) == {"asked": {"rate_hz": 58}}
    answer, body = ask(server, "/")
    assert (answer.status, answer.getheader("Content-Type")) == (200, "text/html")
    for path in ("/stream.mjpg", "/snapshot.jpg", "/settings", "/health"):
        assert f'<a href="{path}">' in body.decode()
    assert ask(server, "/no")[0].status == 404
    assert ask(server, "/stream.mjpg", "HEAD")[0].status == 200
    assert ask(server, "/snapshot.jpg", "HEAD")[1] == b""
    for method in ("POST", "PUT", "DELETE"):
        assert ask(server, "/settings", method)[0].status == 501


def test_health_tells_a_camera_that_gives_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(firmware_pi.server, "FRAME_WITHIN_S", 0.05)
    newest = Newest()
    with serving(newest) as server:
        assert ask(server, "/health")[0].status == 503
        assert ask(server, "/snapshot.jpg")[0].status == 503
        assert ask(server, "/stream.mjpg")[0].status == 503


def test_the_rate_is_the_sensors(newest: Newest) -> None:
    for number in range(10):
        newest.put(b"", 1_000_000_000 + number * 20_000_000)
    assert newest.rate_hz == pytest.approx(50.0)


def test_only_the_right_password_opens(newest: Newest) -> None:
    put(newest, b"x")

    def with_login(text: str) -> dict[str, str]:
        return {"Authorization": "Basic " + base64.b64encode(text.encode()).decode()}

    with serving(newest, credentials="wedge:sécret") as server:
        assert ask(server, "/health", headers=with_login("wedge:sécret"))[0].status == 200
        for wrong in (None, with_login("wedge:secret"), with_login(""), {"Authorization": "ÿ"}):
            for path in ("/stream.mjpg", "/snapshot.jpg", "/settings", "/health", "/no"):
                answer, body = ask(server, path, headers=wrong)
                assert (answer.status, body) == (401, b"")
                assert answer.getheader("WWW-Authenticate", "").startswith("Basic ")


@pytest.mark.parametrize(
    ("request_bytes", "status"),
    [
        (b"\0\xff\r\n\r\n", b"400"),
        (b"GET\r\n\r\n", b"400"),
        (b"GET / HTTP/9.9\r\n\r\n", b"505"),
        (b"GET / HTTP/x\r\n\r\n", b"400"),
        (b"GET /../../etc/passwd HTTP/1.1\r\n\r\n", b"404"),
        (b"GET /%00 HTTP/1.1\r\n\r\n", b"404"),
        (b"BREW / HTTP/1.1\r\n\r\n", b"501"),
        (b"GET / HTTP/1.1\r\n" + b"a: b\r\n" * 101 + b"\r\n", b"431"),
        (b"GET / HTTP/1.1\r\nA: " + b"a" * REQUEST_BYTES, b"431"),
        (b"\r\n" * (REQUEST_BYTES // 2), b"431"),
        (b"a" * REQUEST_BYTES, b"431"),
        (b"GET /no HTTP/1.1\r\nno colon\r\n\r\n", b"404"),
    ],
)
def test_a_malformed_request_is_refused(
    newest: Newest, server: StreamServer, request_bytes: bytes, status: bytes
) -> None:
    put(newest, b"x")
    with connect(server) as connection:
        connection.sendall(request_bytes)
        assert connection.recv(100).split()[1] == status
    assert ask(server, "/health")[0].status == 200


@pytest.mark.parametrize("empty", [b"\r\n", b"\n", b"\r\n\r\n\r\n"])
def test_empty_lines_before_a_request_are_passed_over(
    newest: Newest, server: StreamServer, empty: bytes
) -> None:
    put(newest, b"x")
    with connect(server) as connection:
        connection.sendall(empty + b"GET /health HTTP/1.1\r\n\r\n")
        assert connection.recv(15) == b"HTTP/1.1 200 OK"


def test_half_a_request_is_waited_for_no_longer_than_is_fair(
    newest: Newest, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(firmware_pi.server, "REQUEST_WITHIN_S", 0.1)
    with serving(newest) as server:
        for half in (b"", b"GET /stream.mjpg HTTP/1.1\r\nHost: x\r\n"):
            with connect(server) as connection:
                connection.sendall(half)
                assert connection.recv(1) == b""


def test_a_request_in_drops_is_cut_off_too(newest: Newest, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(firmware_pi.server, "REQUEST_WITHIN_S", 0.2)
    with serving(newest) as server, connect(server) as connection:
        connection.setblocking(False)

        def is_cut_off() -> bool:
            try:
                connection.send(b"a")
                return connection.recv(1) == b""
            except BlockingIOError:
                return False
            except ConnectionError:
                return True

        until(is_cut_off)


def test_stopping_ends_every_stream_and_frees_the_port(newest: Newest) -> None:
    with serving(newest) as server:
        put(newest, b"x")
        port = server.server_address[1]
        stream = Stream(server)
        stream.part()
    put(newest, b"y")
    with pytest.raises((EOFError, ConnectionError)):
        while True:
            stream.part()
    stream.close()
    StreamServer("127.0.0.1", port, newest, dict).server_close()


def test_a_port_in_use_is_one_sentence(server: StreamServer) -> None:
    with pytest.raises(WedgeError, match=r"cannot listen on .+ port \d+: another program"):
        StreamServer("127.0.0.1", server.server_address[1], Newest(), dict)


def test_the_cable_may_be_plugged_in_later() -> None:
    StreamServer("10.55.0.1", 0, Newest(), dict, before_up=True).server_close()


def test_an_address_that_this_machine_lacks_is_refused() -> None:
    with pytest.raises(WedgeError, match="this machine has no such address"):
        StreamServer("192.0.2.1", 0, Newest(), dict)  # kept for examples (RFC 5737)


@pytest.mark.parametrize(
    "command",
    [
        "ffmpeg -v error -f mpjpeg -i URL -frames:v 5 -f null -",
        "ffmpeg -v error -f mpjpeg -strict_mime_boundary 1 -i URL -frames:v 5 -f null -",
        "curl -s -S -f -m 20 -o /dev/null --max-filesize 1000 http://HOST/health",
        "curl -s -S -f -m 20 -o /dev/null http://HOST/snapshot.jpg",
    ],
)
def test_other_peoples_clients_are_content(
    newest: Newest, server: StreamServer, command: str
) -> None:
    words = command.split()
    if shutil.which(words[0]) is None:
        pytest.skip(f"{words[0]} is not installed")
    file = io.BytesIO()
    Image.new("RGB", (640, 480), (40, 90, 60)).save(file, "JPEG")
    put(newest, file.getvalue())
    host = "{}:{}".format(*server.server_address[:2])
    url = f"http://{host}/stream.mjpg"
    child = subprocess.Popen(
        [word.replace("URL", url).replace("HOST", host) for word in words],
        stderr=subprocess.PIPE,
    )
    while child.poll() is None:
        put(newest, file.getvalue())
        time.sleep(0.005)
    assert child.stderr is not None
    said = child.stderr.read()
    child.stderr.close()
    assert (child.returncode, said) == (0, b"")
