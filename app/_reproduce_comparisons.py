# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What `wedge reproduce` sets side by side: estimators, the twin and sensors, known depth."""

from collections.abc import Sequence
from concurrent.futures import Executor
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from app._progress import progress
from sensor.dataset import read_dataset
from sensor.design_file import load_design

if TYPE_CHECKING:
    from recon.calibration import Calibration
    from validation.report.page import Section
    from validation.report.results import DatasetResults
    from validation.shapes import Shape
    from validation.side_by_side import Unseen


REAL = ("wedge-lab", "wedge-mit-sphere", "taxim-gelsight")
"""Sets whose light is compared with that of rendered ones."""


def fit_unit(folder: Path, serial: str, seed: int, estimator: str) -> "Calibration":
    """Calibrate on every press of a dataset."""
    from recon.calibration import calibrate
    from recon.presses import read_presses

    dataset = read_dataset(folder)
    presses = read_presses(dataset)
    return calibrate(
        dataset,
        presses,
        estimator=estimator,
        serial=serial,
        created=datetime.now(UTC).date().isoformat(),
        metrics={"fitted_presses": len(presses.presses)},
        seed=seed,
    )


def shapes_by_estimator(
    folder: Path,
    unit: "Calibration",
    others: Sequence[str],
    seed: int,
    executor: Executor,
) -> "dict[str, list[Shape]]":
    """Shapes by a unit and by other estimators that learnt from the same balls alone."""
    from validation.shapes import measure_shapes

    fits = [executor.submit(fit_unit, folder, unit.card.serial, seed, name) for name in others]
    with progress(f"shapes of {unit.card.serial}") as show:
        measured = {unit.card.estimator: executor.submit(measure_shapes, folder, unit)}
        for name, fit in zip(others, fits, strict=True):
            measured[name] = executor.submit(measure_shapes, folder, fit.result())
        found = {}
        for done, (name, future) in enumerate(measured.items(), start=1):
            found[name] = future.result()
            show(done / len(measured), name)
    return found


def beside_each_other(
    measured: "DatasetResults", others: Sequence[str], seed: int, executor: Executor
) -> "list[Unseen]":
    """Contact pixels of the first fold by every estimator; the first one's are there already."""
    from validation.side_by_side import unseen_slopes

    folder, name = measured.dataset.folder, measured.dataset.card.name
    with progress(f"estimators on {name}") as show:
        futures = [
            executor.submit(unseen_slopes, folder, measured.table.folds_fitted[estimator][0], seed)
            for estimator in others
        ]
        found = [measured.held_out.unseen]
        for future in futures:
            found.append(future.result())
            show(len(found) / (1 + len(others)), found[-1].estimator)
    return found


def twins_beside_sensors(twins: Sequence[str], executor: Executor) -> "Section":
    """The rendered sets beside what real ones are here, and networks that cross over."""
    from simulation.raw_view import pad_corners_px
    from validation.datasets import dataset_folder, known_datasets
    from validation.fidelity import likeness, transfer
    from validation.report.fidelity import fidelity_section

    with progress("twin beside sensors") as show:
        known = known_datasets()
        folders = {
            name: dataset_folder(name)
            for name in (*twins, *REAL)
            if name in known and known[name].find() is not None
        }
        corners = {name: pad_corners_px(load_design(name.removeprefix("twin-"))) for name in twins}
        sensors = [
            executor.submit(likeness, folder, corners.get(name)) for name, folder in folders.items()
        ]
        wanted = ("twin-standard", "wedge-lab", "twin-finger")
        crossing = [name for name in wanted if name in folders][:2]
        transfers = [
            executor.submit(transfer, folders[learnt], folders[judged])
            for learnt in crossing
            for judged in crossing
        ]
        found = []
        for done, future in enumerate(transfers, start=1):
            found.append(future.result())
            show(done / len(transfers), f"{found[-1].learnt} on {found[-1].judged}")
        return fidelity_section([future.result() for future in sensors], found)


def known_depth(name: str, unit: "Calibration") -> "Section":
    """Presses of known depth, reconstructed by a unit that has seen none of them."""
    from recon.presses import read_presses
    from validation.datasets import dataset_folder
    from validation.examples import example
    from validation.report.results import known_depth_section

    card = unit.card
    with progress(name) as show:
        dataset = read_dataset(dataset_folder(name))
        presses = read_presses(dataset)
        examples = []
        for done, press in enumerate(presses.presses, start=1):
            examples.append(example(unit.estimator, card.missing_axis, dataset, presses, press))
            show(done / len(presses.presses), press.file)
    learnt_from = f"the {card.metrics['fitted_presses']} presses of {card.dataset}"
    return known_depth_section(dataset, examples, card.estimator, learnt_from)
