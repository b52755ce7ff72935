# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What a sensor feels as an MCAP file of ROS 2 messages, which Foxglove and RViz draw.

Topics and fields are those of ``docs/formats.md``; lengths are in metres, as everywhere in ROS.
"""

from pathlib import Path

import numpy as np

from recon.cloud import Skin, point_cloud
from recon.markers.tracking import Tracked
from recon.pose.estimate import PoseEstimate
from recon.pose.rest import rest_at
from recon.pose.tf_message import MM_PER_M, TF_MESSAGE, tf_message
from recon.stream.cdr import CdrWriter
from recon.stream.mcap_file import McapFile, MessageType
from recon.stream.point_cloud2 import POINT_CLOUD2, point_cloud2
from sensor.closing import Closing
from sensor.design import Gel
from sensor.toml import Pair

GEL, OBJECT = "gel", "object"
STRING = MessageType(name="std_msgs/msg/String", definition="string data\n")
MOST_POINTS = 2500
"""Of one cloud, lest a second of them outweighs a second of frames: beyond, every nth is kept."""
SKIN = np.dtype(
    [(name, "<f4") for name in ("x", "y", "z", "normal_x", "normal_y", "normal_z", "sigma")]
)
DOT = np.dtype(
    [
        *((name, "<f4") for name in ("x", "y", "z", "dx", "dy")),
        *((name, "<i4") for name in ("row", "column")),
        ("seen", "u1"),
    ]
)


class TouchFile(Closing):
    """Written as it comes; complete after every second, whatever happens to the writer."""

    def __init__(self, path: Path, gel: Gel | None = None) -> None:
        """Begin a file.

        Args:
            path: where.
            gel: the skin is laid on this gel's curve; by default it is flat.

        Raises:
            WedgeError: the file exists, cannot be written, or mcap is not installed.
        """
        self._file = McapFile(path, {})
        self._channels: dict[str, int] = {}
        self._gel = gel

    def add(self, time_ns: int, touch: Skin, pose: PoseEstimate, dots: Tracked | None) -> None:
        """Append all that one frame says.

        Args:
            time_ns: of its exposure, since the Unix epoch.
            touch: reconstructed of it.
            pose: of what touches.
            dots: of a marker gel.

        Raises:
            WedgeError: the disk is full; so for what follows.
        """
        self.add_pose(time_ns, pose)
        self.add_contact(time_ns, touch)
        if dots is not None:
            height, width = touch.contact.shape
            self.add_dots(time_ns, dots, touch.mm_per_px, (width, height))

    def add_pose(self, time_ns: int, found: PoseEstimate) -> None:
        """Append what is known of the object's pose."""
        self._add("/wedge/pose_state", STRING, time_ns, CdrWriter().text(found.words).message())
        if found.T_sensor_object is not None:
            message = tf_message(time_ns, found.T_sensor_object, GEL, OBJECT)
            self._add("/tf", TF_MESSAGE, time_ns, message)

    def add_contact(self, time_ns: int, touch: Skin) -> None:
        """Append the touched skin; a cloud of no points where nothing touches."""
        cloud = point_cloud(touch, self._gel)
        chosen = np.flatnonzero(cloud.contact)
        touched = cloud[chosen[:: max(1, -(-len(chosen) // MOST_POINTS))]]
        points = np.empty(len(touched), SKIN)
        points["x"], points["y"], points["z"] = touched.points_mm.T / MM_PER_M
        points["normal_x"], points["normal_y"], points["normal_z"] = touched.normals.T
        points["sigma"] = touched.sigma_mm / MM_PER_M
        self._add("/wedge/contact", POINT_CLOUD2, time_ns, point_cloud2(time_ns, GEL, points))

    def add_dots(
        self, time_ns: int, dots: Tracked, mm_per_px: Pair, size_px: tuple[int, int]
    ) -> None:
        """Append a marker gel's dots.

        Args:
            time_ns: of the frame.
            dots: of a frame of (width, height) ``size_px``.
            mm_per_px: of that frame.
            size_px: its centre is the origin of the gel frame.
        """
        points = np.zeros(len(dots.markers), DOT)
        x_mm, y_mm = dots.markers.rest_mm(mm_per_px, size_px).T
        below_mm, _ = rest_at(self._gel, x_mm, y_mm)
        points["x"], points["y"], points["z"] = np.stack([x_mm, y_mm, -below_mm]) / MM_PER_M
        points["dx"], points["dy"] = dots.displacement_mm(mm_per_px).T / MM_PER_M
        points["row"], points["column"] = dots.markers.cell.T
        points["seen"] = dots.seen
        self._add("/wedge/markers", POINT_CLOUD2, time_ns, point_cloud2(time_ns, GEL, points))
        word = CdrWriter().text(dots.word).message()
        self._add("/wedge/markers_state", STRING, time_ns, word)

    def close(self) -> None:
        """Finish the file."""
        self._file.close()

    def _add(self, topic: str, kind: MessageType, time_ns: int, message: bytes) -> None:
        if topic not in self._channels:
            self._channels[topic] = self._file.add_channel(topic, kind)
        self._file.add_message(self._channels[topic], message, time_ns, time_ns)
