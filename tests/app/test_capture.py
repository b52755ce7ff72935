# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge capture` makes a dataset folder that calibration reads."""

import math
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from app.__main__ import main
from app.capture import _followed
from recon.geometry.lens import Lens, read_lens, write_lens
from recon.images import read_image, write_image
from recon.labels.capture import PressWatcher
from recon.labels.label_book import CERTAIN, LabelBook
from recon.presses import read_presses
from recon.stream import TimedFrame
from sensor.dataset import LENS_FILE, read_dataset, write_labels
from sensor.design import STANDARD
from sensor.errors import WedgeError
from tests.app.commands import refused, run
from tests.synthetic import BALL_RADIUS_MM, KEYSTONE_PX, make_dataset, pad_size_mm
from tests.validation.importers.test_raw_frames import GAP_MM, caliper, off_pad

ROOT = Path(__file__).resolve().parents[2]


def test_a_folder_of_frames_becomes_a_dataset(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    like = make_dataset(tmp_path / "like", presses=4)
    frames = tmp_path / "frames"
    frames.mkdir()
    for index, name in enumerate(["background.png", *(x.file for x in like.labels)]):
        (frames / f"{index:02d}.png").write_bytes((like.folder / name).read_bytes())
    (frames / "99.png").write_bytes((like.folder / "background.png").read_bytes())
    (frames / "02b.png").write_bytes((frames / "02.png").read_bytes()[:99])
    write_image(frames / "02c.png", np.zeros((8, 8, 3), np.uint8))
    out = tmp_path / "out"
    words = ("capture", str(frames), "--like", str(like.folder), "--out", str(out))
    command = [sys.executable, "-P", "-m", "app", *words]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "no contact" in done.stderr
    assert "02b.png" in done.stderr and "is skipped: " in done.stderr
    assert "is skipped: the frame is 8x8 pixels" in done.stderr
    captured = read_dataset(out)
    assert len(captured.labels) == len(like.labels)
    for label, truth in zip(captured.labels, like.labels, strict=True):
        assert math.dist(label.center_px, truth.center_px) < 1.0
    assert run(*words) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_names_in_a_folder_say_what_shows_the_blank_gel_and_a_caliper(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    like = make_dataset(tmp_path / "like", presses=2)
    frames, blank = tmp_path / "frames", like.folder / "background.png"
    for name, file in [
        ("5mm-0.png", like.labels[0].file),
        ("ball-1.png", like.labels[0].file),
        ("ball-2.png", like.labels[1].file),
        ("bg-0.png", "background.png"),
    ]:
        write_image(frames / name, read_image(like.folder / file))
    words = ["--like", str(like.folder), "--presses", "2", "--out", str(tmp_path / "out")]
    assert run("capture", frames, *words) == 0
    np.testing.assert_array_equal(
        read_image(tmp_path / "out" / "background.png"), read_image(blank)
    )
    assert len(read_dataset(tmp_path / "out").labels) == 2
    told = capsys.readouterr().err
    assert "5mm-0.png is skipped: its name says that it shows a caliper" in told
    assert "ball-1.png: taken at" in told and "ball-2.png: taken at" in told
    assert "No picture is named" not in told


def test_a_folder_without_a_name_for_the_blank_gel_has_it_first_and_that_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    like = make_dataset(tmp_path / "like", presses=1)
    frames, out = tmp_path / "frames", tmp_path / "out"
    for name, file in [("5mm-0.png", "press00.png"), ("a.png", "background.png")]:
        write_image(frames / name, read_image(like.folder / file))
    write_image(frames / "b.png", read_image(like.folder / "press00.png"))
    words = ["--like", str(like.folder), "--presses", "1", "--out", str(out)]
    assert run("capture", frames, *words) == 0
    blank = read_image(like.folder / "background.png")
    np.testing.assert_array_equal(read_image(out / "background.png"), blank)
    assert "a.png is taken to show it" in capsys.readouterr().err


def test_of_several_balls_one_must_be_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    like = make_dataset(tmp_path / "like", presses=2)
    first, second = like.labels
    write_labels(like.folder / "labels.csv", [replace(first, ball_radius_mm=2.5), second])
    words = ["capture", str(tmp_path), "--like", str(like.folder), "--out", str(tmp_path / "out")]
    assert run(*words) == 2
    assert "balls of 2.5 and 4 mm radius" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_the_lens_of_the_dataset_comes_along(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], in_this_process: None
) -> None:
    like = make_dataset(tmp_path / "like", presses=2)
    height, width = read_image(like.folder / "background.png").shape[:2]
    lens = Lens(
        frame_size_px=(width, height),
        focal_px=(float(width), float(width)),
        center_px=(width / 2, height / 2),
        radial=(-0.01, 0.0, 0.0),
        rms_px=0.1,
    )
    write_lens(like.folder / LENS_FILE, lens)
    frames = tmp_path / "frames"
    frames.mkdir()
    for index, name in enumerate(["background.png", *(x.file for x in like.labels)]):
        (frames / f"{index:02d}.png").write_bytes((like.folder / name).read_bytes())
    out = tmp_path / "out"
    words = ("capture", str(frames), "--like", str(like.folder), "--out", str(out))
    words = (*words, "--presses", "1")
    assert run(*words) == 0
    assert f"1 press in {out}." in capsys.readouterr().out
    assert read_lens(out / LENS_FILE) == lens


def test_frames_of_another_size_than_the_dataset_s_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    like = make_dataset(tmp_path / "like", presses=1)
    write_image(tmp_path / "frames" / "0.png", np.zeros((60, 80, 3), np.uint8))
    words = ("--like", str(like.folder), "--out", str(tmp_path / "out"))
    said = refused(capsys, "capture", tmp_path / "frames", *words)
    height, width = read_image(like.folder / "background.png").shape[:2]
    assert "the frames are 80x60 pixels" in said and f"{width}x{height}" in said
    assert not (tmp_path / "out").exists()


def new_sensor(tmp_path: Path) -> tuple[str, ...]:
    """The words to capture three presses of a sensor whose caliper was pictured first."""
    truth = make_dataset(tmp_path / "truth", presses=3, corners_px=KEYSTONE_PX, seed=3)
    pictures = [read_image(truth.folder / "background.png"), caliper(True), caliper(False)]
    pictures += [read_image(truth.folder / label.file) for label in truth.labels]
    for index, picture in enumerate(pictures):
        dark = np.where(off_pad()[..., None], np.uint8(8), picture)
        write_image(tmp_path / "frames" / f"{index:02d}.png", dark)
    words = ("capture", str(tmp_path / "frames"), "--out", str(tmp_path / "out"), "--presses", "3")
    return (*words, "--ball-radius-mm", f"{BALL_RADIUS_MM:g}", "--caliper-mm", f"{GAP_MM:g}")


def test_a_new_sensor_is_captured_with_nothing_known_but_its_ball(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert run(*new_sensor(tmp_path)) == 0
    said = capsys.readouterr().err
    assert said.count("caliper taken") >= 1
    assert "the caliper's pictures will measure it" in said
    captured = read_dataset(out)
    assert captured.card.pad_size_mm == pytest.approx(pad_size_mm()[::-1], rel=0.03)
    assert len(captured.labels) == 3
    assert captured.card.lights_deg is not None
    assert sorted(path.name for path in (out / "caliper").iterdir()) == ["3mm-1.png", "3mm-2.png"]


def named_sensor(tmp_path: Path) -> list[str]:
    """The words to capture it by names: of the caliper's pictures the last but one is turned.

    The last one is damaged.
    """
    words, frames = list(new_sensor(tmp_path)), tmp_path / "frames"
    (frames / "00.png").rename(frames / "background.png")
    (frames / "01.png").rename(frames / "3mm-0.png")
    (frames / "3mm-1.png").write_bytes((frames / "3mm-0.png").read_bytes())
    (frames / "02.png").rename(frames / "3mm-2.png")
    (frames / "3mm-3.png").write_bytes((frames / "3mm-0.png").read_bytes()[:99])
    return words


@pytest.mark.parametrize("blank_is", ["in the folder", "apart"])
def test_all_pictures_that_are_named_as_a_caliper_s_measure_the_scale(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], in_this_process: None, blank_is: str
) -> None:
    words, blank = named_sensor(tmp_path), tmp_path / "blank.png"
    if blank_is == "apart":
        (tmp_path / "frames" / "background.png").rename(blank)
        words += ["--background", str(blank)]
    with pytest.raises(SystemExit) as left:
        main(words)
    shown = capsys.readouterr()
    assert left.value.code == 0, shown.err
    assert "Scale from 3 pictures of the caliper" in shown.out
    captured = read_dataset(tmp_path / "out")
    assert captured.card.pad_size_mm == pytest.approx(pad_size_mm()[::-1], rel=0.03)
    assert len(captured.labels) == 3


def test_a_caliper_that_is_named_for_another_gap_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = named_sensor(tmp_path)
    words[words.index("--caliper-mm") + 1] = "5"
    assert run(*words) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "3mm-0.png gives a caliper gap of 3 mm, but --caliper-mm is 5" in line
    assert not (tmp_path / "out").exists()


def test_a_folder_of_a_caliper_alone_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    like = make_dataset(tmp_path / "like", presses=1)
    blank, press = (read_image(like.folder / name) for name in ("background.png", "press00.png"))
    write_image(tmp_path / "blank.png", blank)
    write_image(tmp_path / "frames" / "5mm-0.png", press)
    words = ["--like", str(like.folder), "--background", str(tmp_path / "blank.png")]
    assert run("capture", tmp_path / "frames", *words, "--out", tmp_path / "out") == 2
    assert "holds no picture of a ball press" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_background_of_another_size_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_image(blank := tmp_path / "blank.png", np.zeros((40, 60, 3), np.uint8))
    with pytest.raises(SystemExit):
        main([*new_sensor(tmp_path), "--background", str(blank)])
    assert f"{blank}, the background, is 60x40 pixels" in capsys.readouterr().err


class Breaking:
    """A stream that is lost after its first frame and comes back for one more."""

    def __init__(self) -> None:
        self.remark = ""
        self.left = ["", None, None, "", None]

    @property
    def ended(self) -> bool:
        return not self.left

    def take(self, timeout_s: float) -> TimedFrame | None:
        words = self.left.pop(0)
        self.remark = "lost: nothing listens" if words is None and self.left else ""
        return None if words is None else TimedFrame(index=0, time_ns=0, arrived_ns=0)


def test_that_a_stream_is_lost_is_said_once() -> None:
    said: list[str] = []
    frames: list[TimedFrame] = []
    for frame in _followed(Breaking(), said.append):
        assert len(said) == len(frames)  # the first frame comes before it is lost
        frames.append(frame)
    assert len(frames) == 2 and said == ["lost: nothing listens"]


class Ending(ThreadPoolExecutor):
    """Gives the first result of several; what then comes is Ctrl-C, or nothing."""

    fault: ClassVar[BaseException | None] = None

    def map(self, *given: Any, **options: Any) -> Iterator[Any]:
        if self.fault is None:
            yield from (None for _ in given[1])
            return
        yield next(super().map(*given, **options))
        raise self.fault


@pytest.mark.parametrize(
    ("fault", "status"), [(KeyboardInterrupt(), 130), (WedgeError("A process."), 2), (None, 2)]
)
def test_what_was_taken_stays_where_its_circles_are_not_found_anew(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    fault: BaseException | None,
    status: int,
) -> None:
    monkeypatch.setattr(Ending, "fault", fault)
    monkeypatch.setattr("app._captured.process_pool", Ending)
    assert run(*new_sensor(tmp_path)) == status
    assert "The presses are kept in" in capsys.readouterr().err
    kept = read_dataset(tmp_path / "out")
    assert len(kept.labels) == 3
    assert kept.card.pad_size_mm == STANDARD.pad_size_mm
    assert len(read_presses(kept).presses) == 3


@pytest.mark.parametrize(
    ("options", "size"),
    [
        ((), (34, 25.5)),
        (("--design", "finger"), (13, 9.4)),
        (("--pad-size-mm", "9", "12"), (9, 12)),
    ],
)
def test_the_pad_is_as_large_as_said_and_that_is_told_before_the_first_press(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    in_this_process: None,
    options: tuple[str, ...],
    size: tuple[float, float],
) -> None:
    words = list(new_sensor(tmp_path))
    del words[words.index("--caliper-mm") :]
    words[words.index("--presses") + 1] = "1"
    assert run(*words, *options) == 0
    assert read_dataset(tmp_path / "out").card.pad_size_mm == size
    before, *_ = capsys.readouterr().err.partition("taken at")
    assert f"The pad is taken to be {size[0]:g} x {size[1]:g} mm" in before
    assert (f"as {options[0]} says" if options else "set it with --design") in before


@pytest.mark.parametrize("options", [("--design", "finger"), ("--pad-size-mm", "9", "12")])
def test_a_pad_s_size_beside_another_dataset_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], options: tuple[str, ...]
) -> None:
    like = make_dataset(tmp_path / "like", presses=1)
    words = ["--like", str(like.folder), "--out", str(tmp_path / "out"), *options]
    assert run("capture", like.folder, *words) == 2
    assert f"leave {options[0]} out" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_caliper_beside_another_dataset_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    like = make_dataset(tmp_path / "like", presses=1)
    words = ("--like", str(like.folder), "--caliper-mm", "5", "--out", str(tmp_path / "out"))
    said = refused(capsys, "capture", like.folder, *words)
    assert "--caliper-mm measures it again: leave one of them out" in said
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("sensor", ["known", "new", "measured by a caliper"])
def test_a_circle_that_somebody_draws_while_presses_are_taken_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, in_this_process: None, sensor: str
) -> None:
    words, out = list(new_sensor(tmp_path)), tmp_path / "out"
    if sensor != "measured by a caliper":
        del words[words.index("--caliper-mm") :]
        for picture in ("01.png", "02.png"):
            (tmp_path / "frames" / picture).unlink()
    if sensor == "known":
        words += ["--like", str(tmp_path / "truth")]
    usual = PressWatcher.judge_alone
    drawn: list[np.ndarray] = []

    def share_of_pad() -> np.ndarray:
        """Where the first press's circle lies, from 0 to 1 along both sides of the pad."""
        dataset = read_dataset(out)
        assert dataset.card.unwarped_size_px is not None
        label = dataset.labels[0]
        middle = np.array(label.center_px)
        return (middle + 0.5) / dataset.card.unwarped_size_px

    def meanwhile(watcher: PressWatcher, frame: Any) -> Any:
        if (out / "labels.csv").exists() and not drawn:
            book = LabelBook(read_dataset(out))
            (found,) = book.labels
            book.put(replace(found, center_x_px=found.center_x_px + 20, quality=CERTAIN))
            drawn.append(share_of_pad())
        return usual(watcher, frame)

    monkeypatch.setattr(PressWatcher, "judge_alone", meanwhile)
    assert run(*words) == 0
    captured = read_dataset(out)
    assert [label.file for label in captured.labels] == [f"press-00{i}.png" for i in (1, 2, 3)]
    assert [label.quality == CERTAIN for label in captured.labels] == [True, False, False]
    np.testing.assert_allclose(share_of_pad(), drawn[0], atol=1e-4)
    assert captured.card.lights_deg is not None
