# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Camera servers for tests: one that breaks as told, and those that Debian has."""

import contextlib
import os
import socket
import struct
import subprocess
import tempfile
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np

from recon.stream.jpeg import encode_jpeg
from sensor.wire import CONTENT_TYPE, DELIMITER, Stamp, part

FRAMES = [
    encode_jpeg(np.random.default_rng(seed).integers(0, 256, (24, 32, 3), np.uint8))
    for seed in range(8)
]
HEAD = f"HTTP/1.1 200 OK\r\nContent-Type: {CONTENT_TYPE}\r\nConnection: close\r\n\r\n".encode()

Script = Callable[[socket.socket], None]
"""What happens on one connection, after its request was read."""


def stream(*frames: bytes, stamps: list[Stamp] | None = None) -> bytes:
    """A whole answer with these frames."""
    stamps = stamps or [Stamp()] * len(frames)
    return HEAD + DELIMITER + b"".join(part(x, y) for x, y in zip(frames, stamps, strict=True))


def chunked(body: bytes, size: int) -> bytes:
    pieces = [body[at : at + size] for at in range(0, len(body), size)]
    return b"".join(b"%x\r\n%s\r\n" % (len(piece), piece) for piece in pieces)


def reset(connection: socket.socket) -> None:
    """Drop the connection without a goodbye."""
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    connection.close()


class ScriptedServer:
    """Answers each connection by the next script, and the last one again and again."""

    def __init__(self, *scripts: Script | bytes, port: int = 0) -> None:
        self.requests: list[bytes] = []
        self.over = threading.Event()
        """Set when the test is over: for scripts that wait."""
        self._scripts = scripts
        self._socket = socket.create_server(("127.0.0.1", port), reuse_port=True)
        self.port = self._socket.getsockname()[1]
        self.url = f"http://127.0.0.1:{self.port}/stream.mjpg"
        self._threads = [threading.Thread(target=self._accept)]
        self._threads[0].start()

    def __enter__(self) -> "ScriptedServer":
        return self

    def __exit__(self, *_: object) -> None:
        self.over.set()
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()
        for thread in self._threads:
            thread.join()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                connection, _ = self._socket.accept()
                script = self._scripts[min(len(self.requests), len(self._scripts) - 1)]
                self.requests.append(connection.recv(65536))
                thread = threading.Thread(target=self._answer, args=(connection, script))
                self._threads.append(thread)
                thread.start()

    def _answer(self, connection: socket.socket, script: Script | bytes) -> None:
        with connection, contextlib.suppress(OSError):
            if isinstance(script, bytes):
                connection.sendall(script)
            else:
                script(connection)


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as found:
        return int(found.getsockname()[1])


def write_clip(path: Path, frames: int = 60) -> Path:
    """A Motion JPEG film of a moving square, 160 x 120 at 30 frames/s."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 30, (160, 120))
    for index in range(frames):
        image = np.full((120, 160, 3), 40, np.uint8)
        image[40:70, 2 * index % 120 : 2 * index % 120 + 30] = 220
        writer.write(image)
    writer.release()
    return path


def debian_command(name: str, port: int, folder: Path) -> tuple[list[str], str]:
    """How to start a server that Debian has, and the path of its stream."""
    clip = write_clip(folder / "clip.avi")
    if name == "ffmpeg":
        source = "-re -f lavfi -i testsrc2=size=160x120:rate=60 -c:v mjpeg -f mpjpeg -listen 1"
        kind = ["-content_type", "multipart/x-mixed-replace;boundary=ffmpeg"]
        address = f"http://127.0.0.1:{port}/stream"
        return ["ffmpeg", "-loglevel", "error", *source.split(), *kind, address], "/stream"
    if name == "ustreamer":  # without a camera it sends a picture that says so
        options = f"--device=/dev/none --persistent --host=127.0.0.1 --port={port}"
        return ["ustreamer", *options.split()], "/stream?advance_headers=1"
    if name == "motion":
        lines = {
            "netcam_url": f"file://{clip}",
            "width": "160",
            "height": "120",
            "stream_port": str(port),
            "stream_localhost": "on",
            "stream_maxrate": "60",
            "webcontrol_port": "0",
            "movie_output": "off",
            "target_dir": str(folder),
        }
        settings = folder / "motion.conf"
        settings.write_text("".join(f"{key} {value}\n" for key, value in lines.items()))
        return ["motion", "-n", "-c", str(settings)], "/"
    output = (
        "#standard{access=http{mime=multipart/x-mixed-replace;boundary="
        "7b3cc56e5f51db803f790dad720ed50a},mux=mpjpeg,dst=/s}"
    )
    options = ["--loop", "--http-host=127.0.0.1", f"--http-port={port}", "--sout", output]
    return ["cvlc", "-q", str(clip), *options], "/s"


@contextlib.contextmanager
def debian_server(name: str) -> Iterator[str]:
    """A server of another project's as a process; the address of its stream."""
    port = free_port()
    with tempfile.TemporaryDirectory() as home:
        command, path = debian_command(name, port, Path(home))
        as_nobody = name == "cvlc" and os.getuid() == 0  # VLC does not run as root
        Path(home).chmod(0o755)
        with subprocess.Popen(
            command,
            cwd=home,
            user=65534 if as_nobody else None,
            env={**os.environ, "HOME": home},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        ) as process:
            try:
                yield f"http://127.0.0.1:{port}{path}"
            finally:
                process.kill()
