# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Stands in for rclpy.executors."""


class ExternalShutdownException(Exception):  # noqa: N818 - its name there
    """ROS was shut down while a node was spun."""
