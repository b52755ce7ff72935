# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Poses as tf2_msgs/msg/TFMessage of ROS 2, in an MCAP file that Foxglove and RViz open."""

import struct
from collections.abc import Iterable
from pathlib import Path

from scipy.spatial.transform import Rotation

from recon.pose.rigid import Transform
from recon.stream.mcap_file import McapFile

SCHEMA_NAME = "tf2_msgs/msg/TFMessage"
SCHEMA = "\n".join(
    [
        "geometry_msgs/TransformStamped[] transforms",
        "=" * 80,
        "MSG: geometry_msgs/TransformStamped",
        "std_msgs/Header header",
        "string child_frame_id",
        "geometry_msgs/Transform transform",
        "=" * 80,
        "MSG: std_msgs/Header",
        "builtin_interfaces/Time stamp",
        "string frame_id",
        "=" * 80,
        "MSG: builtin_interfaces/Time",
        "int32 sec",
        "uint32 nanosec",
        "=" * 80,
        "MSG: geometry_msgs/Transform",
        "geometry_msgs/Vector3 translation",
        "geometry_msgs/Quaternion rotation",
        "=" * 80,
        "MSG: geometry_msgs/Vector3",
        "float64 x",
        "float64 y",
        "float64 z",
        "=" * 80,
        "MSG: geometry_msgs/Quaternion",
        "float64 x",
        "float64 y",
        "float64 z",
        "float64 w",
        "",
    ]
)
TOPIC = "/tf"
PARENT, CHILD = "gel", "object"
MM_PER_M = 1000.0


def write_transforms(path: Path, poses: Iterable[tuple[int, Transform]]) -> None:
    """Write poses ``T_sensor_object`` (mm) with their times as transforms in metres.

    Args:
        path: of a new file.
        poses: nanoseconds since the Unix epoch, and the pose.

    Raises:
        WedgeError: the file exists or cannot be written, or mcap is not installed.
    """
    file = McapFile(path, (SCHEMA_NAME, "ros2msg", SCHEMA), {})
    try:
        channel = file.add_channel(TOPIC)
        for time_ns, pose in poses:
            file.add_message(channel, tf_message(time_ns, pose), time_ns, time_ns)
    finally:
        file.close()


def tf_message(time_ns: int, pose: Transform) -> bytes:
    """One transform from the object to the gel frame as CDR, little-endian."""
    body = struct.pack("<IiI", 1, *divmod(time_ns, 10**9))
    for text in (PARENT, CHILD):
        coded = text.encode() + b"\0"
        body += b"\0" * (-len(body) % 4) + struct.pack("<I", len(coded)) + coded
    body += b"\0" * (-len(body) % 8)
    x, y, z, w = Rotation.from_matrix(pose[:3, :3]).as_quat()
    body += struct.pack("<7d", *(pose[:3, 3] / MM_PER_M), x, y, z, w)
    return b"\0\1\0\0" + body
