# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge reproduce`: everything the project claims, measured again on this machine."""

import os
import platform
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from app._fabricate import MANIFEST, MissingExtraError, fabricate
from app._output import print_table
from app._progress import progress
from app._reproduce_comparisons import (
    beside_each_other,
    fit_unit,
    known_depth,
    shapes_by_estimator,
    twins_beside_sensors,
)
from app._reproduce_touch import TWIN, touch_sections
from app._seed import Seed
from app._workers import process_pool
from sensor.dataset import read_dataset
from sensor.design_file import load_design
from sensor.errors import WedgeError
from sensor.files import check_new_folder, write_atomic, write_json
from sensor.unit import GRADIENTS_FILE

if TYPE_CHECKING:
    from recon.calibration import Calibration
    from recon.estimators import GradientEstimator
    from validation.datasets import KnownDataset
    from validation.few_lights import Touch
    from validation.report.page import Section
    from validation.report.results import DatasetResults
    from validation.shapes import Shape
    from validation.side_by_side import Unseen

TWINS = ("twin-standard", "twin-finger")
NAMES = ("taxim-gelsight", *TWINS, "wedge-lab", "known-depth")
DESIGNS = ("standard", "finger")
TWIN_FOLDS = 1
"""Rendered presses are judged on the paper's one split: they add breadth, not certainty."""
KNOWN_DEPTH = {"known-depth": "known-depth-spheres"}
"""Presses of known depth, by the set that their unit learns from. It is there for its depth: its
lights do not sit as the Wedge's, so that it is judged with all of them alone."""
ESTIMATORS = ("default", "mlp", "table")
"""The first makes the units, the masks and the pictures."""
SIDE_BY_SIDE = ("taxim-gelsight", "wedge-lab")
"""Real sets on which every estimator is looked at closely."""
FEW_LIGHTS = ("ball_array", "lego", "m2_screw", "screw_cap")
"""Shapes that are shown with one light, two and three."""
THINGS = ("cube corner", "shallow texture", "textured bead")
"""Objects of known pose that are followed step by step."""
SAMPLES = (15, 30, 60, 120, 240)
PACKAGES = ("gelsight-wedge", "numpy", "scipy", "torch", "opencv-contrib-python-headless")


def main(out: Path = Path("build"), folds: int = 5, seed: Seed = 0) -> int:
    """Make the files of both sensors, calibrate on real presses, and write a page that shows it.

    First come the files to build both designs, with their checks; they need the extra `cad` and
    are left out without it.

    Then comes every known set on this machine: always the bench GelSight and the rendered sets of
    both designs, and sets that may not be redistributed if they are here (`wedge data list` says
    where to put them). For each set, it measures the error table per light configuration,
    calibrates one unit, and reconstructs presses that the estimator has not seen; for the rendered
    sets, also shapes other than balls.

    OUT receives index.html, error_table.json, fabrication/NAME and units/NAME. The page is written
    last, completely or not at all. This takes six to ten minutes on two cores. The exit status
    is 1 if a check of the files fails.

    Example: wedge reproduce --out build

    Args:
        out: The folder to write; results of an earlier run there are replaced.
        folds: 1 judges 8 of 40 presses (a fifth of smaller sets); 5 judges every press once. Of the
            rendered sets, always 8 are judged.
        seed: Seed for splits, drawing pixels, training and intervals.
    """
    from validation.report.results import summary_caption, summary_cells

    present, absent = _present(folds, seed)
    _check_output(out, [dataset.name for dataset in present])
    files, sound = _fabrication(out)
    measured = _measure_all(out, present, folds, seed)
    command = f"wedge reproduce --folds {folds} --seed {seed}"
    with progress("figures and page") as show:
        page = _write(out, command, measured, _sections(command, files, measured, absent, show))
    print_table(*summary_cells(measured.results))
    print(summary_caption(measured.results))
    for name, sought in absent.items():
        print(f"left out {name}: {sought}", file=sys.stderr)
    print(f"Open {page}")
    return 0 if sound else 1


def _present(folds: int, seed: int) -> "tuple[list[KnownDataset], dict[str, str]]":
    """The sets of ``NAMES`` that this machine has, and where the others were sought.

    Raises:
        WedgeError: it has none, or one of them cannot be split into so many folds.
    """
    from validation.datasets import known_datasets
    from validation.splits import splits

    known = known_datasets()
    present = [known[name] for name in NAMES if known[name].find() is not None]
    absent = {name: known[name].sought for name in NAMES if known[name] not in present}
    if not present:
        raise WedgeError(f"no dataset is on this machine: {absent[NAMES[0]]}.")
    for dataset in present:
        if dataset.name not in TWINS:
            splits(dataset.presses, folds, seed)  # refused now, and not when files were replaced
    return present, absent


