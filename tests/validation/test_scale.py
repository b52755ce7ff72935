# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Two rulers that know nothing of each other agree on a real sensor."""

import shutil
from pathlib import Path

import pytest

from validation.datasets import DATASETS, shared_folder
from validation.importers.wedge_lab import import_wedge_lab
from validation.scale import GAP_MM, NAME, PICTURES, measure

PRESSES = 2


def test_the_caliper_makes_the_printed_grid_square(tmp_path: Path) -> None:
    known = next(dataset for dataset in DATASETS if dataset.name == NAME)
    if known.find() is None:
        pytest.skip(f"{NAME} is absent: {known.sought}")
    pictures = sorted((shared_folder() / NAME).glob(PICTURES))
    source, folder = tmp_path / "source", tmp_path / "set"
    (source / "calibration" / "ball_position").mkdir(parents=True)
    folder.mkdir()
    few = [f"ball-{8 * i}.jpg" for i in range(PRESSES)]
    texts = [f"ball_position/{Path(name).stem}.txt" for name in few]
    for name in ("bg-0.jpg", *few, *texts):
        shutil.copy(shared_folder() / NAME / "calibration" / name, source / "calibration" / name)
    import_wedge_lab(source, folder)
    rulers = measure(folder, pictures, GAP_MM)
    assert len(rulers.gaps) == len(pictures) == 5
    along, across = rulers.grid_mm
    sigma = [
        s / mm for s, mm in zip(rulers.scale.sigma_mm_per_px, rulers.scale.mm_per_px, strict=True)
    ]
    assert along / across == pytest.approx(1, abs=2 * (sigma[0] ** 2 + sigma[1] ** 2) ** 0.5)
    assert max(sigma) < 0.02
