# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge calibrate`: ball presses to a unit folder."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import tyro

from app._output import OutputFile, check_outputs, print_error_table, write_json
from app._progress import progress
from app._seed import Seed
from sensor.errors import WedgeError


def main(
    dataset: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="DATASET")],
    out: Path,
    estimator: str = "default",
    design: str = "standard",
    seed: Seed = 0,
    json: OutputFile = None,
) -> None:
    """Calibrate one sensor from ball presses and write its unit folder.

    The errors are measured first, on presses that the estimator has not seen (8 of 40, or a
    fifth); the estimator that is kept is then fitted to all presses. The unit folder's name
    becomes the unit's serial.

    Example: wedge calibrate taxim-gelsight --out units/bench-001

    Args:
        dataset: A dataset folder, or a name that `wedge data list` knows.
        out: The unit folder to write; it must not exist, or be empty.
        estimator: default (ours), mlp (the paper's network) or table (the lookup table that it
            replaced).
        design: The design the sensor was built from: standard, finger or a .toml file.
        seed: Seed of the split, drawn pixels and training.
        json: Write the errors on the held-out presses here as JSON.
    """
    from recon.calibration import calibrate
    from recon.presses import read_presses
    from sensor.dataset import read_dataset
    from sensor.design_file import load_design
    from sensor.files import refuse_kept_folder
    from validation.datasets import dataset_folder
    from validation.evaluation import held_out_metrics, hold_out
    from validation.table_text import table_document

    if out.name in ("", ".."):
        raise WedgeError(f"--out {out} has no name to call the unit by: name a new folder.")
    refuse_kept_folder(out)
    check_outputs(out / "unit.toml", json)
    built_from = load_design(design)
    source = read_dataset(dataset_folder(dataset))
    with progress(f"calibration on {dataset}") as show:
        presses = read_presses(source, lambda share: show(0.2 * share, "reading presses"))
        measured = hold_out(
            source,
            presses,
            estimator,
            seed=seed,
            progress=lambda share: show(0.2 + 0.4 * share, "measuring held-out presses"),
        )
        unit = calibrate(
            source,
            presses,
            estimator=estimator,
            serial=out.resolve().name,
            created=datetime.now(UTC).date().isoformat(),
            metrics=held_out_metrics(measured, fitted_presses=len(presses.presses)),
            seed=seed,
            design=built_from,
            progress=lambda share: show(0.6 + 0.4 * share, "fitting all presses"),
        )
        unit.save(out)
    print_error_table(measured)
    print(f"Unit folder: {out}")
    write_json(json, table_document(measured))