@dataclass(frozen=True, kw_only=True)
class _Measured:
    """All that the page shows but the files to build the designs."""

    results: "list[DatasetResults]"
    shapes: "dict[str, dict[str, list[Shape]]]"
    """By rendered set and estimator."""
    few_lights: "dict[str, list[Touch]]"
    """By rendered set."""
    beside: "dict[str, list[Unseen]]"
    """By the set of ``SIDE_BY_SIDE``."""
    likeness: "list[Section]"
    known_depth: "list[Section]"
    touch: "list[Section]"
    tracked: "Section"


def _measure_all(out: Path, present: "Sequence[KnownDataset]", folds: int, seed: int) -> _Measured:
    """Measure each set, keep a unit of each in the folder, then measure what needs them all."""
    results: list[DatasetResults] = []
    of_known_depth: list[Section] = []
    shapes: dict[str, dict[str, list[Shape]]] = {}
    beside: dict[str, list[Unseen]] = {}
    fitted: dict[str, GradientEstimator] = {}
    with process_pool() as executor:
        for dataset in present:
            twin = dataset.name in TWINS
            measured, unit = _measure(dataset, TWIN_FOLDS if twin else folds, seed, executor)
            results.append(measured)
            fitted[dataset.name] = unit.estimator
            if twin:
                shapes[dataset.name] = shapes_by_estimator(
                    measured.dataset.folder, unit, ESTIMATORS[1:], seed, executor
                )
            if dataset.name in SIDE_BY_SIDE:
                beside[dataset.name] = beside_each_other(measured, ESTIMATORS[1:], seed, executor)
            unit.save(out / "units" / dataset.name, again=True)
            if dataset.name in KNOWN_DEPTH:
                of_known_depth.append(known_depth(KNOWN_DEPTH[dataset.name], unit))
        few_lights = [executor.submit(_few_lights, name) for name in shapes]
        tracking = executor.submit(_tracking)  # as long as all that follows, on one process
        likeness = [twins_beside_sensors(TWINS, executor)] if shapes else []
        touch = touch_sections(results, ESTIMATORS[0], fitted.get(TWIN), executor)
        touches = dict(zip(shapes, (future.result() for future in few_lights), strict=True))
        tracked = tracking.result()
    return _Measured(
        results=results,
        shapes=shapes,
        few_lights=touches,
        beside=beside,
        likeness=likeness,
        known_depth=of_known_depth,
        touch=touch,
        tracked=tracked,
    )


def _sections(
    command: str,
    files: "Section",
    measured: _Measured,
    absent: Mapping[str, str],
    show: Callable[[float, str], None],
) -> "list[Section]":
    """The page, in its order."""
    from validation.report.few_lights import few_lights_section
    from validation.report.remarks import reproduction_section, weakness_section
    from validation.report.results import dataset_section, headline_section
    from validation.report.shapes import shapes_section
    from validation.report.side_by_side import side_by_side_section

    results = measured.results
    sections = [headline_section(results), files]
    for done, item in enumerate(results, start=1):
        sections.append(dataset_section(item))
        show(0.9 * done / len(results), item.dataset.card.name)
    return [
        *sections,
        *([shapes_section(measured.shapes)] if measured.shapes else []),
        *([few_lights_section(measured.few_lights)] if measured.few_lights else []),
        *([side_by_side_section(measured.beside)] if measured.beside else []),
        *measured.likeness,
        *measured.known_depth,
        *measured.touch,
        _integrators(),
        measured.tracked,
        weakness_section(results),
        reproduction_section(command, results, absent, _versions()),
    ]


def _write(out: Path, command: str, measured: _Measured, sections: "Sequence[Section]") -> Path:
    """Write the error tables as JSON and then the page, whose path is given back."""
    from validation.report.page import write_report
    from validation.table_text import table_document

    documents = [
        {**table_document(item.table), "dataset_sha256": item.dataset.sha256}
        for item in measured.results
    ]
    write_json(out / "error_table.json", {"tables": documents})
    return write_report(
        out,
        title="GelSight Wedge: from a ball press to depth",
        lead="Colour to slope, slope to depth: measured on presses that the estimator was "
        f"not trained on, by {command}.",
        sections=sections,
    )


def _check_output(out: Path, units: list[str]) -> None:
    """Refuse now what could not be written minutes later."""
    probe = out / ".probe"
    write_atomic(probe, b"")
    probe.unlink()
    for name in units:
        check_new_folder(out / "units" / name, over=GRADIENTS_FILE)
    for name in DESIGNS:
        check_new_folder(out / "fabrication" / name, over=MANIFEST)


