# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Recordings open in the tools that others use, whenever the recorder was killed."""

import errno
import os
import resource
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from subprocess import PIPE

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from recon.stream import McapSource, Recorder, TimedFrame, keeper
from recon.stream.frame import Clock
from recon.stream.mcap_file import McapFile, MessageType
from recon.stream.outliving import OutlivingFile
from recon.stream.ros import COMPRESSED_IMAGE, FORMAT, CompressedImage
from sensor.errors import WedgeError
from tests.recon.stream.servers import FRAMES
from tests.synthetic import make_dataset
from tests.written import write_anew

TYPES = get_typestore(Stores.ROS2_HUMBLE)
STEP_NS = 16_666_667
START_NS = 1_700_000_000_123_456_789
ROOT = Path(__file__).resolve().parents[3]


def frame(index: int) -> TimedFrame:
    time_ns = START_NS + index * STEP_NS
    jpeg = FRAMES[index % len(FRAMES)]
    return TimedFrame(index=index, time_ns=time_ns, arrived_ns=time_ns + 5_000_000, jpeg=jpeg)


def record(path: Path, count: int, units: dict | None = None) -> Path:
    units = units or {"wedge": None}
    with Recorder(path, units) as recorder:
        for index in range(count):
            for sensor in units:
                recorder.add(sensor, frame(index))
    return path


def test_a_recording_knows_whether_its_frames_have_times(tmp_path: Path) -> None:
    with Recorder(tmp_path / "a.mcap", {"one": None, "other": None}, ["other"]) as recorder:
        for sensor in ("one", "other"):
            recorder.add(sensor, frame(0))
    assert McapSource(tmp_path / "a.mcap", "one").timed and McapSource(tmp_path / "a.mcap").timed
    assert not McapSource(tmp_path / "a.mcap", "other").timed
    assert len(read_with_mcap(tmp_path / "a.mcap")) == len(read_with_rosbags(tmp_path / "a.mcap"))


@pytest.mark.parametrize("clock", ["sensor", "mapped", "arrival"])
def test_whose_clock_it_was_is_not_claimed_of_a_recording(tmp_path: Path, clock: Clock) -> None:
    with Recorder(tmp_path / "a.mcap", {"wedge": None}) as recorder:
        recorder.add("wedge", replace(frame(0), clock=clock))
    (again,) = McapSource(tmp_path / "a.mcap")
    assert (again.time_ns, again.arrived_ns) == (frame(0).time_ns, frame(0).arrived_ns)
    assert (again.clock, again.latency_ms) == ("file", None)


def read_with_mcap(path: Path) -> list[tuple[str, int, bytes]]:
    with path.open("rb") as stream:
        messages = make_reader(stream, validate_crcs=True).iter_messages()
        return [(channel.topic, m.publish_time, m.data) for _, channel, m in messages]


def read_with_rosbags(path: Path) -> list:
    with AnyReader([path], default_typestore=TYPES) as reader:
        return [reader.deserialize(raw, c.msgtype) for c, _, raw in reader.messages()]


def test_other_tools_read_every_frame(tmp_path: Path) -> None:
    path = record(tmp_path / "touch.mcap", 150, {"left": None, "right": None})
    messages = read_with_mcap(path)
    assert len(messages) == 300
    assert {topic for topic, *_ in messages} == {
        "/left/image_raw/compressed",
        "/right/image_raw/compressed",
    }
    images = read_with_rosbags(path)
    assert len(images) == 300
    for index, image in enumerate(images[::2]):
        stamp = image.header.stamp
        assert stamp.sec * 10**9 + stamp.nanosec == START_NS + index * STEP_NS
        assert bytes(image.data) == FRAMES[index % len(FRAMES)]
        assert image.format == "bgr8; jpeg compressed bgr8"
        assert image.header.frame_id in ("left_optical_frame", "right_optical_frame")


