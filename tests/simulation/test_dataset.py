# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A rendered set is a dataset like any other, and the same whoever renders it."""

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path

import numpy as np
import pytest

from recon.calibration import unit_of_set
from recon.geometry.unwarp import prepare_unwarp
from recon.images import read_image
from recon.presses import read_presses
from sensor.dataset import read_dataset
from sensor.design import FINGER, STANDARD
from sensor.errors import WedgeError
from simulation.camera import amplified, expose
from simulation.dataset import (
    Recipe,
    bands,
    dent_of,
    presses_of,
    seen_by_camera,
    trace_part,
    trace_press,
    write_set,
)
from simulation.engine import SCALAR
from simulation.presses import skin_under
from simulation.raw_view import corners_px, unwarped_skin
from simulation.skin import gel_view
from tests.simulation.conftest import InLine
from validation.importers.lights import measure_lights_deg

KEPT = Path(__file__).resolve().parents[2] / "simulation" / "sets"

RECIPE = Recipe(engine=SCALAR, design=FINGER, width_px=32, samples=16)
PRESSES = presses_of(FINGER, "balls", count=2, seed=0) + presses_of(
    FINGER, "prism", count=1, seed=0
)


@pytest.fixture(scope="module")
def folder(mitsuba, tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("set")
    write_set(made, RECIPE, PRESSES, source="a test", executor=InLine())
    return made


def test_it_is_read_as_presses_with_lights_and_truth(folder: Path) -> None:
    dataset = read_dataset(folder)
    presses = read_presses(dataset).presses
    assert [press.file for press in presses] == ["ball_00.jpg", "ball_01.jpg"]
    assert dataset.card.lights_deg == {"R": 90.0, "G": 180.0, "B": -90.0}
    assert dataset.card.mm_per_px == (13 / 32, 13 / 32)
    for press in PRESSES:
        truth = np.load(folder / "truth" / f"{press.name}.npy")
        assert truth.dtype == np.float32
        np.testing.assert_array_equal(
            truth, skin_under(FINGER, RECIPE.view, press).depth_mm.astype(np.float32)
        )
        assert read_image(folder / f"{press.name}.jpg").shape[:2] == truth.shape


def test_labels_are_the_contact(folder: Path) -> None:
    for label in read_dataset(folder).labels:
        truth = np.load(folder / "truth" / label.file.replace("jpg", "npy"))
        deepest = np.unravel_index(truth.argmax(), truth.shape)
        assert np.hypot(deepest[1] - label.center_x_px, deepest[0] - label.center_y_px) < 1.5
        assert 0.5 * (truth > 0.02).sum() < np.pi * label.contact_radius_px**2 < (truth > 0).sum()


RAW = replace(RECIPE, width_px=80, samples=1, raw=True)
RAW_PRESS = replace(PRESSES[0], depth_mm=0.3)


@pytest.fixture(scope="module")
def raw_set(mitsuba, tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("raw")
    write_set(made, RAW, [RAW_PRESS], source="a test", executor=InLine())
    return made


def test_a_raw_sets_truth_and_labels_are_of_the_unwarped_frame(raw_set: Path) -> None:
    recipe, press = RAW, RAW_PRESS
    dataset = read_dataset(raw_set)
    assert dataset.card.pad_size_mm == pytest.approx((13, 57 * 13 / 80))
    corners = np.array(corners_px(FINGER, dataset.card.pad_size_mm))
    np.testing.assert_allclose(dataset.card.corners_px, corners, atol=0.01)
    (label,) = dataset.labels
    truth = np.load(raw_set / "truth" / f"{press.name}.npy")
    assert truth.shape[::-1] == dataset.card.unwarped_size_px
    middle = np.argwhere(truth > 0.9 * truth.max()).mean(0)[::-1]
    assert math.dist(middle, label.center_px) < 1
    skin = skin_under(FINGER, recipe.view, press)
    undone, corners_alone = (
        unwarped_skin(FINGER, recipe.view, skin, lens_undone=lens_undone).depth_mm
        for lens_undone in (True, False)
    )
    np.testing.assert_allclose(truth, undone, atol=1e-6)
    for other in (corners_alone, skin.depth_mm):  # nor as the lens shows it, nor straight on
        assert np.abs(truth - other).max() > 0.02


def test_raw_frames_without_the_baffle_show_more_of_the_gel() -> None:
    size = RAW.view.size_px[::-1]
    lit, rest = np.ones((*size, 3), np.float32), np.zeros(size)
    hidden, bare = (
        seen_by_camera(replace(RAW, baffle=baffle), lit, rest) > 0 for baffle in (True, False)
    )
    assert bare[hidden].all() and bare.sum() > 1.2 * hidden.sum()


def test_calibrating_a_raw_set_undoes_the_lens_that_it_carries(raw_set: Path) -> None:
    dataset = read_dataset(raw_set)
    unit = unit_of_set(dataset, "table")
    assert unit.lens is not None
    size_px, corners_px = dataset.card.unwarped_size_px, dataset.card.corners_px
    told = prepare_unwarp((640, 480), corners_px, size_px, unit.lens).maps
    bare = prepare_unwarp((640, 480), corners_px, size_px).maps
    np.testing.assert_array_equal(unit.unwarp.maps, told)
    assert np.abs(np.subtract(told, bare)).max() > 3


def test_another_executor_writes_the_same_set(folder: Path, tmp_path: Path) -> None:
    with ThreadPoolExecutor(2) as executor:
        write_set(
            tmp_path, RECIPE, PRESSES[:1], source="a test", executor=executor,
            truth="shapes",
        )  # fmt: skip
    for name in ("background_0.jpg", "ball_00.jpg"):
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()
    assert not (tmp_path / "truth").exists()


@pytest.mark.parametrize("width_px", [16, 32, 64])
def test_every_row_is_in_one_band_and_no_band_is_empty(width_px: int) -> None:
    gel = replace(STANDARD.gel, pad_length_mm=46.0, pad_width_mm=6.0)
    slim = replace(STANDARD, gel=gel, acrylic=replace(STANDARD.acrylic, length_mm=48.0))
    view = gel_view(slim, width_px)
    rows = [range(rows.start, rows.stop) for _, rows in bands(view)]
    assert all(rows) and list(chain(*rows)) == list(range(view.size_px[1]))


def test_a_press_changes_the_picture_near_it_alone(mitsuba) -> None:
    recipe = Recipe(engine=SCALAR, design=STANDARD, width_px=64, samples=4)
    dent = dent_of(recipe, PRESSES[0])
    columns, rows = dent.window
    traced = trace_press(recipe, PRESSES[0])
    assert traced.shape == (rows.stop - rows.start, columns.stop - columns.start, 3)
    outside = np.ones_like(dent.depth_mm, bool)
    outside[rows, columns] = False
    assert outside.any() and (dent.depth_mm[outside] == 0).all()


def test_an_interrupted_set_goes_on_without_tracing_anything_twice(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Dies(InLine):
        left = 6

        def submit(self, fn, /, *args, **kwargs):
            self.left -= 1
            if self.left < 0:
                raise KeyboardInterrupt
            return super().submit(fn, *args, **kwargs)

    def write(name: str, executor) -> None:
        (tmp_path / name).mkdir()
        write_set(
            tmp_path / name, RECIPE, PRESSES, source="a test", executor=executor,
            keep=tmp_path / "kept",
        )  # fmt: skip

    whole = InLine()
    write("first", whole)
    parts = sorted((tmp_path / "kept").iterdir())
    assert len(parts) == 4 + len(PRESSES)
    parts[0].write_bytes(parts[0].read_bytes()[:100])  # cut off
    parts[-1].unlink()
    second = Dies()
    second.left = 2
    write("second", second)
    assert second.left == 0
    frames = list((tmp_path / "first").glob("*.jpg"))
    assert len(frames) >= len(PRESSES)
    for path in frames:
        assert (tmp_path / "second" / path.name).read_bytes() == path.read_bytes()


@pytest.mark.parametrize(
    ("scene", "options", "words"),
    [
        ("cat", {}, "no scene 'cat'"),
        ("balls", {"count": 0}, "at least 1"),
        ("balls", {"ball_radius_mm": 40.0}, "larger than the pad"),
        ("balls", {"ball_radius_mm": 0.0}, "larger than zero"),
        ("balls", {"ball_radius_mm": np.nan}, "larger than zero"),
        ("balls", {"depth_mm": 1.9, "ball_radius_mm": 1.8}, "past its middle, 1.8 mm"),
        ("shapes", {"depth_mm": -0.1}, "deeper than zero"),
        ("set", {"depth_mm": np.inf}, "finite"),
        ("shapes", {"off_center": 1.2}, "--off-center 1.2 must be from 0"),
        ("shapes", {"off_center": -0.1}, "--off-center -0.1 must be from 0"),
        ("shapes", {"off_center": np.nan}, "--off-center nan must be from 0"),
        ("balls", {"off_center": 0.5}, "balls cover the pad anyway"),
        ("prism", {"depth_mm": 2.0}, "prism: a press of 2 mm goes through the gel, which is 2 mm"),
    ],
)
def test_scenes_that_cannot_be_are_refused(scene, options, words) -> None:
    with pytest.raises(WedgeError, match=words):
        presses_of(FINGER, scene, **{"count": 2, "seed": 0, **options})


@pytest.mark.parametrize("off_center", [0.5, 1.0])
def test_shapes_beside_the_middle_lie_toward_the_corners_within_the_pad(off_center) -> None:
    middle = {press.name: press for press in presses_of(FINGER, "shapes", count=1, seed=0)}
    beside = presses_of(FINGER, "shapes", count=1, seed=0, off_center=off_center)
    assert len({press.name for press in beside}) == len(beside) == 4 * len(middle)
    for press in beside:
        shape, vertical, horizontal = press.name.rsplit("_", 2)
        x_mm, y_mm = press.center_mm
        assert x_mm * {"left": -1, "right": 1}[horizontal] >= 0
        assert y_mm * {"top": -1, "bottom": 1}[vertical] >= 0
        assert (press.indenter.name, press.depth_mm) == (shape, middle[shape].depth_mm)
        for away, size, pad in zip(
            press.center_mm, press.indenter.size_mm, FINGER.pad_size_mm, strict=True
        ):
            left_mm = pad / 2 - (abs(away) + size / 2)
            assert left_mm == pytest.approx((1 - off_center) * (pad - size) / 2)


def test_a_ball_that_fits_a_pad_once_only_is_refused() -> None:
    narrow = replace(FINGER, gel=replace(FINGER.gel, pad_width_mm=4.0))
    with pytest.raises(WedgeError, match="no room"):
        presses_of(narrow, "balls", count=2, seed=0, ball_radius_mm=1.9)


def test_a_press_between_pixels_is_refused_by_the_pixels_that_it_is_rendered_with() -> None:
    balls = partial(presses_of, STANDARD, "balls", count=40, seed=0, ball_radius_mm=0.5)
    assert len(balls(width_px=960)) == 40
    with pytest.raises(WedgeError, match=r"^ball_\d\d: .* does not reach .* --width-px"):
        balls(width_px=64)


def test_the_lights_are_seen_where_the_card_says() -> None:
    dataset = read_dataset(KEPT / "finger")
    measured = measure_lights_deg(read_presses(dataset).presses[::4])
    for color, azimuth in dataset.card.lights_deg.items():
        assert abs((measured[color] - azimuth + 180) % 360 - 180) < 20, color


@pytest.mark.parametrize("design", [STANDARD, FINGER])
def test_the_set_that_is_kept_is_what_its_command_renders(design, mitsuba) -> None:
    kept = KEPT / design.name
    dataset = read_dataset(kept)
    words = dataset.card.source.split()
    assert words[:4] == ["wedge", "simulate", "--design", design.name]
    presses = {
        press.name: press
        for press in presses_of(
            design, "set", count=int(words[words.index("--presses") + 1]),
            seed=int(words[words.index("--seed") + 1]),
        )
    }  # fmt: skip
    assert {f"{name}.jpg" for name in presses} | set(dataset.card.background) == {
        path.name for path in kept.glob("*.jpg")
    }
    view = Recipe(engine=SCALAR, design=design).view
    assert dataset.card.mm_per_px == view.mm_per_px
    truth = np.load(kept / "truth" / "lego.npy")
    np.testing.assert_allclose(skin_under(design, view, presses["lego"]).depth_mm, truth, atol=1e-5)
    # A coarse render of the untouched gel is the kept background, within its grain.
    small = Recipe(engine=SCALAR, design=design, width_px=32, samples=64)
    size = small.view.size_px
    coarse = trace_part(small, np.zeros(size[::-1]), (slice(0, size[0]), slice(0, size[1])), None)
    linear = (read_image(kept / dataset.card.background[0]) / 255.0) ** 2.2
    blocks = linear[: size[1] * 10, : size[0] * 10].reshape(size[1], 10, size[0], 10, 3)
    error = amplified(coarse, expose(coarse)) / blocks.mean((1, 3)) - 1
    assert np.abs(np.median(error[2:-2, 2:-2], axis=(0, 1))).max() < 0.05
