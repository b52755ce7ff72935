# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Whoever reads a file while it is written anew reads a whole one."""

from dataclasses import replace

import numpy as np
import pytest

from recon.images import write_image
from sensor.dataset import BallLabel, DatasetCard, write_card, write_labels
from sensor.unit import write_unit_card
from tests.sensor.test_unit import CARD

SET = DatasetCard(
    name="a set",
    source="a lab",
    licence="CC-BY-4.0",
    mm_per_px=(0.1, 0.1),
    ball_radius_mm=4.0,
    background=("background.png",),
)
LABEL = BallLabel(file="a.png", center_x_px=30.0, center_y_px=20.5, contact_radius_px=10.0)


@pytest.mark.parametrize(
    ("name", "write"),
    [
        ("unit.toml", lambda path, n: write_unit_card(path.parent, replace(CARD, serial=f"w-{n}"))),
        ("dataset.toml", lambda path, n: write_card(path, replace(SET, name=f"set {n}"))),
        ("labels.csv", lambda path, n: write_labels(path, [LABEL] * (3 - n))),
        ("a.png", lambda path, n: write_image(path, np.full((9, 9, 3), n, np.uint8))),
    ],
    ids=["unit", "dataset", "labels", "image"],
)
def test_who_opened_the_old_file_reads_it_to_its_end(tmp_path, name, write):
    path = tmp_path / name
    write(path, 1)
    old = path.read_bytes()
    with path.open("rb") as opened:
        write(path, 2)
        assert opened.read() == old
    assert path.read_bytes() != old
