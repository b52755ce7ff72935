# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

import numpy as np
from PIL import Image

from recon.images import read_frame
from recon.presses import read_presses
from tests.synthetic import make_dataset
from validation import plausible
from validation.shapes import known_shapes


def test_presses_that_a_gel_felt_are_told_from_their_mirror_images(tmp_path):
    dataset = make_dataset(tmp_path / "set", presses=12)
    rows = {row["frames"]: row for row in plausible.called_implausible(str(dataset.folder), "mlp")}
    count = len(read_presses(dataset).presses)
    assert [rows[how]["n"] for how in plausible.ALTERED] == [count] * len(plausible.ALTERED)
    assert rows["gray"]["n"] == plausible.FOLDS and "shapes" not in rows
    assert rows["blank"]["n"] == plausible.BLANKS * plausible.FOLDS
    assert rows["faint"]["n"] == count
    assert rows["blank"]["implausible"] == rows["faint"]["implausible"] == 0
    assert rows["faint"]["most"] > plausible.MOST_OFF  # the noise of what hardly touches
    right = rows.pop("as they are")
    assert right["implausible"] == 0
    share = "share of no surface, median"
    assert all(rows[how][share] > 2 * right[share] for how in ("mirrored", "blue for red"))


def test_rendered_shapes_are_those_whose_depth_is_known_and_that_no_circle_labels(tmp_path):
    dataset = make_dataset(tmp_path / "set", presses=3)
    (dataset.folder / "truth").mkdir(exist_ok=True)
    first = dataset.labels[0].file
    Image.fromarray(read_frame(dataset.folder, first)).save(dataset.folder / "cone.jpg")
    depth_mm = np.ones(read_presses(dataset).presses[0].difference.shape[:2])
    for stem in ("cone", Path(first).stem):
        np.save(dataset.folder / "truth" / f"{stem}.npy", depth_mm)
    assert [shape.name for shape in known_shapes(dataset)] == ["cone"]
