# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A folder of raw frames gives corners, scale and circles of its own accord."""

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from recon.images import read_image, write_image
from recon.labels.ball_size import refuse_wrong_ball
from sensor.dataset import BallLabel, DatasetCard, read_dataset
from sensor.errors import WedgeError
from sensor.toml import Pair
from tests.synthetic import (
    BALL_RADIUS_MM,
    KEYSTONE_PX,
    LIGHTS_DEG,
    MM_PER_PX,
    digitized,
    gel_pixels_of_raw,
    make_dataset,
    pad_size_mm,
    shaded,
)
from validation.importers.raw_frames import Prepared, import_raw_frames, sort_pictures

GAP_MM, JAW_MM, COLLAR_MM = 3.0, 2.0, 0.3


def off_pad() -> np.ndarray:
    columns, rows = gel_pixels_of_raw(KEYSTONE_PX)
    width, height = np.divide(pad_size_mm(), MM_PER_PX)
    return (columns < -0.5) | (rows < -0.5) | (columns > width - 0.5) | (rows > height - 0.5)


def caliper(along_x: bool, lights_deg: Mapping[str, float] = LIGHTS_DEG) -> np.ndarray:
    """A raw frame of two jaws, their gap about the middle of the pad."""
    columns, rows = gel_pixels_of_raw(KEYSTONE_PX)
    x, y = columns * MM_PER_PX[0] - 6.1, rows * MM_PER_PX[1] - 4.4
    across, along = (x, y) if along_x else (y, x)
    slope = np.zeros(x.shape)
    for sign in (-1, 1):
        away = GAP_MM / 2 - sign * across
        hung = (
            0.25 / COLLAR_MM * np.exp(-np.abs(np.where(away > 0, away, away + JAW_MM)) / COLLAR_MM)
        )
        slope += sign * np.where((away > 0) & (away < GAP_MM), hung, 0)
        slope -= sign * np.where(away < -JAW_MM, hung, 0)
    slope = np.where(np.abs(along) < 3, slope, 0)
    still = np.zeros_like(slope)
    light = shaded(np.stack([slope, still] if along_x else [still, slope], -1), lights_deg)
    return digitized(light + np.random.default_rng(int(along_x)).normal(0, 0.5 / 255, light.shape))


