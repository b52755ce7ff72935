# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A million frames through the server, with clients that stay and clients that come and go.

Prints memory, descriptors and threads after the first part and at the end; they must be the same.
Minutes, so no test runs it:

    python tests/firmware_pi/soak.py 1000000
"""

import http.client
import os
import socket
import sys
import threading
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from firmware_pi.newest import Newest
from firmware_pi.server import StreamServer

JPEG = os.urandom(22_000)  # a frame of 640 x 480 at quality 85 is about so large
STAY, COME_AND_GO = 2, 300


def used() -> str:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    mebibytes = pages * os.sysconf("SC_PAGESIZE") / 2**20
    descriptors = len(list(Path("/proc/self/fd").iterdir()))
    return f"{mebibytes:.0f} MiB, {descriptors} descriptors, {threading.active_count()} threads"


def put(newest: Newest, count: int) -> None:
    for _ in range(count):
        newest.put(JPEG, time.clock_gettime_ns(time.CLOCK_BOOTTIME))
        time.sleep(0)  # lets the clients' threads run


def read_on(address: tuple[str, int]) -> None:
    with socket.create_connection(address) as connection:
        connection.sendall(b"GET /stream.mjpg HTTP/1.1\r\n\r\n")
        buffer = bytearray(2**18)
        while connection.recv_into(buffer):
            pass


def look_in(newest: Newest, address: tuple[str, int]) -> None:
    connection = http.client.HTTPConnection(*address)
    connection.request("GET", "/stream.mjpg")
    answer = connection.getresponse()
    answer.read(1000)
    answer.close()
    connection.close()
    put(newest, 1)


def main() -> None:
    count = int(sys.argv[1])
    newest = Newest()
    server = StreamServer("127.0.0.1", 0, newest, dict, max_clients=STAY + 2)
    address = ("127.0.0.1", int(server.server_address[1]))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    for _ in range(STAY):
        threading.Thread(target=read_on, args=(address,), daemon=True).start()
    put(newest, count // 50)
    print(f"after {count // 50} frames: {used()}")
    began = time.monotonic()
    put(newest, count)
    seconds = time.monotonic() - began
    for _ in range(COME_AND_GO):
        look_in(newest, address)
    while server.clients > STAY:
        put(newest, 1)
        time.sleep(0.01)
    print(f"after {newest.count} frames and {COME_AND_GO} visits: {used()}")
    print(f"{count / seconds:.0f} frames/s with {STAY} clients")


if __name__ == "__main__":
    main()
