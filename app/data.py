# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge data`: the datasets that have a name."""

from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from app._output import OutputFile, print_table, write_json
from app._progress import progress
from sensor.errors import WedgeError


def main(
    action: Annotated[
        tyro.conf.Positional[Literal["list", "path"]], tyro.conf.arg(metavar="list|path")
    ],
    name: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="[NAME]")] = "",
    json: OutputFile = None,
) -> None:
    """List the datasets known by name, or print the folder of one.

    Every command that takes a dataset takes such a name. A set is imported once, when it is first
    needed, into a cache (WEDGE_CACHE, by default ~/.cache/gelsight-wedge); originals stay as they
    are.

    Example: wedge data path taxim-gelsight

    Args:
        action: list prints all of them; path prints one's folder, importing it where needed.
        name: The dataset whose folder to print.
        json: Write the list here as JSON.
    """
    if action == "path":
        if not name:
            raise WedgeError("name a dataset: `wedge data path taxim-gelsight`, for instance.")
        print(_folder(name))
        return
    if name:
        raise WedgeError(f"`wedge data list` takes no name; `wedge data path {name}` finds one.")
    rows = _rows()
    print_table(
        ["name", "presses", "ball R [mm]", "mm/px", "what", "licence", "where"],
        [
            (
                row["name"],
                str(row["presses"]),
                "–" if row["ball_radius_mm"] is None else f"{row['ball_radius_mm']:g}",
                f"{row['mm_per_px'][0]:g}",
                row["summary"],
                row["licence"],
                row["folder"] or row["note"],
            )
            for row in rows
        ],
    )
    write_json(json, {"datasets": rows})


def _folder(name: str) -> Path:
    from validation.datasets import dataset_folder

    with progress(f"dataset {name}"):
        return dataset_folder(name)


def _rows() -> list[dict[str, Any]]:
    from validation.datasets import CARD, DATASETS

    rows = []
    for known in DATASETS:
        source = known.find()
        folder = None if source is None else known.folder(source)
        imported = folder is not None and (folder / CARD).is_file()
        rows.append(
            {
                "name": known.name,
                "summary": known.summary,
                "presses": known.presses,
                "ball_radius_mm": known.ball_radius_mm,
                "mm_per_px": list(known.mm_per_px),
                "licence": known.licence,
                "origin": known.origin,
                "folder": str(folder) if imported else None,
                "note": f"absent: {known.sought}" if source is None else "imported when needed",
            }
        )
    return rows
