# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge evaluate`: the errors of units on data sets, and what has moved between them."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from app._output import (
    OutputFile,
    keep_inputs,
    print_error_table,
    print_left_out,
    print_rows,
    print_table,
    refuse_unit_folder,
)
from app._progress import progress
from app._seed import Seed
from sensor.dataset import read_dataset
from sensor.errors import WedgeError
from sensor.files import check_outputs, write_json
from sensor.unit import UNIT_FILE

if TYPE_CHECKING:
    from recon.calibration import Calibration
    from validation.drift import Evaluation, Move, Pairing
    from validation.shape_errors import ShapeErrors


def main(
    what: Annotated[
        tyro.conf.Positional[tuple[str, ...]], tyro.conf.arg(metavar="UNIT... DATASET...")
    ],
    out: Path | None = None,
    seed: Seed = 0,
    json: OutputFile = None,
) -> int:
    """Measure the gradient and depth errors of a calibrated unit on the presses of a dataset.

    Every press is judged. Errors are too low on presses the unit was calibrated on; a line reports
    how many there are. Of frames without a circle whose depth is in truth/, such as the shapes of
    `wedge simulate`, the depth is judged where the skin is pressed.

    Name several units, or several datasets in the order of their dates, and every unit is measured
    on every dataset of its frame size. A number is reported if it differs from the unit's first
    dataset by more than the presses scatter: the errors (compared with the first dataset that the
    unit was not calibrated on), the noise, the brightness of the untouched gel, and each colour's
    response to slope. This tells a drifting sensor from one day of bad presses.

    A unit and a dataset that do not fit each other are left out, each with a line. If one of them
    fits no other, or cannot be used, the exit status is 2.

    Example: wedge evaluate units/bench-001 taxim-gelsight

    Example: wedge evaluate units/wedge-001 presses/may presses/june presses/july --out drift

    Args:
        what: Unit folders, written by `wedge calibrate`, and dataset folders or names from
            `wedge data list`.
        out: Write a page here that plots every number over the datasets.
        seed: Seed for drawing pixels and for the intervals.
        json: Write the numbers here as JSON.
    """
    from validation.drift import moves
    from validation.report.drift import drift_document
    from validation.report.shape_errors import shape_document

    units, datasets = _units_and_datasets(what)
    refuse_unit_folder(out)
    page = None if out is None else out / "index.html"
    check_outputs(page, json)
    keep_inputs(what, [json])
    found, shapes, refused = _measured(units, datasets, seed)
    if not found and not shapes:
        raise WedgeError(refused[0]["reason"])
    moved = moves(found)
    several = len(units) * len(datasets) > 1
    document = drift_document(found, moved, refused) if several else {}
    if found and several:
        _tell_several(found, moved)
    elif found:
        _tell_one(found[0])
        document = _document_of_one(found[0])
    if shapes:
        document["shapes"] = [shape_document(item) for item in shapes]
        _tell_shapes(shapes, found, several=several)
    write_json(json, document)
    for line in refused:
        print(f"left out: {line['reason']}", file=sys.stderr)
    if out is not None:
        _write_page(out, found, moved, shapes)
        print(f"Page: {page}")
    return 2 if any(_fits_none(line, [*found, *shapes]) for line in refused) else 0


def _units_and_datasets(what: Sequence[str]) -> tuple[list[Path], list[str]]:
    """Tell unit folders from datasets, of which each is taken once.

    Raises:
        WedgeError: there is no unit, or no dataset.
    """
    from validation.datasets import each_once

    units = [Path(name) for name in what if (Path(name) / UNIT_FILE).is_file()]
    datasets = each_once(name for name in what if not (Path(name) / UNIT_FILE).is_file())
    if not what:
        raise WedgeError("name a unit folder, written by wedge calibrate, and a dataset.")
    if not units or not datasets:
        raise WedgeError(
            f"{' '.join(what)} names no {'dataset' if units else 'unit folder'}: "
            "wedge evaluate needs a unit folder, written by wedge calibrate, and a dataset."
        )
    return units, datasets


def _measured(
    units: Sequence[Path], datasets: Sequence[str], seed: int
) -> "tuple[list[Evaluation], list[ShapeErrors], list[dict[str, str]]]":
    """Each unit on each dataset: its presses, its shapes; and what does not fit, with the reason.

    Raises:
        WedgeError: a unit cannot be read, or two have one serial.
    """
    from recon.calibration import load_calibration
    from validation.datasets import told_apart

    calibrations = [load_calibration(folder) for folder in units]
    _refuse_namesakes(units, calibrations)
    called = told_apart(datasets)
    found: list[Evaluation] = []
    shapes: list[ShapeErrors] = []
    refused: list[dict[str, str]] = []
    for calibration in calibrations:
        for name in datasets:
            try:
                presses, shown = _evaluated(calibration, name, called[name], seed)
                found += presses
                shapes += shown
            except WedgeError as error:
                words = {"unit": calibration.card.serial, "dataset": called[name]}
                refused.append({**words, "reason": str(error)})
    return found, shapes, refused


