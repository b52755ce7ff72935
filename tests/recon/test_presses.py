# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import shutil
from dataclasses import replace

import numpy as np
import pytest

from recon.contact.disturbed import STRANGE
from recon.geometry.lens import Lens, write_lens
from recon.images import GRAY, read_image, write_image
from recon.presses import (
    ENOUGH_PRESSES,
    deep_presses,
    few_presses,
    fingerprint,
    left_out_places,
    read_background,
    read_presses,
)
from sensor.dataset import LENS_FILE, BallLabel, read_dataset, write_card, write_labels
from sensor.errors import WedgeError
from tests.synthetic import (
    BALL_RADIUS_MM,
    KEYSTONE_PX,
    RAW_SIZE_PX,
    SIZE_PX,
    gradient_of,
    make_dataset,
    shaded,
)

GRAY_LEVEL = 1 / 255


@pytest.fixture
def dataset(tmp_path):
    return make_dataset(tmp_path, presses=4)


def with_blank_gel(dataset, label):
    """The label, as if of a frame that shows the blank gel."""
    shutil.copy(dataset.folder / "background.png", dataset.folder / "blank.png")
    return replace(label, file="blank.png")


def relabelled(dataset, *labels):
    write_labels(dataset.folder / "labels.csv", labels)
    return read_dataset(dataset.folder)


def true_difference(label):
    place = (label.center_x_px, label.center_y_px, label.contact_radius_px)
    return shaded(gradient_of(place)) - shaded(gradient_of(None))


def test_presses_are_differences_to_the_background_in_the_order_of_the_labels(dataset):
    made = read_presses(dataset)
    assert made.unwarp.size_px == SIZE_PX and made.left_out == () and made.lens is None
    assert [press.file for press in made.presses] == [label.file for label in dataset.labels]
    for press, label in zip(made.presses, dataset.labels, strict=True):
        assert press.difference.dtype == np.float32
        error = press.difference - true_difference(label)
        assert np.abs(error).max() < 6 * GRAY_LEVEL and abs(error.mean()) < 0.1 * GRAY_LEVEL
        assert press.center_px == label.center_px
        assert press.contact_radius_px == label.contact_radius_px
        assert press.ball_radius_mm == BALL_RADIUS_MM and press.mm_per_px == (0.1, 0.1)


def test_frames_seen_askew_come_back_straight(tmp_path):
    dataset = make_dataset(tmp_path, presses=3, corners_px=KEYSTONE_PX, noise_gray_levels=0)
    made = read_presses(dataset)
    assert made.unwarp.frame_size_px == RAW_SIZE_PX and made.unwarp.size_px == SIZE_PX
    for press, label in zip(made.presses, dataset.labels, strict=True):
        error = np.abs(press.difference - true_difference(label))
        assert np.median(error) < GRAY_LEVEL and error.mean() < 2 * GRAY_LEVEL


def test_an_npz_holds_the_same_presses_as_single_pictures(tmp_path):
    single, packed = (
        read_presses(make_dataset(tmp_path / name, presses=3, in_npz=name == "npz"))
        for name in ("png", "npz")
    )
    for one, other in zip(single.presses, packed.presses, strict=True):
        np.testing.assert_array_equal(one.difference, other.difference)


def test_a_ball_of_its_own_is_kept_with_its_press(dataset):
    first, second, *_ = dataset.labels
    made = read_presses(relabelled(dataset, first, replace(second, ball_radius_mm=6.0)))
    assert [press.ball_radius_mm for press in made.presses] == [BALL_RADIUS_MM, 6.0]


def test_the_background_is_the_mean_of_its_frames(dataset):
    shape = read_image(dataset.folder / "background.png").shape
    for name, shade in (("dark.png", 100), ("light.png", 103)):
        write_image(dataset.folder / name, np.full(shape, shade, np.uint8))
    card = replace(dataset.card, background=("dark.png", "light.png", "light.png"))
    assert (read_background(replace(dataset, card=card)) == 102).all()


def test_progress_ends_at_one_though_presses_are_left_out(dataset):
    shares = []
    tiny = replace(with_blank_gel(dataset, dataset.labels[0]), contact_radius_px=2.0)
    labels = [*dataset.labels, tiny]
    read_presses(relabelled(dataset, *labels), shares.append)
    assert shares == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0])