def _fabrication(out: Path) -> "tuple[Section, bool]":
    """The files of both designs, as a section, and whether every check of them passed."""
    from validation.report.fabrication import fabrication_section, no_fabrication_section

    designs = {out / "fabrication" / name: load_design(name) for name in DESIGNS}
    try:
        manifests = []
        for folder, design in designs.items():
            with process_pool() as pool:  # what the solid modeller holds goes with its process
                made = pool.submit(fabricate, design, folder, again=True)
                manifests.append(made.result())
    except MissingExtraError as error:
        print(f"left out fabrication: {error}", file=sys.stderr)
        return no_fabrication_section(str(error)), True
    sound = all(check["passed"] for manifest in manifests for check in manifest["checks"])
    return fabrication_section(designs, out), sound


def _measure(
    dataset: "KnownDataset", folds: int, seed: int, executor: Executor
) -> "tuple[DatasetResults, Calibration]":
    """The error table, a unit fitted to all presses, and presses held out, side by side."""
    from validation.datasets import dataset_folder
    from validation.error_table import error_table
    from validation.evaluation import held_out_metrics
    from validation.examples import held_out
    from validation.report.results import DatasetResults

    with progress(dataset.name) as show:
        show(0.0, "importing")
        folder = dataset_folder(dataset.name)
        known = read_dataset(folder)
        all_lights_only = _all_lights_only(dataset.name, known.card.lights_deg)
        fitted = executor.submit(fit_unit, folder, dataset.name, seed, ESTIMATORS[0])
        try:
            table = error_table(
                folder,
                ESTIMATORS,
                folds=folds,
                seed=seed,
                executor=executor,
                all_lights_only=all_lights_only,
                progress=show,
            )
        except BaseException:
            fitted.cancel()
            raise
        shown = executor.submit(held_out, folder, table.folds_fitted[ESTIMATORS[0]][0], seed)
        unit = fitted.result()
        results = DatasetResults(
            dataset=known,
            about=dataset.summary,
            table=table,
            held_out=shown.result(),
            command=f"wedge table {dataset.name} --folds {folds} --seed {seed} "
            f"--estimator {','.join(ESTIMATORS)}",
        )
    # The unit's estimator saw all presses; its errors are those of the table's, which did not.
    alone = replace(
        table,
        rows=(results.row("contact+5%"), results.row("contact")),
        depth={ESTIMATORS[0]: table.depth[ESTIMATORS[0]]},
    )
    fitted_presses = int(unit.card.metrics["fitted_presses"])
    metrics = held_out_metrics(alone, fitted_presses)
    return results, replace(unit, card=replace(unit.card, metrics=metrics))


def _all_lights_only(name: str, lights_deg: Mapping[str, float] | None) -> tuple[str, ...]:
    """Estimators that are judged with all lights alone; some of them take minutes more."""
    from recon.lights import sits_like_wedge

    if name in KNOWN_DEPTH:
        return ESTIMATORS
    return ("table",) if sits_like_wedge(lights_deg) else ("default", "table")


def _few_lights(name: str) -> "list[Touch]":
    """Touches of a rendered set with one light, two and three."""
    from validation.datasets import dataset_folder
    from validation.few_lights import measure_touches

    return measure_touches(dataset_folder(name), ESTIMATORS[0], FEW_LIGHTS)


def _integrators() -> "Section":
    from benchmarks.integrators import BOUNDARIES, CAPS_MM_PER_PX, bump_error, integrated_caps
    from validation.report.integrators import integrator_section

    depth, found = integrated_caps()
    errors = {name: [bump_error(count, name) for count in SAMPLES] for name in BOUNDARIES}
    return integrator_section(depth, found, CAPS_MM_PER_PX, SAMPLES, errors)


def _tracking() -> "Section":
    """Steps on objects of known pose, and a bead that rolls; by ICP too where it is installed."""
    from benchmarks.tracking import roll, step_errors
    from validation.report.tracking import tracking_section

    trackers = ["joint", "gicp"]
    try:
        measured, rolled = step_errors(THINGS, trackers), roll(trackers)
    except WedgeError as error:  # small_gicp is an extra
        print(f"left out ICP: {error}", file=sys.stderr)
        measured, rolled = step_errors(THINGS, trackers[:1]), roll(trackers[:1])
    return tracking_section(measured, rolled)


def _versions() -> dict[str, str]:
    return {
        "Python": platform.python_version(),
        **{package: version(package) for package in PACKAGES},
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
    }
