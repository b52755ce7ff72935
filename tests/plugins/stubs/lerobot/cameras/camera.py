# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What every LeRobot camera must be able to do."""

import abc


class Camera(abc.ABC):
    def __init__(self, config) -> None:
        self.fps, self.width, self.height = config.fps, config.width, config.height

    @property
    @abc.abstractmethod
    def is_connected(self): ...

    @staticmethod
    @abc.abstractmethod
    def find_cameras(): ...

    @abc.abstractmethod
    def connect(self, warmup=True): ...

    @abc.abstractmethod
    def read(self): ...

    @abc.abstractmethod
    def async_read(self, timeout_ms=200): ...

    @abc.abstractmethod
    def read_latest(self, max_age_ms=500): ...

    @abc.abstractmethod
    def disconnect(self): ...
