# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A table's row where nothing stands in for an axis: all of that axis's slope is its error."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from recon.pixels import label_pixels
from recon.presses import read_presses
from tests.synthetic import make_dataset
from validation.error_table import error_table


def test_an_axis_that_is_set_to_zero_is_wrong_by_all_of_its_slope(tmp_path):
    dataset = make_dataset(tmp_path / "set", presses=4)
    presses = read_presses(dataset).presses
    truth = [label_pixels(press, index, 0) for index, press in enumerate(presses)]
    slopes = np.concatenate([pixels.gradient for pixels in truth]).astype(float)
    with ThreadPoolExecutor(1) as executor:
        table = error_table(dataset.folder, ("table",), folds=2, seed=0, executor=executor)
    found = [
        row.errors.values["gx_mae"]
        for row in table.rows
        if (row.missing_axis, row.pixels) == ("zero", "contact+5%")
    ]
    assert found == pytest.approx([np.abs(slopes[:, 0]).mean()] * 2, abs=1e-6)