def test_a_recording_comes_back_as_it_went_in(tmp_path: Path) -> None:
    path = record(tmp_path / "touch.mcap", 70, {"left": None, "right": None})
    for source in (McapSource(path), McapSource(path, "right")):
        frames = list(source)
        assert [f.jpeg for f in frames] == [frame(i).jpeg for i in range(70)]
        assert [f.time_ns for f in frames] == [frame(i).time_ns for i in range(70)]
    with McapSource(path) as first, McapSource(path, "/right/image_raw/compressed") as named:
        assert "also holds /right/image_raw/compressed: " in first.counts.remark
        assert named.counts.remark == "" and len(list(named)) == 70
    inside = "/left/image_raw/compressed, /right/image_raw/compressed"
    with pytest.raises(WedgeError, match=f"has no images of middle, but {inside}"):
        McapSource(path, "middle")
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 95 // 100])
    with pytest.raises(WedgeError, match=f"but {inside}"):
        McapSource(path, "middle")


def test_others_messages_are_told_from_images_and_their_images_from_jpegs(tmp_path: Path) -> None:
    cloud = MessageType(name="point_cloud_interfaces/msg/CompressedPointCloud2", definition="")
    file = McapFile(tmp_path / "robot.mcap", {})
    lidar = file.add_channel("/lidar/points/compressed", cloud)
    camera = file.add_channel("/robot/left/image/compressed", COMPRESSED_IMAGE)
    pictures = [b"\x89PNG\r\n\x1a\n", FRAMES[0]]
    for index, data in enumerate(pictures):
        file.add_message(lidar, b"\0\1\0\0", index, index)
        image = CompressedImage(time_ns=index, frame_id="", format="png", data=data)
        file.add_message(camera, image.to_cdr(), index, index)
    file.close()
    for sensor in (None, "/robot/left/image/compressed"):
        source = McapSource(tmp_path / "robot.mcap", sensor)
        assert [frame.jpeg for frame in source] == FRAMES[:1]
        assert (source.counts.received, source.counts.corrupt) == (1, 1)
        assert "images in png; only JPEGs are read" in source.counts.remark


def test_a_clip_that_is_read_in_no_time_plays_at_its_pace(tmp_path: Path) -> None:
    path = tmp_path / "clip.mcap"
    with Recorder(path, {"wedge": None}, ["wedge"]) as recorder:
        for index in range(5):
            recorder.add("wedge", replace(frame(index), time_ns=index * STEP_NS, arrived_ns=7))
    with path.open("rb") as stream:
        logged_ns = [m.log_time for _, _, m in make_reader(stream).iter_messages()]
    assert np.diff(logged_ns).tolist() == [STEP_NS] * 4
    assert [f.arrived_ns for f in McapSource(path)] == logged_ns


def test_only_what_is_on_the_disk_is_counted_as_kept(tmp_path: Path) -> None:
    with Recorder(tmp_path / "touch.mcap", {"left": None, "right": None}) as recorder:
        for index in range(3):
            recorder.add("left", frame(index))
        recorder.add("right", frame(3))
        assert (recorder.frames, recorder.kept("left"), recorder.kept("right")) == (4, 0, 0)
    assert (recorder.kept("left"), recorder.kept("right")) == (3, 1)


def test_the_index_knows_the_ends_of_the_times_also_where_a_clock_is_set_back(tmp_path) -> None:
    unit = make_dataset(tmp_path / "unit").folder
    (unit / "unit.toml").write_text("serial = 7")
    times_ns = [10**18 + round(s * 1e9) for s in (5.5, 5.3, 5.9, 5.0, 9.4, 9.1, 9.3, 0.2, 0.0, 0.1)]
    with Recorder(tmp_path / "touch.mcap", {"wedge": unit}) as recorder:
        for arrived_ns in times_ns:
            recorder.add("wedge", replace(frame(0), arrived_ns=arrived_ns))
    with (tmp_path / "touch.mcap").open("rb") as stream:
        index = make_reader(stream).get_summary()
        attached = [item.name for item in make_reader(stream).iter_attachments()]
    starts_ns, ends_ns = zip(
        *((c.message_start_time, c.message_end_time) for c in index.chunk_indexes), strict=True
    )
    told = index.statistics
    assert told.message_start_time == min(starts_ns) == min(times_ns)
    assert told.message_end_time == max(ends_ns) == max(times_ns)
    assert all(end - start <= 10**9 for start, end in zip(starts_ns, ends_ns, strict=True))
    assert told.attachment_count == len(attached) and "wedge/unit.toml" in attached
    for chunk, following in pairwise(index.chunk_indexes):  # nothing lies between them
        end = chunk.chunk_start_offset + chunk.chunk_length + chunk.message_index_length
        assert end == following.chunk_start_offset


