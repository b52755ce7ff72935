# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the subcommands share at their output: tables on the terminal, JSON in files."""

import json
import os
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from sensor.errors import WedgeError
from sensor.files import write_atomic

OutputFile = Annotated[Path | None, tyro.conf.arg(metavar="FILE")]
"""An option that names a file to write."""

if TYPE_CHECKING:
    from recon.presses import LeftOut
    from validation.error_table import ErrorTable


def check_outputs(*files: Path | None) -> None:
    """Refuse what could not be written, before minutes are spent on what it would hold.

    Raises:
        WedgeError: names the file, and the folder that is in its way.
    """
    for file in files:
        if file is None:
            continue
        if file.is_dir():
            raise WedgeError(f"{file} cannot be written: it is a folder; name a file.")
        folder = next(parent for parent in file.absolute().parents if parent.exists())
        if not folder.is_dir() or not os.access(folder, os.W_OK):
            raise WedgeError(f"{file} cannot be written: {folder} is no folder that takes files.")


def write_json(path: Path | None, document: dict[str, Any]) -> None:
    """Write a document where the user asked for one."""
    if path is not None:
        write_atomic(path, (json.dumps(document, indent=2, ensure_ascii=False) + "\n").encode())


def print_table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a table as wide as it needs to be where stdout is not a terminal."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(*headings, box=box.SIMPLE_HEAD)
    for row in rows:
        table.add_row(*row)
    console = Console()
    if not console.is_terminal:
        console = Console(width=200)
    console.print(table, markup=False)


def print_error_table(table: "ErrorTable") -> None:
    """Print gradient errors, depth errors and what was left out."""
    from validation.table_text import caption, column_headings, depth_document, row_cells

    print_table(column_headings(), map(row_cells, table.rows))
    print(caption(table))
    for estimator, errors in table.depth.items():
        if errors:
            depth = depth_document(errors)
            print(
                f"Depth in the contact, {estimator}, {depth['n_presses']} presses against the "
                f"{depth['truth']}: RMSE {depth['rmse_mm']:.3f} mm, bias {depth['bias_mm']:+.3f} mm"
                f" (peaks {depth['peak_mm']:.2f} of {depth['peak_truth_mm']:.2f} mm)."
            )
    print_left_out(table.left_out)


def print_left_out(left_out: "Sequence[tuple[str, str]] | Sequence[LeftOut]") -> None:
    """Name and count the presses that could not be used."""
    pairs = [item if isinstance(item, tuple) else (item.file, item.reason) for item in left_out]
    if pairs:
        print(f"left out {len(pairs)} press{'es' if len(pairs) > 1 else ''}:", file=sys.stderr)
    for file, reason in pairs:
        print(f"  {file}: {reason}", file=sys.stderr)