def test_presses_that_cannot_be_used_are_named_with_the_reason(dataset):
    blank = with_blank_gel(dataset, dataset.labels[1])
    tiny = replace(dataset.labels[2], contact_radius_px=2.5)
    made = read_presses(relabelled(dataset, dataset.labels[0], blank, tiny, dataset.labels[3]))
    assert [press.file for press in made.presses] == ["press00.png", "press03.png"]
    assert [(left.file, left.reason) for left in made.left_out] == [
        ("blank.png", "no contact is visible inside the labelled circle"),
        ("press02.png", "the contact circle is smaller than 3 pixels"),
    ]


@pytest.mark.parametrize("level", [0, 255])
def test_a_frame_of_one_level_is_no_press(dataset, level):
    """It differs from the blank gel inside the circle, as everywhere."""
    shape = (SIZE_PX[1], SIZE_PX[0], 3)
    write_image(dataset.folder / "lost.png", np.full(shape, level, np.uint8))
    lost = replace(dataset.labels[1], file="lost.png")
    made = read_presses(relabelled(dataset, lost, *dataset.labels))
    assert [press.file for press in made.presses] == [label.file for label in dataset.labels]
    assert [(left.file, left.reason) for left in made.left_out] == [("lost.png", STRANGE)]


def test_a_press_whose_rim_is_not_in_the_frame_is_left_out(dataset):
    """Depth errors would have nothing to start from."""
    wide = replace(dataset.labels[0], contact_radius_px=150.0, ball_radius_mm=30.0)
    made = read_presses(relabelled(dataset, wide, *dataset.labels[1:]))
    assert [left.file for left in made.left_out] == [wide.file]
    assert made.left_out[0].reason.startswith("the contact circle encloses the frame")


