# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Sources of the published shapes, made small, become dataset folders that hold together."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from recon.images import read_frame, read_image, write_image
from recon.presses import read_presses
from sensor.dataset import read_dataset
from sensor.errors import WedgeError
from tests.shading import AZIMUTHS_DEG, as_frame, pressed
from validation.importers import known_depth, taxim, wedge_lab

TAXIM_BALL_PX = taxim.BALL_RADIUS_MM / taxim.MM_PER_PX[0]
PLACES = [(70.0, 60.0), (100.0, 80.0), (85.0, 70.0)]
SIZE_PX = (180, 150)


def make_taxim(path: Path) -> np.ndarray:
    """Writes a dataPack of three presses; returns its frames in RGB."""
    frames = np.stack([as_frame(pressed(SIZE_PX, place, 30.0, TAXIM_BALL_PX)) for place in PLACES])
    background = as_frame(np.zeros((SIZE_PX[1], SIZE_PX[0], 3)))
    np.savez(
        path,
        f0=background[..., ::-1].astype(np.float64),
        imgs=frames[..., ::-1],
        touch_center=np.array(PLACES),
        touch_radius=np.array([30, 30, 30]),
        names=np.array(["a", "b", "c", "one too many"]),
    )
    return frames


def make_known_depth(source: Path) -> None:
    size, ball = (320, 320), known_depth.BALL_RADIUS_MM / known_depth.MM_PER_PX[0]
    write_image(source / known_depth.BACKGROUND, as_frame(np.zeros((320, 320, 3))))
    presses = {
        "calib_1_real.png": ((140.0, 90.0), 22.0),
        "calib_22_real.png": ((210.0, 180.0), 19.0),
    }
    for depth_mm, radius in zip(
        known_depth.SPHERE_DEPTHS_MM, (11.0, 16.0, 21.0, 25.0), strict=True
    ):
        presses[f"sphere_{depth_mm}_real.png"] = (known_depth.SPHERE_CENTER_PX, radius)
    for name, (center, radius) in presses.items():
        write_image(source / name, as_frame(pressed(size, center, radius, ball)))
    table = "calib_1_real.png (142, 89) 25\ncalib_22_real.png (209, 182) 17\n"
    (source / "calib_res.txt").write_text(table)


def make_wedge_lab(source: Path, center_px: tuple[float, float]) -> None:
    """One press in the gel frame, seen back through the pad's corners as the raw camera would."""
    card_size = tuple(
        round(mm / pitch)
        for mm, pitch in zip(wedge_lab.PAD_SIZE_MM, wedge_lab.MM_PER_PX, strict=True)
    )
    width, height = card_size
    edges = [(-0.5, -0.5), (width - 0.5, -0.5), (width - 0.5, height - 0.5), (-0.5, height - 0.5)]
    to_gel = cv2.getPerspectiveTransform(np.float32(wedge_lab.CORNERS_PX), np.float32(edges))

    def raw(gel: np.ndarray) -> np.ndarray:
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        return as_frame(cv2.warpPerspective(gel, to_gel, (240, 320), flags=flags))

    ball = wedge_lab.BALL_RADIUS_MM / wedge_lab.MM_PER_PX[0]
    press, again = (pressed(card_size, center_px, 19.0, ball, noise=x) for x in (0, 0.002))
    folder = source / "calibration"
    (folder / "ball_position").mkdir(parents=True)
    for name, gel in (("bg-0", np.zeros_like(press)), ("ball-0", press), ("ball-10", again)):
        Image.fromarray(raw(gel)).save(folder / f"{name}.jpg", quality=98, subsampling=0)
    across = (center_px[1] + 0.5) * 240 / height
    along = (center_px[0] + 0.5) * 320 / width
    for name in ("ball-0", "ball-10"):
        (folder / "ball_position" / f"{name}.txt").write_text(f"{across + 1:.0f} {along:.0f} 23\n")
    (source / "markerless").mkdir()
    for name in ("bg-0", "cal-0", "cal-10"):
        Image.fromarray(raw(press)).save(source / "markerless" / f"{name}.jpg")


def is_near(angle_deg: float, true_deg: float) -> bool:
    return abs((angle_deg - true_deg + 180) % 360 - 180) <= 4


def test_taxim_becomes_rgb_with_its_own_circles(tmp_path: Path) -> None:
    frames = make_taxim(tmp_path / "dataPack.npz")
    taxim.import_taxim(tmp_path / "dataPack.npz", tmp_path / "set")
    dataset = read_dataset(tmp_path / "set")
    assert [x.center_px for x in dataset.labels] == PLACES
    assert {x.contact_radius_px for x in dataset.labels} == {30.0}
    for index, label in enumerate(dataset.labels):
        assert (read_frame(dataset.folder, label.file) == frames[index]).all()
    assert dataset.card.lights_deg is not None
    for color, angle in dataset.card.lights_deg.items():
        assert is_near(angle, AZIMUTHS_DEG[color])


def test_the_same_source_gives_the_same_folder(tmp_path: Path) -> None:
    make_taxim(tmp_path / "dataPack.npz")
    for name in ("first", "second"):
        taxim.import_taxim(tmp_path / "dataPack.npz", tmp_path / name)
    first, second = (read_dataset(tmp_path / name).sha256 for name in ("first", "second"))
    assert first == second


