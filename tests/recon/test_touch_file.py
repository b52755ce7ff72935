# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What was felt is read back by the tools of ROS 2, in metres, under the names that are told."""

import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from recon import touch_file
from recon.cloud import point_cloud
from recon.markers.tracking import marker_tracker
from recon.pose.estimate import PoseEstimate
from recon.pose.rest import rest_at
from recon.pose.rigid import motion
from recon.touch_file import DOT, SKIN, TouchFile
from sensor.design import STANDARD
from tests.dotted import HEIGHT, WIDTH, dotted, grid_px
from tests.recon.pose.touched import bead_pair, blank

TIME_NS = 1_234_567_890_123_456_789
KINDS = {
    "/tf": "tf2_msgs/msg/TFMessage",
    "/wedge/pose_state": "std_msgs/msg/String",
    "/wedge/contact": "sensor_msgs/msg/PointCloud2",
    "/wedge/markers": "sensor_msgs/msg/PointCloud2",
    "/wedge/markers_state": "std_msgs/msg/String",
}
AROUND = (0.3, -0.4, 0.5)
POSE = motion(np.array([*AROUND, 10.0, -20.0, 5.0]))
FOUND = PoseEstimate(state="weak", reason="why", T_sensor_object=POSE)
LOST = PoseEstimate(state="lost", reason="nothing touches")
PITCH_MM, SIZE_PX = (0.1, 0.1), (WIDTH, HEIGHT)


def dots():
    places = grid_px()
    return marker_tracker(dotted(places)).track(dotted(places + np.array([2.0, -1.0])))


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A touch with a pose on a curved marker gel, then none on a clear one."""
    path = tmp_path_factory.mktemp("felt") / "felt.mcap"
    with TouchFile(path, STANDARD.gel) as file:
        file.add_pose(TIME_NS, FOUND)
        file.add_contact(TIME_NS, bead_pair(0)[0])
        file.add_dots(TIME_NS, dots(), PITCH_MM, SIZE_PX)
        file.add(TIME_NS + 1, blank(), LOST, None)
    return path


@pytest.fixture(scope="module")
def messages(written):
    """Lists of messages by topic, deserialized by the definitions inside the file."""
    found = {topic: [] for topic in KINDS}
    with AnyReader([written]) as reader:
        for connection, stamp, raw in reader.messages():
            found[connection.topic].append((stamp, reader.deserialize(raw, connection.msgtype)))
    return found


def records(message, kinds):
    """The points, read by the fields that the message names."""
    numpy_kinds = {2: "u1", 5: "<i4", 7: "<f4"}
    told = np.dtype(
        {
            "names": [field.name for field in message.fields],
            "formats": [numpy_kinds[field.datatype] for field in message.fields],
            "offsets": [field.offset for field in message.fields],
            "itemsize": message.point_step,
        }
    )
    assert told == kinds and message.row_step == message.width * message.point_step
    assert (message.height, message.is_bigendian, message.is_dense) == (1, False, True)
    assert message.header.frame_id == "gel"
    return np.frombuffer(message.data.tobytes(), told)


def test_every_channel_has_the_schema_of_its_message(written):
    with written.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        count = sum(1 for _ in reader.iter_messages())
    schemas = {
        channel.topic: summary.schemas[channel.schema_id] for channel in summary.channels.values()
    }
    assert {topic: schema.name for topic, schema in schemas.items()} == KINDS
    assert {schema.encoding for schema in schemas.values()} == {"ros2msg"}
    assert count == summary.statistics.message_count == 7
    assert summary.statistics.schema_count == len(summary.schemas) == 3


def test_messages_are_what_ros_itself_writes(messages):
    ros = get_typestore(Stores.ROS2_HUMBLE)
    for topic, kind in KINDS.items():
        for _, message in messages[topic]:
            again = ros.deserialize_cdr(ros.serialize_cdr(message, kind), kind)
            assert type(again).__name__ == type(message).__name__


def test_a_pose_is_a_transform_in_metres_and_a_lost_one_a_word_alone(messages):
    ((stamp, transforms),) = messages["/tf"]
    (found,) = transforms.transforms
    assert stamp == TIME_NS
    assert found.header.stamp.sec * 10**9 + found.header.stamp.nanosec == TIME_NS
    assert (found.header.frame_id, found.child_frame_id) == ("gel", "object")
    shift, turn = found.transform.translation, found.transform.rotation
    np.testing.assert_allclose([shift.x, shift.y, shift.z], POSE[:3, 3] / 1000)
    angle = np.linalg.norm(AROUND)
    wanted = [*(np.sin(angle / 2) * np.array(AROUND) / angle), np.cos(angle / 2)]
    np.testing.assert_allclose([turn.x, turn.y, turn.z, turn.w], wanted, atol=1e-12)
    words = [message.data for _, message in messages["/wedge/pose_state"]]
    assert words == ["weak: why", "lost: nothing touches"]


def test_the_contact_is_a_cloud_in_metres(messages):
    cloud = point_cloud(bead_pair(0)[0], STANDARD.gel)
    cloud = cloud[cloud.contact]
    (_, first), (_, second) = messages["/wedge/contact"]
    points = records(first, SKIN)
    for axis, name in enumerate("xyz"):
        np.testing.assert_allclose(points[name], cloud.points_mm[:, axis] / 1e3, rtol=1e-6)
        np.testing.assert_allclose(points[f"normal_{name}"], cloud.normals[:, axis])
    np.testing.assert_allclose(points["sigma"], cloud.sigma_mm / 1e3, rtol=1e-6)
    assert len(records(second, SKIN)) == 0


def test_of_many_points_every_nth_is_kept(tmp_path, monkeypatch):
    monkeypatch.setattr(touch_file, "MOST_POINTS", 700)
    with TouchFile(tmp_path / "felt.mcap") as file:
        file.add_contact(TIME_NS, bead_pair(0)[0])
    with AnyReader([tmp_path / "felt.mcap"]) as reader:
        ((connection, _, raw),) = reader.messages()
        points = records(reader.deserialize(raw, connection.msgtype), SKIN)
    cloud = point_cloud(bead_pair(0)[0])
    kept = cloud.points_mm[cloud.contact][:: -(-cloud.contact.sum() // 700)]
    assert 350 < len(points) <= 700
    np.testing.assert_allclose(points["z"], kept[:, 2] / 1e3, rtol=1e-6)


def test_dots_come_with_their_shifts_and_who_they_are(messages):
    ((_, message),) = messages["/wedge/markers"]
    points, truth = records(message, DOT), dots()
    rest_mm = (truth.markers.position_px - [(WIDTH - 1) / 2, (HEIGHT - 1) / 2]) * PITCH_MM
    np.testing.assert_allclose(np.stack([points["x"], points["y"]], 1), rest_mm / 1e3, rtol=1e-5)
    below_mm, _ = rest_at(STANDARD.gel, *rest_mm.T)
    assert below_mm.max() > 0.1  # the middle of the frame is that of the pad
    np.testing.assert_allclose(points["z"], -below_mm / 1e3, rtol=1e-5)
    shift_mm = 1e3 * np.stack([points["dx"], points["dy"]], 1)[points["seen"] == 1]
    np.testing.assert_allclose(np.median(shift_mm, axis=0), (0.2, -0.1), atol=0.01)
    cells = np.stack([points["row"], points["column"]], 1)
    np.testing.assert_array_equal(cells, truth.markers.cell)
    assert [m.data for _, m in messages["/wedge/markers_state"]] == ["tracked"]
