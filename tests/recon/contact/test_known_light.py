# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The mask of a sensor whose light is known, and when it is."""

from dataclasses import replace

import numpy as np
import pytest

from recon import unet
from recon.contact.known_light import (
    CONTACT_IN_LIGHT,
    DARK,
    MOST_UNLIKE,
    PAD_MM,
    PITCH_MM,
    held_in_light,
    is_known,
    light_input,
)
from recon.contact.mask import contact_mask
from recon.contact.network import network_input
from recon.estimators import fit_estimator, lesson_of
from recon.estimators.default import SLOPE_KNOTS, Default
from recon.estimators.effort import Effort
from recon.images import read_frame
from recon.markers.detection import Markers
from recon.markers.tracking import Tracked
from recon.pipeline import reconstruct
from recon.presses import press_reader, read_presses
from recon.unet.weights import shipped_weights
from sensor.dataset import read_dataset
from sensor.design import STANDARD
from simulation.indenters import shapes
from simulation.presses import Press, skin_under
from simulation.skin import View, gel_view
from validation.contact import iou
from validation.datasets import dataset_folder

SIZE_PX = (320, 240)
PITCH = (PITCH_MM, PITCH_MM)


@pytest.mark.parametrize(
    ("unlike", "size_px", "mm_per_px", "known"),
    [
        (0.04, SIZE_PX, PITCH, True),
        (0.04, (640, 480), (PITCH_MM / 2, PITCH_MM / 2), True),
        (0.04, (320, 239), PITCH, True),  # a row less of the same pad
        (None, SIZE_PX, PITCH, False),  # few lights, or a unit of before
        (2 * MOST_UNLIKE, SIZE_PX, PITCH, False),  # other light
        (0.04, SIZE_PX, (0.04, 0.04), False),  # a smaller pad
        (0.04, (240, 320), PITCH, False),  # on its side
    ],
)
def test_a_light_is_known_where_balls_and_pad_say_so(unlike, size_px, mm_per_px, known):
    assert is_known(unlike, size_px, mm_per_px) is known


def test_the_pad_is_the_standard_designs():
    assert PAD_MM == STANDARD.pad_size_mm
    assert gel_view(STANDARD, SIZE_PX[0]).mm_per_px == pytest.approx(PITCH)


def test_the_network_sees_what_the_other_does_then_shares_of_the_blank_gel_then_the_place():
    rng = np.random.default_rng(0)
    depth, gradient = rng.random((20, 24), np.float32), rng.random((20, 24, 2), np.float32)
    blank, place = rng.random((20, 24, 3), np.float32), rng.random((20, 24, 2), np.float32)
    maps = light_input(0.1 * (blank + np.float32(DARK)), blank, place, depth, gradient)
    np.testing.assert_array_equal(maps[:4], network_input(depth, gradient))
    np.testing.assert_allclose(maps[4:7], maps[4, 0, 0], rtol=1e-5)  # darker gel changes less
    np.testing.assert_array_equal(np.moveaxis(maps[7:], 0, -1), place)
    assert len(maps) == CONTACT_IN_LIGHT.inputs


def test_the_weights_of_a_known_light_are_whole_and_small():
    assert unet.channels_of(shipped_weights(CONTACT_IN_LIGHT))
    assert CONTACT_IN_LIGHT.file.stat().st_size < 1_200_000


@pytest.fixture(scope="module")
def touched():
    """The screw cap on the twin's standard, read by an estimator taught by some of its balls."""
    pytest.importorskip("torch")
    dataset = read_dataset(dataset_folder("twin-standard"))
    presses = read_presses(dataset).presses
    lesson = lesson_of("default", presses, range(0, len(presses), 2), 0)
    fitted = fit_estimator("default", lesson, "RGB", 0, effort=Effort.HASTY)
    reader = press_reader(dataset)
    frame = reader.unwarp(read_frame(dataset.folder, "screw_cap.jpg"))
    return reconstruct(
        frame - reader.blank, fitted, missing="none", lights_deg=None, mm_per_px=PITCH
    )


def repeated(touch, times):
    """The touch as a camera of so many times as many pixels sees it."""

    def fine(maps):
        return np.repeat(np.repeat(maps, times, 0), times, 1)

    return replace(
        touch,
        difference=fine(touch.difference),
        depth_mm=fine(touch.depth_mm),
        gradient=fine(touch.gradient),
        disturbed=fine(touch.disturbed),
        mm_per_px=(PITCH_MM / times, PITCH_MM / times),
    )


def test_the_standards_mask_is_that_of_its_light_and_of_no_other_sensor(touched):
    assert touched.estimator.unlike < MOST_UNLIKE
    general = contact_mask(touched.disturbed, touched.depth_mm, touched.gradient, PITCH)
    assert touched.contact.any() and (touched.contact != general).any()
    other = replace(touched, estimator=replace(touched.estimator, unlike=1.0))
    np.testing.assert_array_equal(other.contact, general)
    nowhere = np.zeros((0, 2))
    markers = Markers(
        position_px=nowhere,
        cell=np.zeros((0, 2), np.int32),
        response=np.zeros(0),
        scale_px=2.0,
        spacing_px=9.0,
        diameter_px=3.0,
    )
    dots = Tracked(markers=markers, position_px=nowhere, seen=np.zeros(0, bool), jumped=False)
    np.testing.assert_array_equal(replace(touched, dots=dots).contact, general)


def test_a_known_light_shows_more_of_the_truth(touched):
    cap = shapes(STANDARD.pad_size_mm)["screw_cap"]
    press = Press(name="cap", indenter=cap, center_mm=(0.0, 0.0), depth_mm=cap.depth_mm)
    truth = skin_under(STANDARD, View(size_px=SIZE_PX, mm_per_px=PITCH), press).contact
    general = contact_mask(touched.disturbed, touched.depth_mm, touched.gradient, PITCH)
    assert iou(touched.contact, truth) > max(0.86, iou(general, truth))


def test_a_finer_frame_is_answered_as_the_one_learnt_from(touched):
    fine = repeated(touched, 3)  # whose middle pixels lie where the others do
    assert iou(fine.contact[1::3, 1::3], touched.contact) > 0.99


def test_held_gel_is_found_near_and_nowhere_else_in_a_known_light(touched):
    maps = touched.difference, lambda at: np.full((len(at), 3), 0.4, np.float32), touched.depth_mm
    left = touched.depth_mm > 0.1
    left[:, 160:] = False
    assert not held_in_light(*maps, touched.gradient, PITCH, left)[~left].any()
    assert not held_in_light(*maps, touched.gradient, PITCH, np.zeros_like(left)).any()


def test_an_estimator_keeps_how_unlike_its_light_is(touched):
    ours = replace(touched.estimator, error90=np.ones((len(SLOPE_KNOTS), 2), np.float32))
    again = Default.from_tensors(ours.tensors(), "RGB")
    assert again.unlike == np.float32(ours.unlike)
    older = {name: values for name, values in ours.tensors().items() if name != "unlike"}
    assert Default.from_tensors(older, "RGB").unlike is None
    for wrong in (np.zeros(2, np.float32), np.array([-1.0], np.float32)):
        with pytest.raises(ValueError, match="unlike is"):
            Default.from_tensors({**ours.tensors(), "unlike": wrong}, "RGB")