@pytest.fixture(scope="module")
def frames(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return raw_frames(tmp_path_factory.mktemp("frames") / "mine", presses=4, seed=3)


def raw_frames(
    folder: Path, *, presses: int, seed: int, lights_deg: Mapping[str, float] = LIGHTS_DEG
) -> Path:
    """A blank frame, presses, and pictures of a caliper, with their true labels in truth/."""
    known = {"corners_px": KEYSTONE_PX, "lights_deg": lights_deg}
    truth = make_dataset(folder / "truth", presses=presses, seed=seed, **known)
    pictures = {name: read_image(truth.folder / name) for name in ("background.png",)}
    pictures |= {x.file: read_image(truth.folder / x.file) for x in truth.labels}
    pictures |= {
        f"3mm-{number}.png": caliper(along_x, lights_deg)
        for number, along_x in ((1, True), (2, False))
    }
    dark = off_pad()
    for name, picture in pictures.items():
        write_image(folder / name, np.where(dark[..., None], np.uint8(8), picture))
    return folder


def imported(frames: Path, out: Path, *, pad_size_mm: Pair = (9.9, 11.0), **how: Any) -> Prepared:
    """Frames as a dataset, the pad taken to be a little off its true size unless said otherwise."""
    how = {"ball_radius_mm": BALL_RADIUS_MM, "pad_size_mm": pad_size_mm, **how}
    with ThreadPoolExecutor(1) as pool:
        return import_raw_frames(frames, out, pool, **how)


def raw_places(card: DatasetCard, labels: tuple[BallLabel, ...]) -> np.ndarray:
    """Labelled centres in raw pixels."""
    size = card.unwarped_size_px
    assert size is not None
    right, bottom = size[0] - 0.5, size[1] - 0.5
    edges = [(-0.5, -0.5), (right, -0.5), (right, bottom), (-0.5, bottom)]
    to_raw = cv2.getPerspectiveTransform(np.float32(edges), np.float32(card.corners_px))
    places = np.array([[x.center_px] for x in labels])
    return cv2.perspectiveTransform(places, to_raw)[:, 0]


def test_raw_frames_become_a_labelled_dataset(frames: Path, tmp_path: Path) -> None:
    prepared = imported(frames, tmp_path)
    made, truth = read_dataset(tmp_path), read_dataset(frames / "truth")
    corners = np.array(made.card.corners_px)
    away = np.linalg.norm(corners[:, None] - np.array(KEYSTONE_PX), axis=2)
    assert away.min(1).max() < 1.0
    # The longer side is taken as the base's, so x and y are the truth's y and x.
    assert made.card.pad_size_mm == pytest.approx(pad_size_mm()[::-1], rel=0.03)
    assert prepared.scale is not None
    assert prepared.scale.gaps == 2
    assert [x.file for x in made.labels] == [x.file for x in truth.labels]
    off = raw_places(made.card, made.labels) - raw_places(truth.card, truth.labels)
    assert np.linalg.norm(off, axis=1).max() < 1.0
    assert made.card.lights_deg is not None
    assert set(made.card.lights_deg) == {"R", "G", "B"}


def test_a_pad_of_a_third_of_the_assumed_size_is_measured(tmp_path: Path) -> None:
    """At that scale a ball is sought that is a third as large, and some circles are not its own."""
    frames = raw_frames(tmp_path / "mine", presses=10, seed=6)
    imported(frames, tmp_path / "made", pad_size_mm=(34.0, 25.5))
    made = read_dataset(tmp_path / "made")
    assert made.card.pad_size_mm == pytest.approx(pad_size_mm()[::-1], rel=0.03)


@pytest.mark.parametrize("unseen", [0, 1])
def test_the_pitch_that_no_light_shows_follows_the_other_s(unseen: int, tmp_path: Path) -> None:
    """As the pad's proportions are known; x and y of the set are the truth's y and x."""
    lights_deg = {"R": 0.0, "B": 180.0} if unseen == 0 else {"R": 90.0, "B": -90.0}
    frames = raw_frames(tmp_path / "mine", presses=4, seed=3, lights_deg=lights_deg)
    width_mm, length_mm = pad_size_mm()
    assumed_mm = (1.5 * length_mm, 1.5 * width_mm)
    prepared = imported(frames, tmp_path / "made", pad_size_mm=assumed_mm)
    assert prepared.scale is not None
    assert (prepared.scale.unseen, prepared.scale.gaps) == ("xy"[unseen], 1)
    made = read_dataset(tmp_path / "made").card.pad_size_mm
    assert made == pytest.approx((length_mm, width_mm), rel=0.03)


def test_pictures_without_jaws_are_named_where_the_others_say_too_little(
    frames: Path, tmp_path: Path
) -> None:
    for path in frames.glob("*.png"):
        blank = "background.png" if path.name == "3mm-2.png" else path.name
        write_image(tmp_path / "mine" / path.name, read_image(frames / blank))
    with pytest.raises(WedgeError) as refused:
        imported(tmp_path / "mine", tmp_path / "out")
    assert "(no jaws were recognised in 3mm-2.png): every picture" in str(refused.value)


def test_a_card_is_judged_by_what_the_caliper_says_before_circles_are_sought(
    frames: Path, tmp_path: Path
) -> None:
    seen: list[DatasetCard] = []

    def refuse(card: DatasetCard) -> None:
        seen.append(card)
        raise WedgeError("another design's")

    with pytest.raises(WedgeError, match="another design's"):
        imported(
            frames,
            tmp_path,
            check=refuse,
            progress=lambda share, step: "circles" in step and pytest.fail("they were sought"),
        )
    assert seen[0].pad_size_mm == pytest.approx(pad_size_mm()[::-1], rel=0.03)


def test_a_pitch_that_somebody_gives_stands_above_a_pad_that_seems_to_show(
    frames: Path, tmp_path: Path
) -> None:
    for path in frames.glob("*.png"):
        if "mm-" not in path.name:
            write_image(tmp_path / "mine" / path.name, read_image(path))
    prepared = imported(tmp_path / "mine", tmp_path / "out", mm_per_px=0.1)
    card = read_dataset(tmp_path / "out").card
    assert card.corners_px is None and card.pad_size_mm is None and card.mm_per_px == (0.1, 0.1)
    assert prepared.left_aside is not None


def test_pictures_are_told_by_their_names() -> None:
    sorted_ = sort_pictures(
        [
            "bg-0.jpg",
            "Background.PNG",
            "5mm-0.jpg",
            "caliper-2.5mm.png",
            "ball-5mmx.jpg",
            "ball-4.84mm-03.png",
            "4.84mmball-1.png",
            "press 5mm.png",
            "Blank.bmp",
            "5mm-1.tiff",
            "press.TIF",
            "bg1.png",
            "background_real.png",
            "blank-a.jpg",
            "Ref 2 (new).png",
            "bgball.png",
            "backgrounds.png",
            "notes.txt",
            "._press 5mm.png",
        ]
    )
    assert set(sorted_.background) == {
        "Background.PNG",
        "Blank.bmp",
        "Ref 2 (new).png",
        "background_real.png",
        "bg-0.jpg",
        "bg1.png",
        "blank-a.jpg",
    }
    assert sorted_.caliper == (("5mm-0.jpg", 5.0), ("5mm-1.tiff", 5.0), ("caliper-2.5mm.png", 2.5))
    assert set(sorted_.presses) == {
        "4.84mmball-1.png",
        "backgrounds.png",
        "ball-4.84mm-03.png",
        "ball-5mmx.jpg",
        "bgball.png",
        "press 5mm.png",
        "press.TIF",
    }
    with pytest.raises(WedgeError, match="blank gel"):
        sort_pictures(["a.png"])
    with pytest.raises(WedgeError, match="ball press"):
        sort_pictures(["background.png", "5mm-1.png"])


def test_presses_that_are_named_as_a_caliper_s_or_lie_elsewhere_are_said_to_be_so(
    tmp_path: Path,
) -> None:
    balls = [f"5.84mm ball {i}.png" for i in range(3)]
    with pytest.raises(WedgeError, match=r"all 3 are named as a caliper's \(5\.84mm ball 0\.png\)"):
        sort_pictures(["background.png", *balls])
    with pytest.raises(WedgeError, match=r"picture of a ball press\.$"):
        sort_pictures(["background.png"])
    for name in ("background.png", "balls/1.png", ".thumbnails/1.png"):
        write_image(tmp_path / name, np.zeros((8, 8, 3), np.uint8))
    for is_there in (True, False):
        with pytest.raises(WedgeError) as refused:
            imported(tmp_path, tmp_path / "out")
        assert (f"Pictures in {tmp_path / 'balls'} are not" in str(refused.value)) == is_there
        (tmp_path / "balls" / "1.png").unlink(missing_ok=True)


def test_a_ball_that_is_not_recognised_beside_a_caliper_is_asked_for_by_its_radius(
    frames: Path, tmp_path: Path
) -> None:
    """The pad is but a first guess then, and nobody is told that nothing measures it."""
    for name in ("background.png", "3mm-1.png", "3mm-2.png"):
        write_image(tmp_path / "mine" / name, read_image(frames / name))
    write_image(tmp_path / "mine" / "press.png", read_image(frames / "background.png"))
    with pytest.raises(WedgeError) as refused:
        imported(tmp_path / "mine", tmp_path / "out")
    assert "in press.png: check that the ball's radius is 4 mm" in str(refused.value)
    assert "nothing measured" not in str(refused.value)


def test_a_name_that_would_mean_a_frame_of_an_archive_is_refused(tmp_path: Path) -> None:
    for name in ("background.png", "press #1.png"):
        write_image(tmp_path / name, np.zeros((8, 8, 3), np.uint8))
    with pytest.raises(WedgeError, match=r"press #1\.png.*rename"):
        imported(tmp_path, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_ball_as_small_as_its_contacts_is_refused(frames: Path) -> None:
    truth = read_dataset(frames / "truth")
    refuse_wrong_ball(truth.labels, truth.card)
    widest_mm = max(x.contact_radius_px for x in truth.labels) * MM_PER_PX[0]
    small = DatasetCard(
        name="small",
        source="test",
        licence="CC0",
        mm_per_px=MM_PER_PX,
        ball_radius_mm=0.7 * widest_mm,
        background=("background.png",),
    )
    with pytest.raises(WedgeError, match=r"at 0\.1 mm/px\): are its radius and the scale right"):
        refuse_wrong_ball(truth.labels, small)
