# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The registry of camera types, as draccus keeps it for LeRobot."""

import enum
from dataclasses import dataclass


class ColorMode(enum.StrEnum):
    RGB = "rgb"
    BGR = "bgr"


@dataclass(kw_only=True)
class CameraConfig:
    fps: int | None = None
    width: int | None = None
    height: int | None = None

    KNOWN = {}  # noqa: RUF012

    @classmethod
    def register_subclass(cls, name):
        def register(subclass):
            cls.KNOWN[name] = subclass
            return subclass

        return register
