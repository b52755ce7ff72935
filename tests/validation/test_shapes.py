# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Shapes of known depth are judged against their truth, wherever the skin is pressed."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app._reproduce_comparisons import shapes_by_estimator
from recon.ball import ball_cap
from recon.calibration import Calibration, unit_of_set
from recon.images import read_image, write_image
from sensor.errors import WedgeError
from tests.synthetic import MM_PER_PX, SIZE_PX, make_dataset
from validation.figures.png import png_bytes
from validation.figures.shapes import shape_figure
from validation.report.shapes import shapes_section
from validation.shapes import Shape, measure_shapes


@pytest.fixture(scope="module")
def taught(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Calibration]:
    """A synthetic set, one press of which appears once more as a shape, and a unit of the rest."""
    folder = tmp_path_factory.mktemp("set")
    dataset = make_dataset(folder, presses=8)
    unit = unit_of_set(dataset, "table")
    label = dataset.labels[0]
    cap = ball_cap(
        SIZE_PX,
        label.center_px,
        label.contact_radius_px * MM_PER_PX[0],
        dataset.card.ball_radius_mm,
        MM_PER_PX,
    )
    write_image(folder / "cap.jpg", read_image(folder / label.file))
    (folder / "truth").mkdir()
    np.save(folder / "truth" / "cap.npy", cap.depth_mm.astype(np.float32))
    np.save(folder / "truth" / "press01.npy", cap.depth_mm.astype(np.float32))  # a labelled one
    return folder, unit


def test_a_shape_is_found_where_it_is(taught: tuple[Path, Calibration]) -> None:
    (shape,) = measure_shapes(*taught)
    assert shape.name == "cap"
    assert shape.rmse_mm < 0.15 * shape.truth_mm.max()
    assert abs(shape.bias_mm) <= shape.rmse_mm


def test_errors_are_those_of_the_pressed_skin(taught: tuple[Path, Calibration]) -> None:
    (shape,) = measure_shapes(*taught)
    shifted = replace(shape, depth_mm=shape.truth_mm + np.where(shape.touched, 0.03, 9.0))
    for error in (shifted.rmse_mm, shifted.bias_mm, shifted.peak_error_mm):
        assert error == pytest.approx(0.03, abs=1e-6)


def test_estimators_that_learnt_alike_reconstruct_alike(taught: tuple[Path, Calibration]) -> None:
    folder, unit = taught
    ours = replace(unit, card=replace(unit.card, estimator="ours"))
    with ThreadPoolExecutor(1) as executor:
        found = shapes_by_estimator(folder, ours, ("table",), 0, executor)
    assert list(found) == ["ours", "table"]
    assert found["ours"][0].rmse_mm == found["table"][0].rmse_mm > 0


def test_a_truth_of_another_size_is_refused(taught: tuple[Path, Calibration]) -> None:
    folder, unit = taught
    wrong = folder / "truth" / "other.npy"
    write_image(folder / "other.jpg", read_image(folder / "cap.jpg"))
    np.save(wrong, np.ones((3, 4), np.float32))
    with pytest.raises(WedgeError, match=r"other\.npy does not hold 90 rows of 120 "):
        measure_shapes(folder, unit)
    wrong.unlink()


def test_the_section_names_every_shape_and_its_picture_is_whole() -> None:
    def one(name: str, half: int) -> Shape:
        truth = np.zeros((60, 80))
        truth[30 - half : 30 + half, 38 - half : 42 + half] = 0.5
        frame = np.full((60, 80, 3), 0.5, np.float32)
        return Shape(
            name=name, file=f"{name}.jpg", frame=frame, difference=frame * 0,
            depth_mm=truth * 0.9, truth_mm=truth,
            mm_per_px=(0.1, 0.1),
        )  # fmt: skip

    shapes = [one("lego", 5), one("m2_screw", 29)]
    section = shapes_section({"twin-standard": {"ours": shapes, "other": shapes}})
    assert "M2 screw, twin-standard" in section.html and "Lego, twin-standard" in section.html
    assert "−0.050" in section.html
    assert png_bytes(shape_figure(shapes)) == png_bytes(shape_figure(shapes))
