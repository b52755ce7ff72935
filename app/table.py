# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge table`: the error table per light configuration."""

from typing import Annotated

import tyro

from app._output import OutputFile, check_outputs, print_error_table, write_json
from app._progress import progress
from app._seed import Seed
from app._workers import process_pool
from sensor.files import write_atomic


def main(
    dataset: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="DATASET")],
    folds: int = 1,
    estimator: str = "default,mlp,table",
    seed: Seed = 0,
    json: OutputFile = None,
    markdown: OutputFile = None,
    html: OutputFile = None,
) -> None:
    """Print the gradient errors of a dataset per light configuration, split by press.

    Every configuration is fitted anew on some presses and judged on others. Where the lights sit
    as the Wedge's do, the rows are the paper's six (R, R + network, RB, RB + network, RG, RGB);
    for other sensors, every subset of the colours. Two sets of pixels are judged: contact alone,
    and contact with 5 % of the untouched ones as in the paper.

    Example: wedge table taxim-gelsight --folds 5 --json table.json

    Args:
        dataset: A dataset folder, or a name that `wedge data list` knows.
        folds: 1 judges 8 of 40 presses (a fifth of smaller sets); 5 judges every press once.
        estimator: Estimators to compare, separated by commas: default (ours), mlp (the paper's
            network), table (the lookup table that it replaced).
        seed: Seed of splits, drawn pixels, training and intervals.
        json: Write the numbers here as JSON.
        markdown: Write the table here as Markdown.
        html: Write the table here as HTML.
    """
    from validation.datasets import dataset_folder
    from validation.error_table import error_table
    from validation.table_text import table_document, table_html, table_markdown

    check_outputs(json, markdown, html)
    folder = dataset_folder(dataset)
    with process_pool() as executor, progress(f"error table of {dataset}") as show:
        measured = error_table(
            folder,
            list(dict.fromkeys(name.strip() for name in estimator.split(","))),
            folds=folds,
            seed=seed,
            executor=executor,
            progress=show,
        )
    print_error_table(measured)
    write_json(json, table_document(measured))
    if markdown:
        write_atomic(markdown, table_markdown(measured).encode())
    if html:
        write_atomic(html, table_html(measured).encode())
