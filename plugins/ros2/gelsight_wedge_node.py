#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A ROS 2 node for one sensor: its frames as they came and, with a unit, depth.

Run this file; there is nothing to build. It needs ROS 2's Python (3.11 or newer: Jazzy and later)
and ``pip install ".[live]"`` from a checkout, in an environment that sees it:

    python3 gelsight_wedge_node.py --ros-args -p source:=http://10.55.0.1:8080 -p unit:=wedge-001

Topics, under the node's name ``gelsight_wedge``:

- ``~/image_raw/compressed`` (sensor_msgs/CompressedImage): the JPEG as it came.
- ``~/depth`` (sensor_msgs/Image, 32FC1): indentation in **metres**, as ROS wants it, >= 0 where the
  gel is pressed. Only with a unit.

Parameters: ``source`` (a stream's address, ``usb:0``, a folder of images, a dataset folder, a video
or a recording; files play at their own pace), ``unit`` (a unit folder), ``frame_id``. Frames are
stamped with the time at which they were taken. Slow subscribers get the newest.
"""

import sys
import threading
from array import array
from contextlib import suppress
from typing import Any

import numpy as np

from recon.fast import FastReconstructor
from recon.stream import Newest, Paced, TimedFrame, open_source
from recon.stream.jpeg import encode_jpeg
from recon.stream.ros import FORMAT
from sensor.errors import WedgeError

WAIT_S = 0.5
M_PER_MM = 1e-3
NS_PER_S = 10**9


def main(words: list[str] | None = None) -> int:
    """Publish until ROS or the source ends; return the exit status: 0 well, 2 bad input."""
    try:
        import rclpy
        from rclpy.executors import ExternalShutdownException
        from rclpy.qos import qos_profile_sensor_data
        from sensor_msgs.msg import CompressedImage, Image
    except ImportError as error:
        print(f"{error}: first source the setup.bash of ROS 2, Jazzy or later.", file=sys.stderr)
        return 2

    rclpy.init(args=words)
    node = rclpy.create_node("gelsight_wedge")
    source = str(node.declare_parameter("source", "http://10.55.0.1:8080").value)
    unit = str(node.declare_parameter("unit", "").value)
    frame_id = str(node.declare_parameter("frame_id", "gelsight_wedge_optical_frame").value)
    frames = node.create_publisher(
        CompressedImage, "~/image_raw/compressed", qos_profile_sensor_data
    )
    depths = node.create_publisher(Image, "~/depth", qos_profile_sensor_data) if unit else None

    def answer() -> None:
        with suppress(ExternalShutdownException):  # so it ends, by Ctrl-C or with the source
            rclpy.spin(node)

    spin = threading.Thread(target=answer, daemon=True)
    spin.start()  # answers questions about parameters
    log = node.get_logger()
    remark, fits = "", False
    try:
        reconstruct = FastReconstructor.load(unit) if unit else None
        opened = open_source(source)
        with Newest(opened if opened.live else Paced(opened)) as newest:
            while rclpy.ok() and not newest.ended:
                if newest.source.counts.remark != remark:
                    remark = newest.source.counts.remark
                    log.warning(remark or "frames arrive again")
                frame = newest.take(WAIT_S)
                if frame is None:
                    continue
                frames.publish(compressed_message(CompressedImage(), frame, frame_id))
                if reconstruct is None or depths is None:
                    continue
                try:
                    depth_mm = reconstruct(frame).depth_mm
                except WedgeError as error:
                    if not fits:  # not one frame is odd, but the unit another sensor's
                        raise
                    log.warning(f"one frame gave no depth: {error}")
                    continue
                fits = True
                depths.publish(depth_message(Image(), frame, depth_mm, frame_id))
    except WedgeError as error:
        log.error(str(error))
        return 2
    except KeyboardInterrupt:  # which rclpy hands on once it has shut down
        return 0
    finally:
        rclpy.try_shutdown()
        spin.join()
    return 0


def compressed_message(message: Any, frame: TimedFrame, frame_id: str) -> Any:
    """Fill a CompressedImage with the JPEG as it came, or with one where pixels came."""
    _stamp(message, frame, frame_id)
    message.format = FORMAT
    jpeg = frame.jpeg or encode_jpeg(frame.image())
    message.data = array("B", jpeg)  # bytes would be checked one by one
    return message


def depth_message(
    message: Any, frame: TimedFrame, depth_mm: np.ndarray[Any, Any], frame_id: str
) -> Any:
    """Fill an Image with depth (h, w) in metres."""
    _stamp(message, frame, frame_id)
    message.height, message.width = depth_mm.shape
    message.encoding = "32FC1"
    message.is_bigendian = 0
    message.step = 4 * depth_mm.shape[1]
    message.data = array("B", (depth_mm * M_PER_MM).astype("<f4").tobytes())
    return message


def _stamp(message: Any, frame: TimedFrame, frame_id: str) -> None:
    seconds, nanoseconds = divmod(frame.time_ns, NS_PER_S)
    message.header.stamp.sec, message.header.stamp.nanosec = seconds, nanoseconds
    message.header.frame_id = frame_id


if __name__ == "__main__":
    sys.exit(main())
