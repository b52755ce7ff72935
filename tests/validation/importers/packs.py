# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A dataset written as Taxim's data pack."""

from pathlib import Path

import numpy as np

from recon.images import read_image
from sensor.dataset import BallLabel, Dataset


def circle(label: BallLabel) -> list[float]:
    return [label.center_x_px, label.center_y_px, label.contact_radius_px]


def write_taxim(truth: Dataset, source: Path, **parts: np.ndarray) -> Path:
    """Writes ``dataPack.npz``, with some of its arrays replaced by ``parts``."""
    source.mkdir()
    frames = [read_image(truth.folder / label.file)[..., ::-1] for label in truth.labels]
    arrays = {
        "f0": read_image(truth.folder / "background.png")[..., ::-1],
        "imgs": np.stack(frames),
        "touch_center": np.array([circle(label)[:2] for label in truth.labels]),
        "touch_radius": np.array([circle(label)[2] for label in truth.labels]),
        "names": np.array(["a", "b"]),
    }
    np.savez(source / "dataPack.npz", **{**arrays, **parts})
    return source
