# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Stands in for rclpy: remembers what was published, and by whom."""

import threading
from types import SimpleNamespace

from rclpy.executors import ExternalShutdownException

ASKED: dict = {}
"""Values of parameters, as -p gives them."""
PUBLISHED: dict = {}
LOGGED: list = []
_ended = threading.Event()


def init(args=None) -> None:
    PUBLISHED.clear()
    LOGGED.clear()
    _ended.clear()


def ok() -> bool:
    return not _ended.is_set()


def spin(node) -> None:
    """As rclpy does, it ends in an exception once ROS was shut down from elsewhere."""
    _ended.wait()
    raise ExternalShutdownException


def try_shutdown() -> None:
    _ended.set()


class _Node:
    def declare_parameter(self, name, default):
        value = ASKED.get(name, default)
        assert type(value) is type(default)
        return SimpleNamespace(value=value)

    def create_publisher(self, kind, topic, qos):
        messages = PUBLISHED.setdefault(topic, [])

        def publish(message) -> None:
            assert type(message) is kind
            messages.append(message)

        return SimpleNamespace(publish=publish)

    def get_logger(self):
        return SimpleNamespace(warning=LOGGED.append, error=LOGGED.append)


def create_node(name: str) -> _Node:
    assert name.isidentifier()
    return _Node()