def test_each_channel_has_the_schema_of_its_messages(tmp_path: Path) -> None:
    text = MessageType(name="std_msgs/msg/String", definition="string data")
    kinds = {"/a": COMPRESSED_IMAGE, "/b": text, "/c": COMPRESSED_IMAGE}
    file = McapFile(tmp_path / "touch.mcap", {})
    for topic, kind in kinds.items():
        file.add_channel(topic, kind)
    file.close()
    with (tmp_path / "touch.mcap").open("rb") as stream:
        index = make_reader(stream).get_summary()
    told = {item.topic: index.schemas[item.schema_id].name for item in index.channels.values()}
    assert told == {topic: kind.name for topic, kind in kinds.items()}


def test_frames_that_were_no_jpegs_lose_next_to_nothing(tmp_path: Path) -> None:
    noisy = np.random.default_rng(0).normal(100, 10, (64, 64, 3)).round().astype(np.uint8)
    with Recorder(tmp_path / "touch.mcap", {"wedge": None}) as recorder:
        recorder.add("wedge", replace(frame(0), jpeg=None, pixels=noisy))
    (found,) = McapSource(tmp_path / "touch.mcap")
    assert (found.image().astype(float) - noisy).std() < 0.5 * noisy.std()


def test_the_unit_travels_inside(tmp_path: Path) -> None:
    unit = make_dataset(tmp_path / "unit").folder  # any files will do
    (unit / "unit.toml").write_text("serial = 7")
    (unit / "gradients.safetensors").write_bytes(bytes(range(256)))
    path = record(tmp_path / "touch.mcap", 3, {"wedge": unit})
    source = McapSource(path)
    assert sorted(source.unit) == ["background.png", "gradients.safetensors", "unit.toml"]
    (tmp_path / "again").mkdir()
    again = source.save_unit(tmp_path / "again")
    assert all((again / name).read_bytes() == (unit / name).read_bytes() for name in source.unit)
    assert McapSource(record(tmp_path / "bare.mcap", 1)).save_unit(tmp_path) is None


RECORD_FOREVER = """
import sys
from pathlib import Path
from recon.stream import Recorder
from tests.recon.stream.test_recording import frame
with Recorder(Path(sys.argv[1]), {"wedge": None}) as recorder:
    print("begun", flush=True)
    index = 0
    while True:
        recorder.add("wedge", frame(index))
        index += 1
"""


def test_a_kill_at_any_moment_leaves_a_file_that_opens(tmp_path: Path) -> None:
    for attempt, wait in enumerate((0.0, 0.07, 0.2)):
        path = tmp_path / f"{attempt}.mcap"
        command = [sys.executable, "-c", RECORD_FOREVER, str(path)]
        with subprocess.Popen(command, cwd=ROOT, stdout=PIPE, stderr=PIPE) as process:
            assert process.stdout.readline() == b"begun\n"
            try:
                process.wait(wait)
            except subprocess.TimeoutExpired:
                process.send_signal(signal.SIGKILL)
            # It ends when the writer that outlives it has ended, which has nothing to say.
            assert process.stderr.read() == b""
        messages = read_with_mcap(path)
        assert [t for _, t, _ in messages] == [frame(i).time_ns for i in range(len(messages))]
        assert len(read_with_rosbags(path)) == len(messages)
        if messages:
            assert len(list(McapSource(path))) == len(messages)


def test_at_every_length_that_a_write_can_leave_what_is_whole_is_read(tmp_path: Path) -> None:
    whole = record(tmp_path / "touch.mcap", 200).read_bytes()
    cut = tmp_path / "cut.mcap"
    counts = []
    for length in range(2000, len(whole), 40_007):
        write_anew(cut, whole[:length])
        try:
            source = McapSource(cut)
        except WedgeError as error:
            assert "broke off or is damaged before its first frame" in str(error)
            continue
        times = [f.time_ns for f in source]
        assert times == [frame(i).time_ns for i in range(len(times))]
        assert "broke off" in source.counts.remark
        counts.append(len(times))
    assert counts == sorted(counts)
    assert counts[-1] >= 120


@contextmanager
def files_of_at_most(size: int) -> Iterator[None]:
    """A disk that is full beyond so many bytes."""
    kept = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, kept[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, kept)


