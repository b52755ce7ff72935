# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A pose as tf2_msgs/msg/TFMessage of ROS 2."""

from scipy.spatial.transform import Rotation

from recon.pose.rigid import Transform
from recon.stream.cdr import HEADER_DEFINITION, RULE, CdrWriter
from recon.stream.mcap_file import MessageType

TF_MESSAGE = MessageType(
    name="tf2_msgs/msg/TFMessage",
    definition=f"""geometry_msgs/TransformStamped[] transforms
{RULE}
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
{HEADER_DEFINITION}{RULE}
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
{RULE}
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
{RULE}
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
""",
)
MM_PER_M = 1000.0


def tf_message(time_ns: int, pose: Transform, parent: str, child: str) -> bytes:
    """One transform (mm) from the child's to the parent's frame, in metres."""
    out = CdrWriter().numbers("I", 1).header(time_ns, parent).text(child)
    rotation = Rotation.from_matrix(pose[:3, :3]).as_quat()
    return out.numbers("d", *(pose[:3, 3] / MM_PER_M), *rotation).message()
