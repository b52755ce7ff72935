# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Good sensors to accept, and ways to break them."""

import numpy as np
from scipy import ndimage

from recon.calibration import calibrate
from recon.images import read_image, write_image
from recon.presses import read_presses
from sensor.dataset import read_dataset
from tests.dotted import dotted, grid_px
from tests.synthetic import SIZE_PX, make_dataset
from validation.acceptance.limits import grades
from validation.acceptance.measurements import accept_unit

PRESSES = 12
TEXTURE = 1 + 0.1 * ndimage.gaussian_filter(
    np.random.default_rng(5).standard_normal((90, 120, 1)), (1.5, 1.5, 0)
)
"""Of a real film: without any, nobody could see that the picture has moved."""


def good_set(folder, seed=0, **options):
    dataset = make_dataset(folder, presses=PRESSES, seed=seed, **options)
    change_frames(dataset, lambda frame, _: frame * TEXTURE)
    return read_dataset(folder)


def change_frames(dataset, change, *, blank_too=True):
    """Rewrite frames; ``change`` takes and gives float grey levels, and is told the index."""
    names = [*dataset.card.background, *(label.file for label in dataset.labels)]
    for index, name in enumerate(names[0 if blank_too else 1 :]):
        frame = change(read_image(dataset.folder / name).astype(float), index)
        levels = np.clip(np.round(frame), 0, 255).astype(np.uint8)
        write_image(dataset.folder / name, levels)


def unit_of(dataset, estimator="table", **metrics):
    return calibrate(
        dataset,
        read_presses(dataset),
        estimator=estimator,
        serial="wedge-007",
        created="2026-01-01",
        metrics={"fitted_presses": PRESSES, **metrics},
        seed=0,
    )


def accepted_on(calibration, dataset, **options):
    return accept_unit(calibration, dataset, seed=0, **options)


def failed_of(found):
    return {name for name, grade in grades(found.values).items() if grade == "fail"}


def dotted_set(folder, seed=0, presses=PRESSES):
    """Presses of a marker gel, whose dots stay where they are."""
    places = grid_px(15.0, margin_px=8.0, size=SIZE_PX)
    dataset = make_dataset(folder, presses=presses, seed=seed)
    change_frames(
        dataset,
        lambda frame, _: 255 * dotted(places, 2.0, frame / 255, noise=0.0, darkness=0.85),
    )
    return read_dataset(folder)
