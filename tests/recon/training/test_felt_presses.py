# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What estimators read off rendered presses, beside where the gel is held."""

import numpy as np
import pytest

from recon.contact.network import BEND_UNIT, DEPTH_UNIT_PX
from recon.rendered_presses import depth_files, rendered_presses
from recon.training import felt_presses
from recon.training.felt_presses import FeltPress, seen_anew
from sensor.errors import WedgeError
from tests.synthetic import MM_PER_PX, make_dataset, make_rendered_set

SIDE_PX = 64


@pytest.fixture
def quick(monkeypatch):
    """One estimator that is calibrated in no time, with all balls and with every second."""
    monkeypatch.setattr(felt_presses, "ESTIMATORS", ("table",))


def hill(height, width):
    """A smooth dent in the middle, slopes in closed form, held where it is deeper than half."""
    y, x = np.mgrid[:height, :width] - np.array([height, width])[:, None, None] / 2
    depth = 6 * np.exp(-(x**2 + (2 * y) ** 2) / 400)
    gradient = np.stack([-x / 200, -4 * y / 200], -1) * depth[..., None]
    return FeltPress(
        depth_px=depth.astype(np.float32), gradient=gradient.astype(np.float32), held=depth > 3
    )


def test_presses_are_felt_about_as_they_are(tmp_path, quick):
    balls = make_dataset(tmp_path / "balls", seed=1)
    made = make_rendered_set(tmp_path / "set", presses=2)
    felt = list(felt_presses.felt_presses(balls.folder, [made.folder], 0))
    assert len(felt) == 2 * len(felt_presses.EVERY)
    for press, truth in zip(felt[::2], rendered_presses(made.folder), strict=True):
        assert press.held.sum() == truth.held.sum()
        assert press.depth_px.shape == press.held.shape == press.gradient.shape[:2]
        y, x = np.argwhere(press.held).mean(0)  # where the ball is deepest and level
        middle = slice(int(y) - 3, int(y) + 4), slice(int(x) - 3, int(x) + 4)
        assert press.depth_px[middle].mean() > 0.8 * press.depth_px.max()
        assert np.abs(press.gradient[middle]).mean() < 0.15
        deepest_px = truth.depth_mm.max() / MM_PER_PX[0]
        assert press.depth_px.max() == pytest.approx(deepest_px, rel=0.35)
    assert (felt[0].gradient != felt[1].gradient).any()  # of another calibration


def test_what_no_colour_tells_of_is_not_felt(tmp_path, quick):
    balls = make_dataset(tmp_path / "balls", seed=1)
    made = make_rendered_set(tmp_path / "set", presses=2)
    for path in (made.folder / "held").iterdir():
        np.save(path, np.zeros_like(np.load(path)))
    assert not list(felt_presses.felt_presses(balls.folder, [made.folder], 0))


def test_a_set_that_does_not_know_what_is_held_is_refused(tmp_path, quick):
    balls = make_dataset(tmp_path / "balls", seed=1)
    made = make_rendered_set(tmp_path / "set", presses=2)
    name = depth_files(made.folder)[0].name
    (made.folder / "held" / name).unlink()
    with pytest.raises(WedgeError, match=rf"held/{name}.*render the set anew"):
        list(felt_presses.felt_presses(balls.folder, [made.folder], 0))


@pytest.mark.parametrize("shape", [(48, 40), (150, 170)])
@pytest.mark.parametrize("seed", range(8))
def test_slopes_depth_and_truth_are_turned_and_resized_together(seed, shape):
    maps, held = seen_anew(np.random.default_rng(seed), hill(*shape), SIDE_PX)
    assert maps.shape == (4, SIDE_PX, SIDE_PX) and held.shape == maps.shape[1:] and held.any()
    depth, inside = maps[2] * DEPTH_UNIT_PX, np.abs(maps[:2]).max(0) > 0.02
    inside[[0, -1]] = inside[:, [0, -1]] = False
    along_y, along_x = np.gradient(depth)
    steep = np.abs(maps[:2]).max()
    for seen, along in ((maps[0], along_x), (maps[1], along_y)):
        assert np.median(np.abs(seen - along)[inside]) < 0.02 * steep
    bend = (np.gradient(maps[0], axis=1) + np.gradient(maps[1], axis=0)) / BEND_UNIT
    assert np.median(np.abs(bend - maps[3])[inside]) < 0.02 * np.abs(maps[3]).max()
    # Depth at the edge of what is held is the same everywhere.
    assert depth[held].min() >= 0.85 * depth[~held].max()