def test_a_full_disk_is_a_sentence_and_costs_no_more_than_the_last_second(tmp_path: Path) -> None:
    path = tmp_path / "touch.mcap"
    with files_of_at_most(700_000):
        recorder = Recorder(path, {"wedge": None})
        with pytest.raises(WedgeError, match="cannot be written: File too large"):
            for index in range(2000):
                recorder.add("wedge", frame(index))
        with pytest.raises(WedgeError, match="cannot be written: File too large"):
            recorder.close()
    messages = read_with_mcap(path)
    assert len(messages) == len(read_with_rosbags(path)) > 100
    assert [t for _, t, _ in messages] == [frame(i).time_ns for i in range(len(messages))]


@pytest.mark.parametrize("chunks", [0, 2])
def test_what_a_full_disk_refused_is_written_where_there_is_room_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, chunks: int
) -> None:
    def full(_file: OutlivingFile, *_pieces: keeper.Piece) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    path, kept, refused = tmp_path / "touch.mcap", [], []
    with Recorder(path, {"wedge": None}) as recorder:
        for index in range(60 * chunks + 150):  # a chunk has 60
            with monkeypatch.context() as patch:
                if 30 <= index - 60 * chunks < 70:
                    patch.setattr(OutlivingFile, "put", full)
                try:
                    recorder.add("wedge", frame(index))
                    kept.append(frame(index).time_ns)
                except WedgeError:
                    refused.append(index)
    assert len(refused) == 10
    messages = read_with_mcap(path)
    assert [t for _, t, _ in messages] == kept
    with path.open("rb") as stream:
        statistics = make_reader(stream).get_summary().statistics
    assert statistics.message_count == len(messages) == len(read_with_rosbags(path))
    assert statistics.message_start_time == frame(0).arrived_ns


def test_a_disk_that_is_full_at_the_start_is_left_without_a_file(tmp_path: Path) -> None:
    path = tmp_path / "touch.mcap"
    with files_of_at_most(0):
        with pytest.raises(WedgeError, match=r"touch\.mcap cannot be written: File too large"):
            Recorder(path, {"wedge": None})
    assert not path.exists()


def test_a_disk_that_turns_out_full_as_the_file_is_finished_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_file: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    path = tmp_path / "touch.mcap"
    recorder = Recorder(path, {"wedge": None})
    recorder.add("wedge", frame(0))
    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(WedgeError, match=r"touch\.mcap cannot be written: No space left"):
            recorder.close()
    recorder.close()  # again, as at the end of a block
    assert len(read_with_mcap(path)) == 1


def test_no_recording_is_written_over(tmp_path: Path) -> None:
    path = record(tmp_path / "touch.mcap", 3)
    before = path.read_bytes()
    with pytest.raises(WedgeError, match="exists: name a new file"):
        Recorder(path, {"wedge": None})
    assert path.read_bytes() == before
    with pytest.raises(WedgeError, match="cannot name a sensor"):
        Recorder(tmp_path / "other.mcap", {"a/b": None})
    with pytest.raises(WedgeError, match="not a unit folder"):
        Recorder(tmp_path / "other.mcap", {"wedge": tmp_path})
    assert not (tmp_path / "other.mcap").exists()


@given(
    time_ns=st.integers(0, (2**31 - 1) * 10**9),
    frame_id=st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=9),
    data=st.binary(max_size=50),
)
def test_messages_survive_their_coding(time_ns: int, frame_id: str, data: bytes) -> None:
    image = CompressedImage(time_ns=time_ns, frame_id=frame_id, format=FORMAT, data=data)
    assert CompressedImage.from_cdr(image.to_cdr()) == image
    theirs = TYPES.deserialize_cdr(image.to_cdr(), "sensor_msgs/msg/CompressedImage")
    assert (theirs.header.frame_id, bytes(theirs.data)) == (frame_id, data)
    assert bytes(TYPES.serialize_cdr(theirs, "sensor_msgs/msg/CompressedImage")) == image.to_cdr()


@given(st.binary(max_size=99))
def test_half_a_message_is_refused_and_bytes_are_one_or_refused(data: bytes) -> None:
    whole = CompressedImage(time_ns=1, frame_id="a", format="b", data=data).to_cdr()
    with pytest.raises(ValueError):
        CompressedImage.from_cdr(whole[: len(whole) // 2])
    with suppress(ValueError):
        CompressedImage.from_cdr(data)