def _tell_one(item: "Evaluation") -> None:
    """Print the errors of one unit on one dataset, and what is to be known of them."""
    from validation.intervals import counted
    from validation.report.drift import lit_otherwise, pictures_moved

    print_error_table(item.errors)
    if learnt := item.learnt:
        test = item.errors.test
        which = f"{learnt} of the" if learnt < test else "all" if test > 1 else "the"
        print(
            f"The unit was calibrated on {which} {counted(test)}: its errors there are too low.",
            file=sys.stderr,
        )
    for sentence in (*pictures_moved([item]), *lit_otherwise([item])):
        print(sentence, file=sys.stderr)


def _document_of_one(item: "Evaluation") -> dict[str, Any]:
    from validation.table_text import table_document

    return table_document(item.errors) | {
        "unit": item.unit,
        "held_out": item.held_out,
        "learnt_presses": item.learnt,
        "moved_px": item.moved_px,
        "lit_otherwise": list(item.lit_otherwise),
    }


def _tell_several(found: "Sequence[Evaluation]", moved: "Sequence[Move]") -> None:
    """Print a line for each unit on each dataset, and what has moved."""
    from validation.report.drift import summary, verdict

    print_table(*summary(found))
    if not all(item.held_out for item in found):
        print("* calibrated on some or all of these presses: its errors there are too low.")
    for sentence in verdict(found, moved):
        print(sentence)
    for name, left_out in {item.dataset: item.errors.left_out for item in found}.items():
        if left_out:
            print(f"{name}: ", end="", file=sys.stderr)
            print_left_out(left_out)


def _tell_shapes(
    shapes: "Sequence[ShapeErrors]", found: "Sequence[Evaluation]", *, several: bool
) -> None:
    """Print the depth errors of every shape, or of several pairs their means.

    Args:
        shapes: of each unit on each dataset that has some.
        found: whose datasets have been told of already.
        several: whether several pairs were named.
    """
    from validation.report.drift import lit_otherwise, pictures_moved
    from validation.report.shape_errors import HEADINGS, shape_rows, shape_sentence, shape_summary

    if several:
        print_table(*shape_summary(shapes))
    else:
        print_rows(HEADINGS, shape_rows(shapes[0]), ", in the file of --json")
        print(shape_sentence(shapes[0]))
    for name, left_out in {item.dataset: item.left_out for item in shapes}.items():
        if left_out:
            print(f"{name}: " if several else "", end="", file=sys.stderr)
            print_left_out(left_out)
    told = {(item.unit, item.dataset) for item in found}
    others = [item for item in shapes if (item.unit, item.dataset) not in told]
    for sentence in (*pictures_moved(others), *lit_otherwise(others)):
        print(sentence, file=sys.stderr)


def _write_page(
    out: Path,
    found: "Sequence[Evaluation]",
    moved: "Sequence[Move]",
    shapes: "Sequence[ShapeErrors]",
) -> None:
    from validation.report.drift import drift_sections
    from validation.report.page import write_report
    from validation.report.shape_errors import shape_section

    write_report(
        out,
        title="Units over data sets",
        lead="Written by wedge evaluate; data sets in the order in which they were named.",
        sections=[
            *(drift_sections(found, moved) if found else ()),
            *([shape_section(shapes)] if shapes else ()),
        ],
    )


def _fits_none(left_out: dict[str, str], found: "Sequence[Pairing]") -> bool:
    """Whether a unit or a dataset of a pair that was left out is measured in no other pair."""
    units, datasets = {item.unit for item in found}, {item.dataset for item in found}
    return left_out["unit"] not in units or left_out["dataset"] not in datasets


def _refuse_namesakes(units: Sequence[Path], calibrations: "Sequence[Calibration]") -> None:
    """Refuse two units of one serial, by which what has moved is told.

    Raises:
        WedgeError: names both folders.
    """
    seen: dict[str, Path] = {}
    for folder, calibration in zip(units, calibrations, strict=True):
        serial = calibration.card.serial
        if serial in seen:
            raise WedgeError(
                f"{seen[serial]} and {folder} are both unit {serial}, and their results would be "
                "mixed up: evaluate them one at a time."
            )
        seen[serial] = folder


def _evaluated(
    calibration: "Calibration", name: str, called: str, seed: int
) -> "tuple[list[Evaluation], list[ShapeErrors]]":
    """A unit on the presses of a dataset, unless it shows shapes alone; and on its shapes."""
    from validation.datasets import dataset_folder
    from validation.drift import evaluate_on
    from validation.shape_errors import judge_shapes
    from validation.shapes import shape_files

    source = read_dataset(dataset_folder(name))
    shown = bool(shape_files(source))
    pressed = bool(source.labels) or not shown
    each = 1 / (pressed + shown)
    presses, shapes = [], []
    with progress(f"{calibration.card.serial} on {called}") as show:
        if pressed:
            presses.append(
                evaluate_on(
                    calibration,
                    source,
                    seed=seed,
                    called=called,
                    progress=lambda share: show(each * share, "measuring"),
                )
            )
        if shown:
            shapes.append(
                judge_shapes(
                    calibration,
                    source,
                    seed=seed,
                    called=called,
                    progress=lambda share: show(1 - each + each * share, "measuring shapes"),
                )
            )
    return presses, shapes
