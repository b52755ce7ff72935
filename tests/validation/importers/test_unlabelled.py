# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Sources without labels: marker gels as they are, clips as frames freed from their mirror."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from recon.images import read_image
from recon.presses import dataset_unwarp, read_background, read_presses
from sensor.dataset import read_dataset
from sensor.errors import WedgeError
from validation.datasets import DATASETS, dataset_folder
from validation.importers.marker_balls import import_marker_balls
from validation.importers.wedge_mit import CLIPS, EVERY, import_wedge_mit

CLIP = replace(CLIPS[0], name="toy-clip", path="day/toy")
FRAMES = 12
CORNERS = {
    "topleft": (20, 20),
    "topright": (140, 30),
    "bottomleft": (20, 100),
    "bottomright": (140, 90),
}


def raw_frame(index: int) -> np.ndarray:
    """RGB: green at the raw left, red below, blue above, brighter with every frame."""
    frame = np.zeros((120, 160, 3), np.uint8)
    frame[:, :50, 1] = 200
    frame[70:, 50:, 0] = 200
    frame[:50, 50:, 2] = 200
    return frame + np.uint8(4 * index)


def make_wedge_mit(source: Path, frames: int = FRAMES) -> None:
    (source / "day").mkdir(parents=True)
    writer = cv2.VideoWriter(
        str(source / "day" / "toy.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 30, (160, 120)
    )
    for index in range(frames):
        writer.write(raw_frame(index)[..., ::-1])
    writer.release()
    rows = "".join(f"{index},{index / 10}\n" for index in range(FRAMES))
    (source / "day" / "toy_force_width.csv").write_text(f"frame,force_N\n{rows}")
    (source / "config").mkdir()
    corners = "\n".join(f"{name},{x},{y}" for name, (x, y) in CORNERS.items())
    (source / "config" / "config_100.csv").write_text(f"Name,x,y\n{corners}")


def make_marker_balls(source: Path) -> None:
    source.mkdir()
    for name in ("ref", "sample_4", "sample_40", "reconstruct_1"):
        (source / f"{name}.jpg").write_bytes(name.encode())
    (source / "notes.txt").write_text("not a frame")


def test_every_fifth_frame_keeps_its_number_and_colours(tmp_path: Path) -> None:
    make_wedge_mit(tmp_path / "source")
    import_wedge_mit(CLIP, tmp_path / "source", tmp_path / "set")
    dataset = read_dataset(tmp_path / "set")
    names = sorted(path.name for path in dataset.folder.glob("*.png"))
    assert names == [f"frame-{index:03d}.png" for index in range(0, FRAMES, EVERY)]
    assert dataset.card.background == (names[0],)
    for index, name in zip(range(0, FRAMES, EVERY), names, strict=True):
        error = read_image(dataset.folder / name).astype(float) - raw_frame(index)
        assert abs(np.median(error)) < 2  # one frame further is brighter by 4
        assert np.abs(error).mean() < 8
    force = dataset.folder / "force.csv"
    assert force.read_bytes() == (tmp_path / "source/day/toy_force_width.csv").read_bytes()


def test_the_mirror_is_undone(tmp_path: Path) -> None:
    make_wedge_mit(tmp_path / "source")
    import_wedge_mit(CLIP, tmp_path / "source", tmp_path / "set")
    dataset = read_dataset(tmp_path / "set")
    blank = read_background(dataset)
    pad = dataset_unwarp(dataset, blank, None)(blank)
    height, width = pad.shape[:2]
    assert (width, height) == (350, 255)
    assert pad[height // 2, width // 20].argmax() == 1  # green: the base, at the left
    assert pad[height // 10, width * 3 // 4].argmax() == 0  # red: above
    assert pad[height * 9 // 10, width * 3 // 4].argmax() == 2  # blue: below


def test_marker_frames_are_copied_byte_for_byte(tmp_path: Path) -> None:
    make_marker_balls(tmp_path / "unit-b")
    import_marker_balls("marker-balls-b", tmp_path / "unit-b", tmp_path / "set")
    dataset = read_dataset(tmp_path / "set")
    assert dataset.card.background == ("ref.jpg",)
    frames = {path.stem: path.read_bytes() for path in dataset.folder.glob("*.jpg")}
    assert frames == {x: x.encode() for x in ("ref", "sample_4", "sample_40", "reconstruct_1")}
    assert all(radius in dataset.card.source for radius in ("unit-b", "2.38", "3.8", "0.10577"))


def test_a_set_without_labels_is_refused_by_what_learns_from_presses(tmp_path: Path) -> None:
    make_wedge_mit(tmp_path / "source")
    import_wedge_mit(CLIP, tmp_path / "source", tmp_path / "set")
    with pytest.raises(WedgeError, match=r"no press .*\(0 labelled\)"):
        read_presses(read_dataset(tmp_path / "set"))


@pytest.mark.parametrize(
    "lost", ["day/toy.avi", "day/toy_force_width.csv", "config/config_100.csv"]
)
@pytest.mark.parametrize("damage", [None, b"", b"RIFF no clip"])
def test_a_missing_or_damaged_part_of_a_clip_is_named(
    lost: str, damage: bytes | None, tmp_path: Path
) -> None:
    make_wedge_mit(tmp_path / "source")
    (tmp_path / "source" / lost).unlink()
    if damage is not None:
        (tmp_path / "source" / lost).write_bytes(damage)
    (tmp_path / "set").mkdir()
    with pytest.raises(WedgeError, match=Path(lost).name):
        import_wedge_mit(CLIP, tmp_path / "source", tmp_path / "set")


@pytest.mark.parametrize("content", [b"", b"RIFF no clip"])
def test_a_clip_without_a_frame_is_refused(content: bytes, tmp_path: Path) -> None:
    make_wedge_mit(tmp_path / "source")
    (tmp_path / "source" / "day" / "toy.avi").write_bytes(content)
    (tmp_path / "set").mkdir()
    with pytest.raises(WedgeError, match=r"toy\.avi cannot be decoded: it yields no frame"):
        import_wedge_mit(CLIP, tmp_path / "source", tmp_path / "set")


def test_a_clip_cut_short_is_refused(tmp_path: Path) -> None:
    make_wedge_mit(tmp_path / "source", frames=FRAMES - 1)
    (tmp_path / "set").mkdir()
    with pytest.raises(WedgeError, match=rf"toy\.avi has {FRAMES - 1} frames .* has {FRAMES} rows"):
        import_wedge_mit(CLIP, tmp_path / "source", tmp_path / "set")


@pytest.mark.parametrize("corners", ["Name,x,y\ntopleft,1,2\n", "Name,x,y\ntopleft,1\n", "x\n1\n"])
def test_unreadable_corners_are_named(corners: str, tmp_path: Path) -> None:
    make_wedge_mit(tmp_path / "source")
    (tmp_path / "source" / "config" / "config_100.csv").write_text(corners)
    (tmp_path / "set").mkdir()
    with pytest.raises(WedgeError, match=r"config_100\.csv must hold"):
        import_wedge_mit(CLIP, tmp_path / "source", tmp_path / "set")


@pytest.mark.parametrize("lost", ["ref.jpg", "sample_*.jpg"])
def test_a_marker_unit_without_background_or_presses_is_refused(lost: str, tmp_path: Path) -> None:
    source = tmp_path / "unit-a"
    make_marker_balls(source)
    for path in source.glob(lost):
        path.unlink()
    (tmp_path / "set").mkdir()
    with pytest.raises(WedgeError, match=lost.replace("*", r"\*")):
        import_marker_balls("marker-balls-a", source, tmp_path / "set")


@pytest.mark.parametrize(
    ("name", "pressed"),
    [("wedge-mit-sphere", "frame-040.png"), ("wedge-mit-eraser", "frame-020.png")],
)
def test_a_real_bulge_is_green_toward_the_base_and_red_above(
    name: str, pressed: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    known = next(known for known in DATASETS if known.name == name)
    if known.find() is None:
        pytest.skip(f"{known.name} is absent: {known.sought}")
    monkeypatch.setenv("WEDGE_CACHE", str(tmp_path))
    dataset = read_dataset(dataset_folder(name))
    blank = read_background(dataset)
    unwarp = dataset_unwarp(dataset, blank, None)
    change = unwarp(read_image(dataset.folder / pressed)) - unwarp(blank)
    middle = change[40:210, 60:260]  # the pad's edges change too
    tint = np.maximum(middle - middle.mean(2, keepdims=True), 0)
    y, x = np.indices(tint.shape[:2])
    (red_x, red_y), (green_x, _), (blue_x, blue_y) = (
        ((x * part).sum() / part.sum(), (y * part).sum() / part.sum())
        for part in np.moveaxis(tint, -1, 0)
    )
    assert green_x < min(red_x, blue_x) - 10
    assert red_y < blue_y - 10
