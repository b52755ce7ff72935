# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""sensor_msgs/msg/PointCloud2 of ROS 2 as bytes: what Foxglove, RViz and PCL draw alike."""

import numpy as np

from recon.stream.cdr import HEADER_DEFINITION, RULE, CdrWriter
from recon.stream.mcap_file import MessageType

POINT_CLOUD2 = MessageType(
    name="sensor_msgs/msg/PointCloud2",
    definition=f"""std_msgs/Header header
uint32 height
uint32 width
sensor_msgs/PointField[] fields
bool is_bigendian
uint32 point_step
uint32 row_step
uint8[] data
bool is_dense
{HEADER_DEFINITION}{RULE}
MSG: sensor_msgs/PointField
string name
uint32 offset
uint8 datatype
uint32 count
""",
)
DATATYPES = {np.dtype("u1"): 2, np.dtype("<i4"): 5, np.dtype("<f4"): 7}
"""sensor_msgs/PointField's numbers for them."""


def point_cloud2(time_ns: int, frame_id: str, points: np.ndarray) -> bytes:
    """One message.

    Args:
        time_ns: since the Unix epoch.
        frame_id: the frame that x, y and z, in metres, are in.
        points: a record (n,) each, of the kinds in ``DATATYPES``; must have fields x, y and z.
    """
    kinds = points.dtype
    assert kinds.names is not None and kinds.fields is not None
    out = CdrWriter().header(time_ns, frame_id).numbers("I", 1, len(points), len(kinds.names))
    for name in kinds.names:
        kind, offset = kinds.fields[name][:2]
        out.text(name).numbers("I", offset).numbers("B", DATATYPES[kind]).numbers("I", 1)
    out.numbers("B", False).numbers("I", kinds.itemsize, kinds.itemsize * len(points))
    return out.octets(points.tobytes()).numbers("B", True).message()
