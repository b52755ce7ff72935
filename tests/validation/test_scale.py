# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Two rulers that know nothing of each other agree on a real sensor."""

import pytest

from validation.datasets import DATASETS, dataset_folder, shared_folder
from validation.scale import GAP_MM, NAME, PICTURES, measure


def test_the_caliper_makes_the_printed_grid_square() -> None:
    known = next(dataset for dataset in DATASETS if dataset.name == NAME)
    if known.find() is None:
        pytest.skip(f"{NAME} is absent: {known.sought}")
    pictures = sorted((shared_folder() / NAME).glob(PICTURES))
    rulers = measure(dataset_folder(NAME), pictures, GAP_MM)
    assert len(rulers.gaps) == len(pictures) == 5
    along, across = rulers.grid_mm
    sigma = [
        s / mm for s, mm in zip(rulers.scale.sigma_mm_per_px, rulers.scale.mm_per_px, strict=True)
    ]
    assert along / across == pytest.approx(1, abs=2 * (sigma[0] ** 2 + sigma[1] ** 2) ** 0.5)
    assert max(sigma) < 0.02
