# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A page of an ideal sensor, and what it is made from."""

from concurrent.futures import Executor, Future

import pytest

from benchmarks.integrators import BOUNDARIES, CAPS_MM_PER_PX, bump_error, integrated_caps
from tests.synthetic import make_dataset
from validation.error_table import error_table
from validation.examples import held_out
from validation.report.integrators import integrator_section
from validation.report.page import write_report
from validation.report.remarks import reproduction_section, weakness_section
from validation.report.results import (
    DatasetResults,
    dataset_section,
    headline_section,
)


class Inline(Executor):
    def submit(self, work, /, *args, **options):  # type: ignore[override]
        future: Future = Future()
        future.set_result(work(*args, **options))
        return future


@pytest.fixture(scope="session")
def results(tmp_path_factory: pytest.TempPathFactory) -> DatasetResults:
    dataset = make_dataset(tmp_path_factory.mktemp("page") / "set", presses=6)
    table = error_table(dataset.folder, ["table"], folds=2, seed=0, executor=Inline())
    return DatasetResults(
        dataset=dataset,
        about="an ideal sensor",
        table=table,
        held_out=held_out(dataset.folder, table.folds_fitted["table"][0], 0),
        command="wedge table set --folds 2 <&>",
    )


@pytest.fixture(scope="session")
def text(results: DatasetResults, tmp_path_factory: pytest.TempPathFactory) -> str:
    depth, found = integrated_caps()
    errors = {name: [bump_error(count, name) for count in (10, 20)] for name in BOUNDARIES}
    path = write_report(
        tmp_path_factory.mktemp("out"),
        title="A <page>",
        lead="Measured & shown.",
        sections=[
            headline_section([results]),
            dataset_section(results),
            integrator_section(depth, found, CAPS_MM_PER_PX, (10, 20), errors),
            weakness_section([results]),
            reproduction_section("wedge reproduce", [results], {"other": "not here"}, {"a": "1"}),
        ],
    )
    return path.read_text(encoding="utf-8")
