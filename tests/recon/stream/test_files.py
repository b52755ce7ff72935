# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Whatever frames lie in, they come out alike: in order, with times, and no more than there are."""

import time
from dataclasses import replace
from pathlib import Path
from threading import Event
from typing import Any

import cv2
import numpy as np
import pytest

from recon.images import write_image
from recon.stream import Newest, Paced, Recorder, TimedFrame, files, open_source
from recon.stream.frame import Counts, FrameSource
from sensor.errors import WedgeError
from tests.recon.stream.servers import write_clip
from tests.synthetic import make_dataset


def images(count: int) -> list[np.ndarray]:
    return [np.full((24, 32, 3), 20 * i, np.uint8) for i in range(count)]


def folder_of_images(folder: Path, count: int) -> Path:
    for i, image in enumerate(images(count)):
        write_image(folder / f"frame{i + 1}.png", image)
    return folder


def recording(path: Path, count: int) -> Path:
    with Recorder(path, {"wedge": None}) as recorder:
        for i, image in enumerate(images(count)):
            times = {"time_ns": i * 33_000_000, "arrived_ns": i * 33_000_000}
            recorder.add("wedge", TimedFrame(index=i, pixels=image, **times))
    return path


KINDS = {
    "folder": lambda tmp: folder_of_images(tmp / "images", 12),
    "video": lambda tmp: write_clip(tmp / "clip.avi", 12),
    "recording": lambda tmp: recording(tmp / "touch.mcap", 12),
    "dataset": lambda tmp: make_dataset(tmp / "set", presses=11).folder,
}


@pytest.mark.parametrize("make", KINDS.values(), ids=KINDS)
def test_every_source_keeps_the_contract(make: object, tmp_path: Path) -> None:
    with open_source(make(tmp_path)) as source:
        assert isinstance(source, FrameSource)
        assert not source.live
        frames = list(source)
        assert source.counts.received == len(frames) == 12
    assert [frame.index for frame in frames] == list(range(12))
    assert np.all(np.diff([frame.time_ns for frame in frames]) > 0)
    assert {frame.image().dtype for frame in frames} == {np.dtype(np.uint8)}
    assert len({frame.image().shape for frame in frames}) == 1
    assert all(frame.latency_ms is None and frame.clock == "file" for frame in frames)


def test_images_are_taken_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    with open_source(folder_of_images(tmp_path / "images", 12)) as source:
        assert [int(frame.image()[0, 0, 0]) for frame in source] == [20 * i for i in range(12)]


def test_what_a_mac_hides_beside_pictures_is_no_frame(tmp_path: Path) -> None:
    folder = folder_of_images(tmp_path / "images", 3)
    (folder / "._frame2.png").write_bytes(b"resources")
    with open_source(folder) as source:
        assert [frame.flaw for frame in source] == [""] * 3


@pytest.mark.parametrize("labels", ["none", "no presses", "one press"])
@pytest.mark.parametrize("in_npz", [False, True])
def test_a_dataset_without_labels_gives_all_its_pictures(
    tmp_path: Path, labels: str, in_npz: bool
) -> None:
    folder = make_dataset(tmp_path, presses=12, in_npz=in_npz).folder
    table = folder / "labels.csv"
    header, first, *_ = table.read_text().splitlines(keepends=True)
    if labels == "none":
        table.unlink()
    else:
        table.write_text(header if labels == "no presses" else header + first)
    if not in_npz:
        (folder / "press02.png").rename(folder / "a2.png")  # before the blank one by its name
    with open_source(folder) as source:
        files = [frame.file for frame in source]
    if labels == "one press":
        assert files == ["background.png", first.partition(",")[0]]
    else:
        assert files[0] == "background.png" and len(set(files)) == len(files) == 13
        assert files[1] == ("frames.npz#0" if in_npz else "a2.png")
        assert files[-1] == ("frames.npz#11" if in_npz else "press11.png")


