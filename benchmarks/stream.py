# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The client over loopback, its server a process of its own: rate, latency, age, recovery."""

import itertools
import multiprocessing
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from statistics import median

import cv2
import numpy as np

from benchmarks.measurement import Measurement
from recon.stream import HttpSource, Newest
from recon.stream.jpeg import decode_jpeg, encode_jpeg
from sensor.wire import CONTENT_TYPE, DELIMITER, Stamp, part

HEAD = f"HTTP/1.1 200 OK\r\nContent-Type: {CONTENT_TYPE}\r\n\r\n".encode() + DELIMITER
HOUR = 60 * 3600
"""Frames of an hour at 60 a second..."""
PLAYED_HZ = 2000.0
"""...played so quickly."""


def measure() -> Iterator[Measurement]:
    """Every figure of the client."""
    large = _jpeg((640, 480))
    out = np.empty((480, 640, 3), np.uint8)
    with _served(large, count=1500) as url, HttpSource(url) as source:
        frames = iter(source)
        decode_jpeg(next(frames).jpeg or b"", out)
        start = time.thread_time()
        for frame in itertools.islice(frames, 1400):
            decode_jpeg(frame.jpeg or b"", out)
        each_ms = 1e3 * (time.thread_time() - start) / 1400
    yield Measurement(
        name="client: 640x480, read and decoded as fast as frames come, processor time",
        value=each_ms,
        unit=f"ms a frame ({1e3 / each_ms:.0f} frames/s)",
        bar=1.0,
    )
    latencies_ms = []
    with _served(large, count=400, rate_hz=60.0) as url, HttpSource(url) as source:
        for frame in itertools.islice(source, 360):
            decode_jpeg(frame.jpeg or b"", out)
            latencies_ms.append((time.time_ns() - frame.time_ns) / 1e6)
    yield Measurement(
        name="client: 640x480 at 60 frames/s, from sending to decoded, median",
        value=median(latencies_ms),
        unit="ms",
        bar=1.5,
    )
    yield from _age()
    yield from _recovery()


def _age() -> Iterator[Measurement]:
    """A consumer that takes one frame of many, for as many frames as an hour has."""
    ages_ms: list[float] = []
    with (
        _served(_jpeg((64, 48)), count=HOUR, rate_hz=PLAYED_HZ) as url,
        Newest(HttpSource(url)) as newest,
    ):
        while (frame := newest.take(timeout_s=1.0)) is not None:
            ages_ms.append((time.time_ns() - frame.time_ns) / 1e6)
            if newest.source.counts.received >= HOUR:
                break
            time.sleep(0.01)
        received = newest.source.counts.received
    late = ages_ms[-len(ages_ms) // 10 :]
    yield Measurement(
        name=f"slow consumer: age of the frames it sees after {received} frames, 95th percentile",
        value=float(np.percentile(late, 95)),
        unit=f"ms (n {len(late)})",
        bar=40,
    )


def _recovery() -> Iterator[Measurement]:
    jpeg = _jpeg((64, 48))
    with _served(jpeg, count=10, hold=True) as url, HttpSource(url) as source:
        frames = iter(source)
        for _ in range(10):
            next(frames)
        start = time.perf_counter()
        next(frames)  # the connection is silent; the next one gives frames again
        silent_s = time.perf_counter() - start
    yield Measurement(
        name="client: server falls silent, until the next frame", value=silent_s, unit="s", bar=2
    )
    port = _free_port()
    with _served(jpeg, count=10, port=port) as url:
        source = HttpSource(url)
        frames = iter(source)
        for _ in range(10):
            next(frames)
    answers: list[float] = []

    def wait_for_one() -> None:
        next(frames)
        answers.append(time.perf_counter())

    reader = threading.Thread(target=wait_for_one)
    reader.start()
    time.sleep(1.3)  # the server is away; the client tries again and again
    with _served(jpeg, count=10, port=port):
        start = time.perf_counter()
        reader.join()
    source.close()
    back_s = answers[0] - start
    yield Measurement(
        name="client: server restarted, until the next frame", value=back_s, unit="s", bar=2
    )


def _jpeg(size_px: tuple[int, int]) -> bytes:
    """About 20 kB for 640x480, as gel looks."""
    rng = np.random.default_rng(0)
    grain = rng.normal(128, 40, (size_px[1], size_px[0], 3)).astype(np.float32)
    smooth = cv2.GaussianBlur(grain, (0, 0), 4) + rng.normal(0, 1.5, grain.shape)
    return encode_jpeg(np.clip(smooth, 0, 255).astype(np.uint8), 75)


def _free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as found:
        return int(found.getsockname()[1])


@contextmanager
def _served(
    jpeg: bytes, *, count: int, rate_hz: float | None = None, hold: bool = False, port: int = 0
) -> Iterator[str]:
    """A server process that sends so many frames to each connection; its address."""
    port = port or _free_port()
    context = multiprocessing.get_context("spawn")
    ready = context.Event()
    process = context.Process(
        target=_serve, args=(port, jpeg, count, rate_hz, hold, ready), daemon=True
    )
    process.start()
    ready.wait()
    try:
        yield f"http://127.0.0.1:{port}"
    finally:
        process.kill()
        process.join()


def _serve(
    port: int, jpeg: bytes, count: int, rate_hz: float | None, hold: bool, ready: "object"
) -> None:
    server = socket.create_server(("127.0.0.1", port))
    ready.set()  # type: ignore[attr-defined]
    held = []
    while True:
        connection, _ = server.accept()
        held.append(connection)
        with suppress(OSError):
            connection.recv(65536)
            connection.sendall(HEAD)
            start = time.perf_counter()
            for index in range(count):
                if rate_hz is not None:
                    time.sleep(max(0.0, start + index / rate_hz - time.perf_counter()))
                stamp = Stamp(time.time_ns(), time.monotonic_ns(), index)
                connection.sendall(part(jpeg, stamp))
        if not hold:
            held.pop().close()
