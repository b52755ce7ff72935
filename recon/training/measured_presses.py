# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What calibrated sensors with few lights measure of rendered presses, beside what is true.

A formula for a sensor's errors leaves out what light does between the skin's folds. Here the frames
are traced, and the slopes are those of the estimators themselves, taught by the sensor's balls.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float32

from recon import unet
from recon.estimators import fit_estimator, gradient_field, lesson_of
from recon.lights import unseen_axis
from recon.missing_axis.moved import may_have_moved
from recon.pipeline import disturbed_in
from recon.presses import read_presses
from recon.rendered_presses import rendered_presses
from recon.training.contact_surfaces import surface_gradient
from recon.windows import window_about
from sensor.dataset import read_dataset
from sensor.errors import WedgeError

ESTIMATORS = ("mlp", "default")
LIGHTS = ("R", "RB")
LEAST_PX = 200
"""Of gel that may have moved: of less there is nothing to learn."""
MARGIN_PX = 8
DENTED_MM = 0.003


@dataclass(frozen=True, kw_only=True)
class MeasuredPress:
    """One press as one sensor measured it, cut to what moved; sides are whole strides."""

    maps: Float32[np.ndarray, "3 h w"]
    """As ``unet.network_input`` gives them."""
    truth: Float32[np.ndarray, "2 h w"]
    """The skin's slopes along x and y."""
    support: Float32[np.ndarray, "h w"]
    """1 where the sensor thinks that the gel may have moved."""

    def mirrored(self, rng: np.random.Generator) -> "MeasuredPress":
        """The same press the other way round, along x or y or both or neither."""
        maps, truth, support = self.maps.copy(), self.truth.copy(), self.support
        for axis, mirror in ((0, np.s_[..., ::-1]), (1, np.s_[..., ::-1, :])):
            if rng.random() < 0.5:
                maps, truth, support = maps[mirror], truth[mirror], support[mirror]
                maps[axis] *= -1
                truth[axis] *= -1
        return MeasuredPress(
            maps=np.ascontiguousarray(maps),
            truth=np.ascontiguousarray(truth),
            support=np.ascontiguousarray(support),
        )


def measured_presses(
    balls: Path, rendered: Sequence[Path], stride: int, seed: int
) -> Iterator[MeasuredPress]:
    """Each press as measured with one light and with two, by every estimator.

    Args:
        balls: a dataset of labelled presses, by which the estimators are calibrated.
        rendered: datasets of the same sensor with the skin's depth in truth/.
        stride: of the network.
        seed: of the calibrations.

    Raises:
        WedgeError: a dataset cannot be used, or its red and blue lights do not lie along y.
    """
    dataset = read_dataset(balls)
    if unseen_axis(dataset.card.lights_deg, "RB") != "x":
        raise WedgeError(f"{balls}: red and blue do not shine along y, so they hide no axis.")
    labelled = read_presses(dataset).presses
    sensors = []
    for name in ESTIMATORS:
        taught = lesson_of(name, labelled, range(len(labelled)), seed)
        sensors += [fit_estimator(name, taught, lit, seed) for lit in LIGHTS]
    for folder in rendered:
        for press in rendered_presses(folder):
            depth_px = (press.depth_mm / press.mm_per_px[0]).astype(np.float32)
            truth = surface_gradient(depth_px).astype(np.float32)
            dented = press.depth_mm > DENTED_MM
            for sensor in sensors:
                seen = gradient_field(sensor, press.difference)
                seen[..., 0] = 0
                support = may_have_moved(disturbed_in(press.difference, sensor), seen[..., 1])
                if support.sum() >= LEAST_PX:
                    yield _cut_to_what_moved(seen, truth, support, dented, stride)


def _cut_to_what_moved(
    measured: Float32[np.ndarray, "h w 2"],
    truth: Float32[np.ndarray, "h w 2"],
    support: Bool[np.ndarray, "h w"],
    dented: Bool[np.ndarray, "h w"],
    stride: int,
) -> MeasuredPress:
    """The window about what moved or seems to have moved, with flat gel up to whole strides."""
    maps = unet.network_input(measured, support, both=False)
    moved = support | dented
    rows, columns = window_about(moved, MARGIN_PX)
    flat = [(0, -(part.stop - part.start) % stride) for part in (rows, columns)]

    def cut(whole: np.ndarray) -> np.ndarray:
        return np.pad(whole[..., rows, columns], [(0, 0)] * (whole.ndim - 2) + flat)

    return MeasuredPress(
        maps=cut(maps), truth=cut(truth.transpose(2, 0, 1)), support=cut(support.astype(np.float32))
    )
