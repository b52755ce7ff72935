# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Encoders that remember what they were asked for."""

import os


class JpegEncoder:
    firsttimestamp = None

    def __init__(self, num_threads: int = 4, q: int | None = None) -> None:
        self.asked = {"q": q}


class LibavMjpegEncoder:
    pass


class _HardwareEncoder:
    firsttimestamp = None

    def __init__(self, bitrate: int | None = None) -> None:
        self.asked = {"bitrate": bitrate}


MJPEGEncoder = LibavMjpegEncoder if "five" in os.environ.get("FAKE_PI", "") else _HardwareEncoder
