# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the subcommands share at their output: names of files, and tables on the terminal."""

import csv
import io
import os
import shlex
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from sensor.closing import Closing
from sensor.dataset import CARD_FILE, IMAGES
from sensor.documents import text_bytes
from sensor.errors import WedgeError
from sensor.unit import UNIT_FILE

OutputFile = Annotated[Path | None, tyro.conf.arg(metavar="FILE")]
"""An option that names a file to write."""
READ_IN_FOLDERS = (*IMAGES, ".npz", ".npy", ".toml", ".csv", ".safetensors")
"""Endings of what is read with a folder that is named; reports beside it may be written anew."""
SHOWN_ROWS = 20
"""Of a table with a row for each frame."""
BESIDE_CELL, BESIDE_TABLE = 3, 1
"""Characters of a table that are no cell's: spaces beside each, and the last line at its edge."""

if TYPE_CHECKING:
    from recon.presses import LeftOut
    from validation.error_table import ErrorTable


def output_names(images: Sequence[str], ends: Sequence[str]) -> list[str]:
    """File names without ending for what is made of some images, one per image.

    Args:
        images: image files, or ``frames.npz#17`` for one of many.
        ends: of the files that are written for each, such as ``.npy`` and ``-doubt.png``.

    Raises:
        WedgeError: two of those files would have one name.
    """
    stems, taken = [], set[str]()
    for image in images:
        file, _, index = image.partition("#")
        stem = f"{Path(file).stem}-{index}" if index else Path(file).stem
        for name in (stem + end for end in ends):
            if name in taken:
                raise WedgeError(f"two images would be written to {name}: rename one.")
            taken.add(name)
        stems.append(stem)
    return stems


def keep_inputs(read: Iterable[str | Path | None], written: Iterable[Path | None]) -> None:
    """Refuse to write over what is read.

    Args:
        read: files, ``frames.npz#17``, and folders of frames, of a dataset or of a unit; what is
            none of these, such as an address, is passed over.
        written: files; ``None`` where one was not asked for.

    Raises:
        WedgeError: names the file.
    """
    names = [str(name) for name in read if name is not None]
    ours = {Path(part).resolve() for name in names for part in (name, name.partition("#")[0])}
    for path in written:
        if path is not None and (path.resolve() in ours or _is_read_in(ours, path.resolve())):
            raise WedgeError(f"{path} is an input and would be overwritten: write elsewhere.")


def refuse_unit_folder(out: Path | None) -> None:
    """Refuse to write what is made of frames among a unit's own files.

    Raises:
        WedgeError: names the folder.
    """
    if out is not None and (out / UNIT_FILE).is_file():
        raise WedgeError(f"{out} is a unit folder, which holds only its own files: name another.")


def _is_read_in(folders: set[Path], path: Path) -> bool:
    """Whether a file is there already that is read with one of these folders."""
    if path.suffix.lower() not in READ_IN_FOLDERS or not path.is_file():
        return False
    # A dataset may have folders of its own; in others, what lies deeper is not looked at.
    return path.parent in folders or any(
        folder in folders and (folder / CARD_FILE).is_file() for folder in path.parents
    )


class RowFile(Closing):
    """A CSV file that is written row by row, and ends with a whole one where the disk is full."""

    def __init__(self, path: Path, headings: Sequence[str]) -> None:
        """Begin a file.

        Raises:
            WedgeError: the file exists or cannot be written.
        """
        self._path, self._end = path, 0
        try:
            self._file = path.open("xb", buffering=0)
        except FileExistsError as error:
            raise WedgeError(f"{path} exists: name a new file.") from error
        except OSError as error:
            raise self._unwritable(error) from error
        self.add(headings)

    def add(self, *rows: Sequence[object]) -> None:
        """Append rows, all or none.

        Raises:
            WedgeError: the disk is full.
        """
        lines = io.StringIO()
        csv.writer(lines, lineterminator="\n").writerows(rows)
        rest = text_bytes(lines.getvalue())
        try:
            while rest:
                rest = rest[self._file.write(rest) :]
        except OSError as error:
            self._file.truncate(self._file.seek(self._end))
            raise self._unwritable(error) from error
        self._end = self._file.tell()

    def close(self) -> None:
        """Bring everything to the disk and let go of the file.

        Raises:
            WedgeError: the disk is full.
        """
        if not self._file.closed:
            try:
                os.fsync(self._file.fileno())
            except OSError as error:
                raise self._unwritable(error) from error
            finally:
                self._file.close()

    def _unwritable(self, error: OSError) -> WedgeError:
        return WedgeError(f"{self._path} cannot be written: {error.strerror}.")


