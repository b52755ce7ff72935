# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge evaluate`: the errors of one unit on a dataset."""

import sys
from pathlib import Path
from typing import Annotated

import tyro

from app._output import OutputFile, check_outputs, print_error_table, write_json
from app._progress import progress
from app._seed import Seed


def main(
    unit: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="UNIT")],
    dataset: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="DATASET")],
    seed: Seed = 0,
    json: OutputFile = None,
) -> None:
    """Measure the gradient and depth errors of a calibrated unit on the presses of a dataset.

    Every press is judged. On the dataset that the unit was calibrated with, the errors are those
    of presses it has seen, and a line says so.

    Example: wedge evaluate units/bench-001 taxim-gelsight

    Args:
        unit: A unit folder, written by `wedge calibrate`.
        dataset: A dataset folder, or a name that `wedge data list` knows.
        seed: Seed of the drawn pixels and the intervals.
        json: Write the numbers here as JSON.
    """
    from recon.calibration import load_calibration
    from sensor.dataset import read_dataset
    from validation.datasets import dataset_folder
    from validation.evaluation import evaluate_unit
    from validation.table_text import table_document

    check_outputs(json)
    calibration = load_calibration(unit)
    source = read_dataset(dataset_folder(dataset))
    with progress(f"evaluation on {dataset}") as show:
        measured = evaluate_unit(
            calibration, source, seed=seed, progress=lambda share: show(share, "measuring")
        )
    print_error_table(measured)
    if source.sha256 == calibration.card.dataset_sha256:
        print("The unit has learnt from these presses: nothing is held out.", file=sys.stderr)
    write_json(json, table_document(measured))