@pytest.mark.parametrize("damage", [b"no archive", b""])
def test_a_damaged_taxim_is_named(tmp_path: Path, damage: bytes) -> None:
    path = tmp_path / "dataPack.npz"
    path.write_bytes(damage)
    with pytest.raises(WedgeError, match="dataPack"):
        taxim.import_taxim(path, tmp_path / "set")


def test_wedge_lab_is_turned_into_the_gel_frame(tmp_path: Path) -> None:
    make_wedge_lab(tmp_path / "source", center_px=(200.0, 80.0))
    wedge_lab.import_wedge_lab(tmp_path / "source", tmp_path / "set")
    dataset = read_dataset(tmp_path / "set")
    assert [label.file for label in dataset.labels] == ["ball-0.jpg", "ball-10.jpg"]
    for label in dataset.labels:
        assert label.center_px == pytest.approx((200.0, 80.0), abs=0.5)
        assert label.contact_radius_px == pytest.approx(19.0, rel=0.03)
        assert label.quality is not None
        assert 0.5 < label.quality <= 1
    assert dataset.card.lights_deg is not None
    for color, angle in dataset.card.lights_deg.items():
        assert is_near(angle, AZIMUTHS_DEG[color])
    raw, kept = (tmp_path / x / "ball-0.jpg" for x in ("source/calibration", "set"))
    assert raw.read_bytes() == kept.read_bytes()
    assert len(read_presses(dataset).presses) == 2


def test_raw_top_is_the_base_and_raw_right_is_below(tmp_path: Path) -> None:
    make_wedge_lab(tmp_path / "source", center_px=(60.0, 190.0))  # x near the base, y far down
    calibration = tmp_path / "source" / "calibration"
    press, blank = (read_image(calibration / f"{x}.jpg").astype(float) for x in ("ball-0", "bg-0"))
    rows, columns = np.nonzero(np.abs(press - blank).sum(-1) > 60)
    assert rows.mean() < 140
    assert columns.mean() > 130


def test_markerless_frames_come_without_labels(tmp_path: Path) -> None:
    make_wedge_lab(tmp_path / "source", center_px=(200.0, 80.0))
    wedge_lab.import_wedge_lab_markerless(tmp_path / "source", tmp_path / "set")
    dataset = read_dataset(tmp_path / "set")
    assert dataset.labels == ()
    assert {path.name for path in dataset.folder.glob("*.jpg")} == {
        "bg-0.jpg",
        "cal-0.jpg",
        "cal-10.jpg",
    }


def test_known_depth_circles_are_mended(tmp_path: Path) -> None:
    make_known_depth(tmp_path / "source")
    known_depth.import_known_depth(tmp_path / "source", tmp_path / "set")
    labels = {label.file: label for label in read_dataset(tmp_path / "set").labels}
    first, second = labels["calib_1_real.png"], labels["calib_22_real.png"]
    assert first.center_px == pytest.approx((140.0, 90.0), abs=0.5)
    assert second.center_px == pytest.approx((210.0, 180.0), abs=0.5)
    assert first.contact_radius_px == pytest.approx(22.0, rel=0.03)
    assert second.contact_radius_px == pytest.approx(19.0, rel=0.03)


def test_commanded_depth_is_the_deepest_point_of_the_truth(tmp_path: Path) -> None:
    make_known_depth(tmp_path / "source")
    known_depth.import_known_depth_spheres(tmp_path / "source", tmp_path / "set")
    dataset = read_dataset(tmp_path / "set")
    assert len(dataset.labels) == 4
    for label, depth_mm in zip(dataset.labels, known_depth.SPHERE_DEPTHS_MM, strict=True):
        truth = np.load(dataset.folder / "truth" / f"{Path(label.file).stem}.npy")
        assert (truth.dtype, truth.shape) == (np.float32, (320, 320))
        assert truth[166, 208] == pytest.approx(depth_mm, abs=1e-6)
        # A cap's volume, pi h^2 (3 R - h) / 3.
        volume = truth.sum() * known_depth.MM_PER_PX[0] ** 2
        radius = known_depth.BALL_RADIUS_MM
        assert volume == pytest.approx(np.pi * depth_mm**2 * (3 * radius - depth_mm) / 3, rel=0.01)
        crossing = np.sqrt(2 * radius * depth_mm - depth_mm**2) / known_depth.MM_PER_PX[0]
        assert label.contact_radius_px < crossing


@pytest.mark.parametrize(
    ("importer", "lost"),
    [
        (known_depth.import_known_depth, "calib_22_real.png"),
        (known_depth.import_known_depth, "calib_res.txt"),
        (known_depth.import_known_depth_spheres, "sphere_0.5_real.png"),
        (wedge_lab.import_wedge_lab, "calibration/bg-0.jpg"),
        (wedge_lab.import_wedge_lab, "calibration/ball_position/ball-10.txt"),
    ],
)
def test_a_missing_file_is_named(importer, lost: str, tmp_path: Path) -> None:
    make_known_depth(tmp_path / "source")
    make_wedge_lab(tmp_path / "source", center_px=(200.0, 80.0))
    (tmp_path / "source" / lost).unlink()
    (tmp_path / "set").mkdir()
    with pytest.raises(WedgeError, match=Path(lost).name):
        importer(tmp_path / "source", tmp_path / "set")