def test_of_two_that_are_the_same_picture_one_is_left_out(dataset):
    """Whatever format and name: one would teach what the other judges."""
    label = dataset.labels[1]
    frame = read_image(dataset.folder / label.file)
    np.savez(dataset.folder / "more.npz", frames=np.stack([frame, frame // 2]))
    tiny = replace(label, contact_radius_px=2.0)  # it cannot be used: the copy can
    copies = [replace(label, file="more.npz#0", center_x_px=label.center_x_px + 1)]
    other = replace(label, file="more.npz#1")
    made = read_presses(relabelled(dataset, label, *copies, other))
    assert [press.file for press in made.presses] == [label.file, "more.npz#1"]
    assert made.left_out[0].reason == f"it is the same picture as {label.file}"
    alone = read_presses(relabelled(dataset, tiny, *copies))
    assert [press.file for press in alone.presses] == ["more.npz#0"]


def test_a_set_without_one_usable_press_is_refused_and_says_why(dataset):
    blank = with_blank_gel(dataset, dataset.labels[1])
    with pytest.raises(
        WedgeError,
        match=r"labels\.csv names no press that can be used \(1 labelled; the first: "
        r"blank\.png: no contact is visible",
    ):
        read_presses(relabelled(dataset, blank))
    with pytest.raises(WedgeError, match=r"labels\.csv names no press .* \(0 labelled\)"):
        read_presses(relabelled(dataset))


@pytest.mark.parametrize("file", ["press02.png", "background.png"])
def test_a_frame_that_is_missing_or_truncated_is_named(dataset, file):
    path = dataset.folder / file
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(WedgeError, match=f"{file} cannot be decoded, it may be truncated"):
        read_presses(dataset)
    path.unlink()
    with pytest.raises(WedgeError, match=f"{file} is missing"):
        read_presses(dataset)


def test_frames_of_another_size_than_the_background_are_named(dataset):
    write_image(dataset.folder / "press01.png", np.zeros((60, 80, 3), np.uint8))
    with pytest.raises(WedgeError, match=r"press01\.png is 80x60 pixels, but background\.png is"):
        read_presses(dataset)


@pytest.mark.parametrize("gray", ["background.png", "second.png", "press01.png"])
def test_a_picture_of_a_grey_camera_is_named(dataset, gray):
    """Its red, green and blue are one in every pixel."""
    shutil.copy(dataset.folder / "background.png", dataset.folder / "second.png")
    card = replace(dataset.card, background=("background.png", "second.png"))
    read_presses(replace(dataset, card=card))
    levels = read_image(dataset.folder / gray)
    write_image(dataset.folder / gray, np.repeat(levels[..., :1], 3, axis=2))
    with pytest.raises(WedgeError) as told:
        read_presses(replace(dataset, card=card))
    assert str(told.value) == f"{dataset.folder / gray}: {GRAY}"


def test_a_picture_of_a_single_colour_is_none_of_a_grey_camera(tmp_path):
    made = make_dataset(tmp_path / "set", presses=2, lights_deg={"R": 90.0})
    for name in ("background.png", *(label.file for label in made.labels)):
        write_image(made.folder / name, read_image(made.folder / name) * np.uint8([1, 0, 0]))
    assert len(read_presses(made).presses) == 2


def test_a_background_too_small_for_the_labels_is_named_and_no_label(dataset):
    write_image(dataset.folder / "background.png", np.zeros((10, 12, 3), np.uint8))
    with pytest.raises(
        WedgeError, match=r"press00\.png is 120x90 pixels, but background\.png is 12x10"
    ):
        read_presses(dataset)


def test_backgrounds_of_two_sizes_are_named(dataset):
    write_image(dataset.folder / "second.png", np.zeros((60, 80, 3), np.uint8))
    card = replace(dataset.card, background=("background.png", "second.png"))
    with pytest.raises(
        WedgeError, match=r"second\.png is 80x60 pixels, but background\.png is 120x90"
    ):
        read_presses(replace(dataset, card=card))


@pytest.mark.parametrize(
    "center", [(-0.6, 40.0), (119.6, 40.0), (50.0, -3.0), (50.0, 89.6), (1e9, 1e9)]
)
def test_a_label_outside_the_frame_is_named(dataset, center):
    outside = replace(dataset.labels[2], center_x_px=center[0], center_y_px=center[1])
    with pytest.raises(
        WedgeError, match=r"labels\.csv: the centre of press02\.png .* outside the 120x90 frame"
    ):
        read_presses(relabelled(dataset, dataset.labels[0], outside))


@pytest.mark.parametrize("center", [(-0.5, -0.5), (119.5, 89.5)])
def test_the_outer_edge_still_belongs_to_the_frame(dataset, center):
    one = dataset.labels[0]
    edge = replace(dataset.labels[1], center_x_px=center[0], center_y_px=center[1])
    made = read_presses(relabelled(dataset, one, edge))
    assert len(made.presses) + len(made.left_out) == 2


def test_corners_outside_the_frame_are_named(tmp_path):
    dataset = make_dataset(tmp_path, presses=1, corners_px=KEYSTONE_PX)
    moved = replace(dataset.card, corners_px=((20.0, -30.0), *KEYSTONE_PX[1:]))
    write_card(tmp_path / "dataset.toml", moved)
    with pytest.raises(WedgeError, match=r"dataset\.toml: corners_px: \(20, -30\) lies outside"):
        read_presses(read_dataset(tmp_path))


def lens_of(size, radial=(0.0, 0.0, 0.0)):
    center = ((size[0] - 1) / 2, (size[1] - 1) / 2)
    return Lens(
        frame_size_px=size, focal_px=(150.0, 150.0), center_px=center, radial=radial, rms_px=0.1
    )


def test_a_lens_beside_the_dataset_is_used(tmp_path):
    dataset = make_dataset(tmp_path, presses=2, corners_px=KEYSTONE_PX)
    without = read_presses(dataset)
    write_lens(tmp_path / LENS_FILE, lens_of(RAW_SIZE_PX))
    neutral = read_presses(dataset)
    assert neutral.lens == lens_of(RAW_SIZE_PX)
    for one, other in zip(without.presses, neutral.presses, strict=True):
        np.testing.assert_allclose(one.difference, other.difference, atol=2e-3)
    write_lens(tmp_path / LENS_FILE, lens_of(RAW_SIZE_PX, (-0.2, 0.05, -0.01)))
    bent = read_presses(dataset)
    assert np.abs(bent.presses[0].difference - without.presses[0].difference).max() > 0.05


def test_another_cameras_lens_is_refused(tmp_path):
    dataset = make_dataset(tmp_path, presses=1, corners_px=KEYSTONE_PX)
    write_lens(tmp_path / LENS_FILE, lens_of((640, 480)))
    with pytest.raises(WedgeError, match="the lens was measured on 640x480 frames"):
        read_presses(dataset)


def test_a_label_may_lie_anywhere_when_it_is_on_the_unwarped_frame(tmp_path):
    """Labels are in unwarped pixels: the raw frame's size says nothing about them."""
    dataset = make_dataset(tmp_path, presses=1, corners_px=KEYSTONE_PX)
    label = BallLabel(
        file="press00.png", center_x_px=125.0, center_y_px=50.0, contact_radius_px=9.0
    )
    with pytest.raises(WedgeError, match="outside the 120x90 frame"):
        read_presses(relabelled(dataset, label))


def test_blank_frames_that_disagree_are_refused_and_noise_is_not(tmp_path):
    dataset = make_dataset(tmp_path, presses=2)
    blank = read_image(tmp_path / "background.png")
    noise = np.random.default_rng(0).normal(0, 3, blank.shape)
    write_image(tmp_path / "again.png", np.clip(blank + noise, 0, 255).astype(np.uint8))
    alike = replace(dataset.card, background=("background.png", "again.png"))
    assert read_background(replace(dataset, card=alike)).shape == blank.shape
    pressed = replace(dataset.card, background=("background.png", "press00.png"))
    with pytest.raises(WedgeError, match=r"press00\.png and background\.png disagree by"):
        read_background(replace(dataset, card=pressed))


@pytest.mark.parametrize(("wide", "said"), [(3, False), (4, True)])
def test_balls_that_mostly_go_in_deep_are_said_to_teach_less(tmp_path, wide, said):
    presses = read_presses(make_dataset(tmp_path, presses=6))
    assert deep_presses(presses) is None
    pressed = tuple(
        replace(press, ball_radius_mm=press.contact_radius_mm / share)
        for press, share in zip(presses.presses, [0.71] * wide + [0.69] * (6 - wide), strict=True)
    )
    sentence = deep_presses(replace(presses, presses=pressed))
    assert (sentence is not None) == said
    assert sentence is None or sentence.startswith(f"{wide} of 6 presses are so deep")


def test_presses_in_one_corner_are_said_to_leave_the_pad_out(tmp_path):
    presses = read_presses(make_dataset(tmp_path, presses=12))
    assert left_out_places(presses) is None
    corner = [p for p in presses.presses if p.center_px[0] < 60 and p.center_px[1] < 45]
    sentence = left_out_places(replace(presses, presses=tuple(corner)))
    assert sentence is not None
    assert "such as bottom, right (tip), lie" in sentence
    assert "Press the ball over the whole pad" in sentence


def test_ten_presses_are_enough_and_nine_are_said_to_be_too_few(tmp_path):
    ten = read_presses(make_dataset(tmp_path, presses=ENOUGH_PRESSES))
    assert few_presses(ten) is None
    sentence = few_presses(replace(ten, presses=ten.presses[1:]))
    assert sentence is not None and sentence.startswith("9 presses: too few to trust")


def test_the_mean_of_blank_frames_is_rounded_to_the_nearest_level(tmp_path):
    dataset = make_dataset(tmp_path, presses=1)
    levels = {"a.png": 100, "b.png": 101, "c.png": 101}
    for name, level in levels.items():
        write_image(tmp_path / name, np.full((90, 120, 3), level, np.uint8))
    card = replace(dataset.card, background=tuple(levels))
    assert (read_background(replace(dataset, card=card)) == 101).all()


def test_frames_of_the_same_bytes_and_another_shape_are_not_the_same():
    frame = np.zeros((4, 6, 3), np.uint8)
    assert fingerprint(frame) == fingerprint(frame.copy())
    assert fingerprint(frame) != fingerprint(frame.reshape(6, 4, 3))
