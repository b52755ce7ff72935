# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Presses of a rendered set, read with their truth."""

import numpy as np
import pytest

from recon.rendered_presses import depth_files, rendered_presses
from sensor.errors import WedgeError
from tests.synthetic import MM_PER_PX, gradient_of, make_rendered_set, shaded, true_depth_mm


def test_presses_come_in_order_with_what_changed_and_their_own_depth(tmp_path):
    made = make_rendered_set(tmp_path / "set", presses=3, noise_grey_levels=0)
    found = list(rendered_presses(made.folder))
    assert [press.name for press in found] == [path.stem for path in depth_files(made.folder)]
    for press, label in zip(found, made.labels, strict=True):
        assert press.mm_per_px == MM_PER_PX and press.name in label.file
        np.testing.assert_array_equal(press.depth_mm, true_depth_mm(label))
        np.testing.assert_array_equal(press.held, true_depth_mm(label) > 0)
        place = label.center_x_px, label.center_y_px, label.contact_radius_px
        change = shaded(gradient_of(place)) - shaded(gradient_of(None))
        pressed = press.depth_mm > 0
        assert np.abs(press.difference - change)[pressed].mean() < 0.005
        assert np.abs(change)[pressed].mean() > 0.03


@pytest.mark.parametrize("truth", ["truth", "held"])
def test_a_truth_of_another_size_is_refused(truth, tmp_path):
    made = make_rendered_set(tmp_path / "set", presses=2)
    first, last = depth_files(made.folder)
    np.save(made.folder / truth / last.name, np.zeros((3, 4)))
    presses = rendered_presses(made.folder)
    assert next(presses).name == first.stem
    with pytest.raises(WedgeError, match=rf"{truth}/{last.name} has another size"):
        next(presses)


def test_a_set_need_not_say_what_is_held(tmp_path):
    made = make_rendered_set(tmp_path / "set", presses=1)
    (made.folder / "held" / depth_files(made.folder)[0].name).unlink()
    (press,) = rendered_presses(made.folder)
    assert press.held is None