def test_an_image_that_cannot_be_read_says_why_and_ends_nothing(tmp_path: Path) -> None:
    folder = folder_of_images(tmp_path / "images", 4)
    (folder / "frame2.png").write_bytes((folder / "frame2.png").read_bytes()[:50])
    with open_source(folder) as source:
        frames = list(source)
    assert [frame.index for frame in frames] == [0, 1, 2, 3]
    assert source.counts.received == 3
    assert [bool(frame.flaw) for frame in frames] == [False, True, False, False]
    with pytest.raises(WedgeError, match=r"frame2\.png"):
        frames[1].image()
    with Newest(open_source(folder)) as newest:
        assert 1 not in [frame.index for frame in newest]


def test_a_video_that_breaks_off_says_so_and_its_decoder_nothing(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    whole = write_clip(tmp_path / "clip.avi", 30)
    cut = tmp_path / "cut.avi"
    cut.write_bytes(whole.read_bytes()[: int(0.6 * whole.stat().st_size)])
    capfd.readouterr()
    for clip in (whole, cut):
        with open_source(clip) as source:
            frames = len(list(source))
            remark = source.counts.remark
        said = f"{clip} breaks off: {frames} of the 30 frames that it names could be read."
        assert remark == ("" if clip is whole else said)
    assert 0 < frames < 30
    by_length = write_clip(tmp_path / "clip.mkv", 30)  # which names no number of frames
    by_length.write_bytes(by_length.read_bytes()[: int(0.6 * by_length.stat().st_size)])
    with open_source(by_length) as source:
        assert len(list(source)) < 30 and source.counts.remark == ""
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("count", [1, 3])
def test_a_file_plays_at_its_pace_and_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, count: int
) -> None:
    now_ns = [0]
    monkeypatch.setattr(time, "monotonic_ns", lambda: now_ns[0])
    file = recording(tmp_path / "touch.mcap", count)
    paced = Paced(open_source(file), speed=2.0, repeat=True)
    waits: list[float] = []

    class Clockwork:
        def wait(self, seconds: float) -> bool:
            now_ns[0] += round(seconds * 1e9)
            waits.append(now_ns[0] / 1e6)
            return len(waits) > 6

        def is_set(self) -> bool:
            return False

    monkeypatch.setattr(paced, "_closed", Clockwork())
    assert sum(1 for _ in paced) == 6
    round_ms = 16.5 * (count - 1) + 1e3 / 30 / 2
    due_ms = [round_ms * i + 16.5 * j for i in range(6) for j in range(count)]
    assert waits[:6] == pytest.approx(due_ms[:6])