def command_line(*words: str | Path) -> str:
    """A command as a shell takes it, whatever is in the names of its files."""
    return shlex.join(["wedge", *map(str, words)])


def print_table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a table of which nothing is cut.

    It is as wide as it needs to be; on a terminal that is narrower its cells break between words,
    and where a word would not fit, each row stands below the one before, a line for each cell.
    """
    from rich import box
    from rich.cells import cell_len
    from rich.console import Console
    from rich.table import Table

    lines = [headings, *rows]
    columns = list(zip(*lines, strict=True))
    longest = [max(map(cell_len, column)) for column in columns]
    words = [max(map(cell_len, " ".join(column).split()), default=0) for column in columns]
    console = Console()
    if not console.is_terminal:
        console = Console(width=sum(longest) + BESIDE_CELL * len(columns) + BESIDE_TABLE)
    widths = _widths(words, longest, console.width - BESIDE_CELL * len(columns) - BESIDE_TABLE)
    if widths is None:
        _print_stacked(headings, lines[1:])
        return
    table = Table(box=box.SIMPLE_HEAD)
    for heading, width in zip(headings, widths, strict=True):
        table.add_column(heading, width=width)
    for row in lines[1:]:
        table.add_row(*row)
    console.print(table, markup=False)


def print_rows(headings: Sequence[str], rows: Sequence[Sequence[str]], more: str = "") -> None:
    """Print a table of the first frames, a row for each, and how many more there are.

    Args:
        headings: of the columns.
        rows: of all frames.
        more: behind that count: where to find them.
    """
    print_table(headings, rows[:SHOWN_ROWS])
    if len(rows) > SHOWN_ROWS:
        print(f"and {len(rows) - SHOWN_ROWS} more frames{more}")


def _widths(words: Sequence[int], longest: Sequence[int], width: int) -> list[int] | None:
    """Of columns between their longest word and their longest cell; ``None`` where none do."""
    widths = list(words)
    if sum(widths) > width:
        return None
    for _ in range(min(width, sum(longest)) - sum(widths)):
        lacking = [most - given for most, given in zip(longest, widths, strict=True)]
        widths[lacking.index(max(lacking))] += 1
    return widths


def _print_stacked(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    wide = max(map(len, headings))
    for row in rows:
        print()
        for heading, cell in zip(headings, row, strict=True):
            if cell:
                print(f" {heading:{wide}}  {cell}")
    print()


def print_error_table(table: "ErrorTable") -> None:
    """Print gradient errors, depth errors and what was left out."""
    from validation.table_text import (
        caption,
        column_headings,
        depth_document,
        depth_sentence,
        row_cells,
    )

    print_table(column_headings(), map(row_cells, table.rows))
    print(caption(table))
    for estimator, errors in table.depth.items():
        if errors:
            print(depth_sentence(estimator, depth_document(errors)))
    print_left_out(table.left_out)


def print_left_out(left_out: "Sequence[LeftOut]") -> None:
    """Name and count the presses that could not be used."""
    count = len(left_out)
    if count:
        print(f"left out {count} press{'es' if count > 1 else ''}:", file=sys.stderr)
    for press in left_out:
        print(f"  {press.file}: {press.reason}", file=sys.stderr)
