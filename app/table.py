# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge table`: the error table per light configuration."""

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from app._output import (
    OutputFile,
    command_line,
    keep_inputs,
    print_error_table,
    refuse_unit_folder,
)
from app._progress import progress
from app._seed import Seed
from app._workers import process_pool
from sensor.documents import text_bytes
from sensor.errors import WedgeError
from sensor.files import check_outputs, write_atomic, write_json

if TYPE_CHECKING:
    from validation.error_table import ErrorTable


def main(
    dataset: Annotated[tyro.conf.Positional[tuple[str, ...]], tyro.conf.arg(metavar="DATASET...")],
    folds: int = 1,
    estimator: str = "default,mlp,table",
    out: Path | None = None,
    seed: Seed = 0,
    json: OutputFile = None,
    markdown: OutputFile = None,
    html: OutputFile = None,
) -> int:
    """Print the gradient errors of datasets per light configuration, split by press.

    Every configuration is fitted to some of the presses and judged on the others. If the lights sit
    as the Wedge's do, the rows are the paper's six (R, R + network, RB, RB + network, RG, RGB); for
    other sensors, every subset of the colours that have a light. Two sets of pixels are judged:
    contact only, and contact with 5 % of the untouched pixels as in the paper.

    Several datasets, for instance from several units or dates, give one table each. A dataset that
    cannot be used is left out and named, and the exit status is 2.

    Example: wedge table taxim-gelsight --folds 5 --json table.json

    Args:
        dataset: Dataset folders, or names from `wedge data list`.
        folds: 1 judges 8 of 40 presses (a fifth of smaller sets); 5 judges every press once.
        estimator: Estimators to compare, separated by commas: default (ours), mlp (the paper's
            network), table (the lookup table that it replaced).
        out: Write a page here with the tables and their plots.
        seed: Seed for splits, drawing pixels, training and intervals.
        json: Write the numbers here as JSON; for several datasets, a list of them as "tables".
        markdown: Write the tables here as Markdown.
        html: Write the tables here as HTML.
    """
    from recon.estimators import refuse_unfittable
    from validation.datasets import dataset_folder, each_once, told_apart
    from validation.error_table import error_table
    from validation.report.error_tables import table_section
    from validation.report.page import write_report
    from validation.splits import refuse_folds
    from validation.table_text import error_table_html, table_document, table_markdown

    if not dataset:
        raise WedgeError("no dataset was named: `wedge data list` lists the known ones.")
    refuse_unit_folder(out)
    page = None if out is None else out / "index.html"
    check_outputs(page, json, markdown, html)
    refuse_folds(folds)
    estimators = list(dict.fromkeys(part.strip() for part in estimator.split(",")))
    for name in estimators:
        refuse_unfittable(name)
    folders, refused = dict[str, Path](), dict[str, str]()
    for name in (names := each_once(dataset)):
        try:
            folders[name] = dataset_folder(name)
        except WedgeError as error:
            if len(names) == 1:
                raise
            refused[name] = str(error)
    called = told_apart(folders)
    keep_inputs(folders.values(), [json, markdown, html])
    measured: list[ErrorTable] = []
    with process_pool() as executor:
        for name, folder in folders.items():
            try:
                with progress(f"error table of {name}") as show:
                    table = error_table(
                        folder,
                        estimators,
                        folds=folds,
                        seed=seed,
                        executor=executor,
                        progress=show,
                    )
            except WedgeError as error:
                if len(names) == 1:
                    raise
                refused[name] = str(error)
            else:
                measured.append(replace(table, dataset=called[name]))
                print_error_table(measured[-1])
    if not measured:
        raise WedgeError("; ".join(f"{name}: {reason}" for name, reason in refused.items()))
    documents = [table_document(table) for table in measured]
    several = {"tables": documents, "left_out": refused}
    write_json(json, documents[0] if len(names) == 1 else several)
    if markdown:
        write_atomic(markdown, text_bytes("\n".join(map(table_markdown, measured))))
    if html:
        write_atomic(html, text_bytes("\n".join(map(error_table_html, measured))))
    if out is not None:
        told = {"folds": folds, "estimator": ",".join(estimators), "seed": seed}
        words = ["table", *names, *(f"--{name}={value}" for name, value in told.items())]
        write_report(
            out,
            title="Gradient errors per light configuration",
            lead="No press was judged by an estimator that was trained on it. "
            f"Written by {command_line(*words)}.",
            sections=[table_section(table) for table in measured],
        )
        print(f"Page: {page}")
    for name, reason in refused.items():
        print(f"left out {name}: {reason}", file=sys.stderr)
    return 2 if refused else 0
