# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Stands in for libcamera's Python bindings: the enumerations, by the names that they have."""

import enum
import os
import tomllib
from pathlib import Path
from types import SimpleNamespace

NAMES = tomllib.loads((Path(__file__).parent.parent / "libcamera.toml").read_text())

ColorSpace = SimpleNamespace(Sycc=lambda: "sYCC", Smpte170m=lambda: "SMPTE170M")
controls = SimpleNamespace(
    draft=SimpleNamespace(
        NoiseReductionModeEnum=enum.IntEnum(
            "NoiseReductionModeEnum", NAMES["enumerations"]["NoiseReductionModeEnum"]
        )
    )
)
if os.environ.get("FAKE_PI_SYNC"):  # Raspberry Pi's own libcamera; Debian's 0.4.0 has none
    controls.rpi = SimpleNamespace(
        SyncModeEnum=enum.IntEnum("SyncModeEnum", {"Off": 0, "Server": 1, "Client": 2})
    )
