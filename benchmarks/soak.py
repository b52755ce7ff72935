# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames by the hundred thousand through server, source, recorder and pipeline, and what grows.

Not a part of `wedge bench`, for a million frames take about ten minutes:

    python -m benchmarks.soak 1000000

Small frames, sent as fast as they are taken, over loopback and with a damaged part in every
thousand; each is recorded, and depth is reconstructed from each. Memory and descriptors are read
after a tenth, when everything has been in use, and after nine tenths.
"""

import argparse
import itertools
import os
import socket
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

from recon.calibration import Calibration
from recon.estimators.mlp import HIDDEN, Mlp
from recon.fast import FastReconstructor
from recon.stream import HttpSource, Recorder
from recon.stream.jpeg import encode_jpeg
from sensor.documents import json_bytes
from sensor.unit import UnitCard
from sensor.wire import CONTENT_TYPE, DELIMITER, Stamp, part

SIZE_PX = (48, 32)
DAMAGED_EVERY = 1000
LEAST_FRAMES = 100
FRAMES_PER_FILE = 100_000
"""Recordings are begun anew, so that the disk does not fill."""


def soak(frames: int) -> dict[str, float]:
    """Pass so many frames; what was lost and what grew."""
    unit = _unit()
    rng = np.random.default_rng(0)
    noise = [rng.integers(-9, 9, unit.background.shape) for _ in range(16)]
    jpegs = [encode_jpeg((unit.background + n).astype(np.uint8), 85) for n in noise]
    server = socket.create_server(("127.0.0.1", 0))
    threading.Thread(target=_serve, args=(server, jpegs, frames), daemon=True).start()
    reconstruct = FastReconstructor(unit)
    begun, sizes = time.monotonic(), []
    with (
        tempfile.TemporaryDirectory() as folder,
        HttpSource(f"http://127.0.0.1:{server.getsockname()[1]}") as source,
    ):
        stream = itertools.islice(source, frames - frames // DAMAGED_EVERY)
        for number in itertools.count():
            path = Path(folder) / f"{number}.mcap"
            with Recorder(path, {"wedge": None}) as recorder:
                for frame in itertools.islice(stream, FRAMES_PER_FILE):
                    recorder.add("wedge", frame)
                    reconstruct(frame)
                    if source.counts.received in (frames // 10, frames * 9 // 10):
                        sizes.append((_memory_mb(), _descriptors()))
                count = recorder.frames
            path.unlink()
            if count == 0:
                break
        counts = source.counts
    return {
        "frames": counts.received,
        "damaged": counts.corrupt,
        "dropped": counts.dropped,
        "connections": counts.connections,
        "frames_per_s": counts.received / (time.monotonic() - begun),
        "memory_mb_after_a_tenth": sizes[0][0],
        "memory_mb_after_nine_tenths": sizes[-1][0],
        "descriptors_after_a_tenth": sizes[0][1],
        "descriptors_after_nine_tenths": sizes[-1][1],
    }


def _serve(server: socket.socket, jpegs: list[bytes], frames: int) -> None:
    connection, _ = server.accept()
    connection.recv(65536)
    head = f"HTTP/1.1 200 OK\r\nContent-Type: {CONTENT_TYPE}\r\n\r\n"
    connection.sendall(head.encode() + DELIMITER)
    for index in range(frames):
        jpeg = jpegs[index % len(jpegs)]
        if index % DAMAGED_EVERY == DAMAGED_EVERY - 1:
            jpeg = jpeg[: len(jpeg) // 2]
        connection.sendall(part(jpeg, Stamp(time.time_ns(), time.monotonic_ns(), index)))
    connection.recv(1)  # until the reader has had enough
    connection.close()


def _memory_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def _descriptors() -> int:
    return len(os.listdir("/proc/self/fd"))  # noqa: PTH208


def _unit() -> Calibration:
    """A unit with a random network: only its size matters here."""
    rng = np.random.default_rng(0)
    sizes = itertools.pairwise((5, *HIDDEN, 2))
    layers = tuple(
        (rng.normal(0, 1 / np.sqrt(n), (n, m)).astype(np.float32), np.zeros(m, np.float32))
        for n, m in sizes
    )
    card = UnitCard(
        serial="soak",
        created="2000-01-01",
        dataset="none",
        dataset_sha256="",
        estimator="mlp",
        channels="RGB",
        missing_axis="none",
        mm_per_px=(0.1, 0.1),
        frame_size_px=SIZE_PX,
        size_px=SIZE_PX,
        metrics={},
    )
    background = np.full((SIZE_PX[1], SIZE_PX[0], 3), 120, np.uint8)
    scale = np.full(3, 0.07, np.float32)
    network = Mlp(channels="RGB", color_scale=scale, layers=layers)
    return Calibration(card=card, background=background, estimator=network)


def main() -> None:
    """Pass frames and print what was lost and what grew, as JSON."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.soak", description=__doc__)
    parser.add_argument("frames", type=int, help="such as 1000000")
    options = parser.parse_args()
    if options.frames < LEAST_FRAMES:
        parser.error(f"frames must be {LEAST_FRAMES} at least, of which a tenth is looked at")
    print(json_bytes(soak(options.frames)).decode(), end="")


if __name__ == "__main__":
    main()
