# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A circle centred outside its frame costs its own press, and the file that draws it is named."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from recon.images import read_image, write_image
from recon.presses import LeftOut
from sensor.dataset import Dataset, read_dataset
from tests.app.commands import refused, run
from tests.synthetic import (
    BALL_RADIUS_MM,
    MM_PER_PX,
    digitized,
    gradient_of,
    make_dataset,
    shaded,
)
from tests.validation.importers.packs import circle, write_taxim
from validation.importers.calibrations import find_calibration, import_calibration

OUTSIDE = (-4.0, 42.5, 12.0)


@pytest.fixture(scope="module")
def truth(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return make_dataset(tmp_path_factory.mktemp("truth") / "set", presses=4)


def write_one_text(source: Path, truth: Dataset, circles: list[list[float]]) -> Path:
    for label in truth.labels:
        write_image(source / label.file, read_image(truth.folder / label.file))
    write_image(source / "background.png", read_image(truth.folder / "background.png"))
    lines = [
        " ".join([label.file, *map(str, drawn)])
        for label, drawn in zip(truth.labels, circles, strict=True)
    ]
    (source / "circles.txt").write_text("\n".join(["# name x y r", *lines]))
    return source


def write_gs_sdk(source: Path, truth: Dataset, circles: list[list[float]]) -> Path:
    lines = ["experiment_reldir,diameter(mm)"]
    for index, (label, (x, y, radius)) in enumerate(zip(truth.labels, circles, strict=True)):
        press = source / f"ball/{index}"
        write_image(press / "gelsight.png", read_image(truth.folder / label.file))
        np.savez(press / "label.npz", center=np.array([x, y]), radius=np.array(radius))
        lines.append(f"ball/{index},{2 * BALL_RADIUS_MM}")
    write_image(source / "background.png", read_image(truth.folder / "background.png"))
    (source / "catalog.csv").write_text("\n".join(lines) + "\n")
    return source


def write_pack(source: Path, truth: Dataset, circles: list[list[float]]) -> Path:
    drawn = np.array(circles)
    return write_taxim(truth, source, touch_center=drawn[:, :2], touch_radius=drawn[:, 2])


def left_out(source: Path, out: Path) -> list[LeftOut]:
    found = find_calibration(source)
    assert found is not None
    out.mkdir()
    scale = {"mm_per_px": MM_PER_PX[0], "ball_radius_mm": BALL_RADIUS_MM}
    return list(import_calibration(found, source, out, **scale))


@pytest.mark.parametrize(
    ("write", "drawn_in", "file"),
    [
        (write_one_text, "circles.txt, line 4", "press02.png"),
        (write_gs_sdk, "ball/2/label.npz", "press-0002.png"),
        (write_pack, "dataPack.npz", "frames.npz#2"),
    ],
)
def test_it_is_left_out_and_the_others_are_kept(
    write: Callable, drawn_in: str, file: str, truth: Dataset, tmp_path: Path
) -> None:
    circles = [circle(label) for label in truth.labels]
    circles[2] = list(OUTSIDE)
    source = write(tmp_path / "source", truth, circles)
    (left,) = left_out(source, tmp_path / "out")
    assert left.file == file
    assert left.reason == (
        f"its circle ({drawn_in}) is centred outside the 120x90 frame, at (-4, 42.5)"
    )
    kept = [label.file for label in read_dataset(tmp_path / "out").labels]
    assert len(kept) == len(truth.labels) - 1 and file not in kept


def imported(source: Path) -> tuple[object, ...]:
    out = source.with_name("out")
    scale = ("--mm-per-px", MM_PER_PX[0], "--ball-radius-mm", BALL_RADIUS_MM)
    return ("data", "import", source, "--out", out, *scale)


def test_the_command_names_it_like_other_presses_that_cannot_be_used(
    truth: Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    circles = [circle(label) for label in truth.labels]
    circles[0] = list(OUTSIDE)
    assert run(*imported(write_one_text(tmp_path / "source", truth, circles))) == 0
    said = capsys.readouterr().err.splitlines()
    assert said[-2] == "left out 1 press:"
    assert said[-1].startswith("  press00.png: its circle (circles.txt, line 2) is centred outside")


def test_a_source_with_no_other_circle_is_refused_by_that_file(
    truth: Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = write_one_text(tmp_path / "source", truth, [list(OUTSIDE)] * len(truth.labels))
    said = refused(capsys, *imported(source))
    assert f"{source} has no circle in its frame" in said and "circles.txt, line 2" in said
    assert "labels.csv" not in said and not (tmp_path / "out").exists()


def test_nor_do_other_refusals_name_a_table_that_is_not_there(
    truth: Dataset, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = write_one_text(tmp_path / "source", truth, [circle(x) for x in truth.labels])
    for label in truth.labels:
        write_image(source / label.file, read_image(truth.folder / "background.png"))
    said = refused(capsys, *imported(source))
    assert f"{source} names no press that can be used" in said and "labels.csv" not in said


def test_a_circle_that_moves_out_of_the_frame_as_it_is_refitted_is_left_out(
    truth: Dataset, tmp_path: Path
) -> None:
    circles = [circle(label) for label in truth.labels]
    circles[1] = [1.0, 45.0, 16.0]
    source = write_one_text(tmp_path / "source", truth, circles)
    write_image(source / truth.labels[1].file, digitized(shaded(gradient_of((-3.0, 45.0, 16.0)))))
    (left,) = left_out(source, tmp_path / "out")
    assert left.file == truth.labels[1].file
    assert left.reason == "its circle, once refitted, is centred outside the frame"
    assert len(read_dataset(tmp_path / "out").labels) == len(truth.labels) - 1