def test_a_wrong_stamp_and_a_long_gap_hold_nothing_up(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now_ns, given_s = [0], list[float]()
    with Recorder(path := tmp_path / "touch.mcap", {"wedge": None}) as recorder:
        for index, second in enumerate((0, 1, 2_000_000_000, 2, 3, 3000, 3001)):
            times = {"time_ns": second * 10**9, "arrived_ns": second * 10**9}
            recorder.add("wedge", TimedFrame(index=index, pixels=images(1)[0], **times))
    monkeypatch.setattr(time, "monotonic_ns", lambda: now_ns[0])
    paced = Paced(open_source(path))

    class Clockwork(Event):
        def wait(self, timeout: float | None = None) -> bool:
            now_ns[0] += round((timeout or 0) * 1e9)
            return False

    monkeypatch.setattr(paced, "_closed", Clockwork())
    for _ in paced:
        given_s.append(now_ns[0] / 1e9)
    assert given_s == [0, 1, 11, 11, 12, 22, 23]


def test_a_file_can_be_watched_like_a_camera(tmp_path: Path) -> None:
    with Newest(Paced(open_source(recording(tmp_path / "touch.mcap", 5)), speed=1e6)) as newest:
        indices = [frame.index for frame in newest]
    assert indices == sorted(set(indices))
    assert indices[-1] == 4


@pytest.mark.parametrize(
    ("where", "sentence"),
    [
        ("nowhere", "does not exist: name an address"),
        ("", "has an empty name: name an address"),
        ("127.0.0.1:8080", r"begins with http://, as http://127\.0\.0\.1:8080\.$"),
        ("10.55.0.1/stream", r"begins with http://, as http://10\.55\.0\.1/stream\.$"),
        ("usb:1234", "does not exist: name an address"),
        ("empty", "holds no PNG, JPEG, BMP or TIFF images"),
        ("notes.txt", "cannot be read as frames: name an address"),
        ("bad.avi", "cannot be read as a video"),
        ("bad.mcap", "is not an MCAP file"),
        ("usb:97", r"no camera with that number; try usb:0\.$"),
    ],
)
def test_what_is_no_source_is_a_sentence(
    where: str,
    sentence: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("empty").mkdir()
    for name in ("notes.txt", "bad.avi", "bad.mcap"):
        Path(name).write_text("some words")
    with pytest.raises(WedgeError, match=sentence):
        list(open_source(where))
    assert capfd.readouterr().err == ""  # OpenCV says nothing beside it


@pytest.mark.parametrize("where", [0, None, b"clip"])
def test_what_is_no_text_is_no_source(where: Any) -> None:
    with pytest.raises(WedgeError, match=r"names no source: name a camera as usb:0"):
        open_source(where)


class Camera:
    """Of OpenCV's, whoever has it open."""

    opened = 0

    def __init__(self, _number: int) -> None:
        Camera.opened += 1
        self.is_open = True

    def isOpened(self) -> bool:  # noqa: N802, as all here
        return True

    def set(self, *_: float) -> None:
        pass

    def read(self) -> tuple[bool, np.ndarray]:
        assert self.is_open
        return True, images(1)[0]

    def release(self) -> None:
        Camera.opened -= self.is_open
        self.is_open = False


@pytest.mark.parametrize("frames", [0, 1, 3])
def test_a_camera_is_let_go_of_however_many_frames_were_taken(
    frames: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cv2, "VideoCapture", Camera)
    source = open_source("usb:0")
    for _, frame in zip(range(frames), source, strict=False):
        assert frame.image().shape == (24, 32, 3) and Camera.opened == 1
    source.close()
    assert Camera.opened == 0
    assert list(source) == [] and Camera.opened == 0


def test_a_camera_is_not_let_go_of_amid_a_read(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cv2, "VideoCapture", Camera)
    source = open_source("usb:0")
    taken = iter(source)
    next(taken)
    source.close()
    assert Camera.opened == 1  # who iterates may be reading
    assert list(taken) == [] and Camera.opened == 0


def test_a_first_camera_that_is_not_there_is_not_advised(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cv2.VideoCapture, "isOpened", lambda _: False)
    with pytest.raises(WedgeError, match="usb:0: there is no camera") as refused:
        open_source("usb:0")
    assert "try usb:0" not in str(refused.value)


@pytest.mark.parametrize("away", [0, 2])
def test_a_camera_that_is_unplugged_is_opened_again(
    away: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    tries: list[Counts] = []

    class Unplugged(Camera):
        """Gives two frames each time that it is there."""

        left = 2

        def __init__(self, number: int) -> None:
            super().__init__(number)
            if Camera.opened_once:
                tries.append(replace(source.counts))
            self.is_there = not 0 < len(tries) <= away
            Camera.opened_once = True

        def isOpened(self) -> bool:  # noqa: N802
            return self.is_there

        def read(self) -> tuple[bool, np.ndarray | None]:
            self.left -= 1
            return super().read() if self.is_there and self.left >= 0 else (False, None)

    monkeypatch.setattr(Camera, "opened_once", False, raising=False)
    monkeypatch.setattr(files, "REOPEN_AFTER_S", 0.001)
    monkeypatch.setattr(cv2, "VideoCapture", Unplugged)
    with open_source("usb:0") as source:
        taken = iter(source)
        assert [next(taken).index for _ in range(4)] == [0, 1, 2, 3]
        assert Camera.opened == 1
        assert (source.counts.connections, source.counts.lost, source.counts.remark) == (
            2,
            False,
            "",
        )
        assert len(tries) == away + 1 and all(counts.lost for counts in tries)
        assert "lost: usb:0 gives no frames any more: was it unplugged?" in tries[-1].remark
        source.close()
        assert list(taken) == [] and Camera.opened == 0 and len(tries) == away + 1


def test_a_camera_that_never_gives_a_frame_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cv2, "VideoCapture", Camera)
    monkeypatch.setattr(Camera, "read", lambda _: (False, None))
    with pytest.raises(WedgeError, match="usb:0 gives no frames: is another program using it"):
        list(open_source("usb:0"))
    assert Camera.opened == 0
