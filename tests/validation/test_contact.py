# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest

from benchmarks.small_frames import averaged, blanks_in_contact
from recon.presses import press_reader
from sensor.dataset import read_dataset
from sensor.errors import WedgeError
from tests.dotted import dotted, grid_px, pad
from tests.synthetic import make_dataset
from tests.validation.sensors import dotted_set
from validation.contact import blank_frames_in_contact, iou
from validation.datasets import dataset_folder
from validation.dots import score_detection

REAL = ("taxim-gelsight", "known-depth", "wedge-lab", "marker-balls-a", "twin-standard")


def test_overlap_of_masks_is_between_none_and_all():
    one = np.zeros((4, 5), bool)
    one[:, :3] = True
    assert iou(one, one) == 1 and iou(one, ~one) == 0 and iou(~one & one, one & ~one) == 1
    two = np.zeros((4, 5), bool)
    two[:, 1:4] = True
    assert iou(one, two) == pytest.approx(0.5)


@pytest.mark.parametrize("name", REAL)
def test_blank_gel_seen_again_is_not_in_contact(name):
    try:
        folder = dataset_folder(name)
    except WedgeError as error:
        pytest.skip(str(error))
    assert blank_frames_in_contact(read_dataset(folder), 3) == 0


def test_blank_gel_in_a_small_frame_is_not_in_contact_either():
    """The 267th shows a patch of five pixels that differ, as noise in a small frame may."""
    background = press_reader(read_dataset(dataset_folder("twin-standard"))).background
    assert blanks_in_contact(averaged(background, 80), 280) == 0


def test_detection_is_scored_dot_by_dot():
    places = grid_px(20.0)
    image, cut = dotted(places), np.zeros(len(places), bool)
    exact = score_detection(image, places, cut)
    assert (exact.whole, exact.found, exact.false) == (len(places), len(places), 0)
    missing = score_detection(image, np.append(places, [[3.0, 3.0]], 0), np.append(cut, False))
    assert missing.whole - missing.found == 1
    assert score_detection(image, places[1:], cut[1:]).false == 1
    blind = score_detection(pad().astype(np.float32), places, cut)
    assert (blind.found, blind.false) == (0, 0)


def test_what_dots_cost_is_told_where_there_is_clear_gel_beside_them():
    from validation.markers import compared

    clear = np.array([3, 4, 4, 5]), np.array([1.0, 2.0, 4.0, 9.0])
    under = np.array([0, 0, 3, 4]), np.array([99.0, 99.0, 3.0, 5.0])  # the middle is all dots
    mean, pixels = compared({"clear": clear, "zero": under})
    assert (mean, pixels) == ({"clear": (1 + 3) / 2, "zero": (3 + 5) / 2}, 2)
    assert compared({"clear": (clear[0][3:], clear[1][3:]), "zero": under})[1] == 0


@pytest.mark.parametrize("estimator", ["default", "mlp"])
def test_dots_cost_little_where_they_are_filled_smoothly(tmp_path, monkeypatch, estimator):
    from validation.markers import dot_cost

    monkeypatch.setattr("validation.markers.FOLDS", 2)
    monkeypatch.setattr("recon.estimators.default_training.STEPS", 150)
    monkeypatch.setattr("recon.estimators.mlp_training.EPOCHS", 6)
    cost = dot_cost(dotted_set(tmp_path / "set", presses=10), estimator=estimator)
    assert cost.presses == 10 and cost.pixels > 100
    assert 0 < cost.clear <= cost.filled["surface"] < cost.filled["nearest"] < cost.filled["zero"]


def test_presses_of_clear_gel_cannot_tell_what_dots_cost(tmp_path):
    from validation.markers import dot_cost

    dataset = make_dataset(tmp_path / "set", presses=3)
    with pytest.raises(WedgeError, match="shows no dots"):
        dot_cost(dataset)
