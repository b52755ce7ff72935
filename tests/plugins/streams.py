# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The Pi's server with frames that a test puts into it."""

import io
import threading
import time

from PIL import Image

from firmware_pi.newest import Newest
from firmware_pi.server import StreamServer


class Stream:
    """A stream at ``url`` of flat frames, 64 x 48."""

    def __init__(self) -> None:
        self._newest = Newest()
        self._server = StreamServer("127.0.0.1", 0, self._newest, dict)
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.01,))
        self.url = f"http://127.0.0.1:{self._server.server_address[1]}"

    def __enter__(self) -> "Stream":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._server.stop()
        self._thread.join()

    def put(self, level: int | tuple[int, int, int]) -> None:
        """Send a frame of one colour."""
        rgb = (level, level, level) if isinstance(level, int) else level
        file = io.BytesIO()
        Image.new("RGB", (64, 48), rgb).save(file, "JPEG", quality=95, subsampling=0)
        self._newest.put(file.getvalue(), time.clock_gettime_ns(time.CLOCK_BOOTTIME))
