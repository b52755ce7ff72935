# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Taxim's data pack gives the frames that were put into it, or a sentence and nothing."""

import struct
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from recon.images import read_frame, read_image
from sensor.dataset import Dataset
from sensor.errors import WedgeError
from tests.synthetic import MM_PER_PX, make_dataset
from tests.validation.importers.packs import write_taxim
from validation.importers.calibrations import find_calibration, import_calibration
from validation.importers.taxim import import_taxim


def import_pack(path: Path) -> None:
    import_taxim(path, path.parents[1] / "set")


READERS = pytest.mark.parametrize("read", [find_calibration, import_pack])


@pytest.fixture(scope="module")
def truth(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return make_dataset(tmp_path_factory.mktemp("truth") / "set", presses=5)


def frames_of(truth: Dataset) -> np.ndarray:
    """As they are in a pack, BGR."""
    return np.stack([read_image(truth.folder / label.file)[..., ::-1] for label in truth.labels])


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.int64, np.float32, np.float64])
def test_frames_of_any_kind_of_number_come_back_as_they_were(
    kind: type, truth: Dataset, tmp_path: Path
) -> None:
    frames = frames_of(truth)
    if np.issubdtype(kind, np.floating):
        frames = np.clip(frames - 0.4, 0, 255)  # to be rounded
    source = write_taxim(truth, tmp_path / "source", imgs=frames.astype(kind))
    found = find_calibration(source)
    assert found is not None
    folder = tmp_path / "out"
    folder.mkdir()
    import_calibration(found, source, folder, mm_per_px=MM_PER_PX[0], ball_radius_mm=4.0)
    for index, label in enumerate(truth.labels):
        frame = read_frame(folder, f"frames.npz#{index}")
        np.testing.assert_array_equal(frame, read_image(truth.folder / label.file))


SPOILT: dict[str, Callable[[np.ndarray], dict[str, np.ndarray]]] = {
    "objects": lambda _: {"f0": np.array([{}], dtype=object)},
    "no circle": lambda _: {"touch_radius": np.full(5, np.nan)},
    "a circle too few": lambda _: {"touch_radius": np.full(4, 12.0)},
    "one colour": lambda imgs: {"imgs": imgs[..., 0]},
    "no frames": lambda imgs: {
        "imgs": imgs[:0],
        "touch_center": np.zeros((0, 2)),
        "touch_radius": np.zeros(0),
    },
    "no pixels": lambda imgs: {"imgs": imgs[:, :0, :0], "f0": imgs[0, :0, :0]},
    "floats above 255": lambda imgs: {"imgs": imgs * 3.0},
    "floats below 0": lambda imgs: {"imgs": imgs - 100.0},
    "NaN": lambda imgs: {"imgs": np.where(imgs == imgs[0, 0, 0, 0], np.nan, imgs)},
    "infinite": lambda imgs: {"imgs": np.where(imgs == imgs[0, 0, 0, 0], np.inf, imgs)},
    "floats of at most 1": lambda imgs: {"imgs": imgs / 255},
    "a background of at most 1": lambda imgs: {"f0": imgs[0] / 255},
    "16 bits": lambda imgs: {"imgs": imgs.astype(np.uint16) * 257},
    "integers below 0": lambda imgs: {"imgs": imgs.astype(np.int16) - 100},
}


@READERS
@pytest.mark.parametrize("spoil", SPOILT.values(), ids=SPOILT.keys())
def test_packs_that_hold_something_else_are_refused_in_a_sentence(
    spoil: Callable, read: Callable, truth: Dataset, tmp_path: Path
) -> None:
    source = write_taxim(truth, tmp_path / "source", **spoil(frames_of(truth)))
    with pytest.raises(WedgeError, match=r"dataPack\.npz"):
        read(source / "dataPack.npz")
    assert [path.name for path in tmp_path.iterdir()] == ["source"]


def truncate(path: Path) -> None:
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])


def claim_frames(path: Path) -> None:
    """A header that claims more frames than any machine has room for."""
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    header = parts["imgs.npy"]
    parts["imgs.npy"] = header.replace(b"(5, ", b"(9999999999, ", 1)[: len(header)]
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in parts.items():
            archive.writestr(name, content)


def claim_bytes(path: Path) -> None:
    """Of two arrays, which only together would fill the memory."""
    content = bytearray(path.read_bytes())
    for name in (b"f0.npy", b"imgs.npy"):
        size = content.rindex(name) - 46 + 24  # in the directory, of what it unpacks to
        content[size : size + 4] = struct.pack("<I", 1200 << 20)
    path.write_bytes(content)


def rename_member(path: Path) -> None:
    """To what numpy hands out as bytes instead of an array."""
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in parts.items():
            archive.writestr("touch_radius" if name == "touch_radius.npy" else name, content)


def write_text(path: Path) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        for name in ("f0", "imgs", "touch_center", "touch_radius"):
            archive.writestr(f"{name}.npy", "no array of numpy's")


@READERS
@pytest.mark.parametrize("damage", [truncate, claim_frames, claim_bytes, rename_member, write_text])
def test_damaged_and_hostile_packs_are_refused_in_a_sentence(
    damage: Callable, read: Callable, truth: Dataset, tmp_path: Path
) -> None:
    path = write_taxim(truth, tmp_path / "source") / "dataPack.npz"
    damage(path)
    with pytest.raises(WedgeError, match=r"dataPack\.npz"):
        read(path)
    assert [path.name for path in tmp_path.iterdir()] == ["source"]
