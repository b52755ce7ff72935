# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge data`: the datasets that have a name, and those that others' tools made."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from app._importing import import_source
from app._output import OutputFile, print_table
from app._pad import assumed_pad_mm
from app._progress import progress
from sensor.dataset import CARD_FILE
from sensor.design_file import load_design
from sensor.errors import WedgeError
from sensor.files import write_json

IMPORT_OPTIONS = ("--out", "--ball-radius-mm", "--mm-per-px", "--pad-size-mm", "--design")


def main(
    action: Annotated[
        tyro.conf.Positional[Literal["list", "path", "import"]],
        tyro.conf.arg(metavar="list|path|import"),
    ],
    name: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="[NAME|SOURCE]")] = "",
    out: Path | None = None,
    ball_radius_mm: float | None = None,
    mm_per_px: float | None = None,
    pad_size_mm: tuple[float, float] | None = None,
    design: str | None = None,
    json: OutputFile = None,
) -> None:
    """List the known datasets, print the folder of one, or import one from elsewhere.

    Every command that takes a dataset also accepts a name from this list. A set is imported once,
    when it is first needed, into a cache (WEDGE_CACHE, by default ~/.cache/gelsight-wedge); the
    originals are not changed.

    An import makes a dataset folder from a source, which is recognised by its contents: gs_sdk's
    folder with its catalog.csv, Taxim's dataPack.npz, frames with circles in text files, or a
    folder of your own frames, for which corners, scale and circles are found. Of your own frames,
    background.png shows the blank gel, 5mm-1.png, 5mm-2.png and so on a caliper's jaws 5 mm apart,
    and all others ball presses.

    Example: wedge data path taxim-gelsight

    Example: wedge data import gs_sdk/data --mm-per-px 0.0634 --out presses/mini

    Args:
        action: list prints all of them; path prints the folder of one, and imports it if needed;
            import writes a dataset folder from a source.
        name: The dataset whose folder to print, or the source to import.
        out: The dataset folder to write; new or empty.
        ball_radius_mm: Radius of the ball, if the source does not state it; a contradiction is
            refused.
        mm_per_px: Pitch of imported frames that show the gel plane, if no caliper picture gives it;
            the pad is then not searched for.
        pad_size_mm: Size of the pad along x and y, for your own frames without caliper pictures; by
            default the standard design's.
        design: The design that your own frames' sensor was built from: standard, finger or a .toml
            file. It gives the expected lights and, without --mm-per-px, the size of the pad.
        json: Write the list here as JSON.
    """
    given = {
        "--out": out,
        "--ball-radius-mm": ball_radius_mm,
        "--mm-per-px": mm_per_px,
        "--pad-size-mm": pad_size_mm,
        "--design": design,
        "--json": json,
    }
    _refuse_ignored(action, [option for option, value in given.items() if value is not None])
    if action == "path":
        if not name:
            raise WedgeError("name a dataset: `wedge data path taxim-gelsight`, for instance.")
        print(_folder(name))
        return
    if action == "import":
        if not name or out is None:
            raise WedgeError("name a source and a dataset: `wedge data import SOURCE --out DIR`.")
        if mm_per_px is not None and pad_size_mm is not None:
            raise WedgeError("--mm-per-px and --pad-size-mm both set the scale: give one of them.")
        built_from = None if design is None else load_design(design)
        import_source(
            Path(name),
            out,
            ball_radius_mm=ball_radius_mm,
            mm_per_px=mm_per_px,
            pad_size_mm=assumed_pad_mm(built_from, pad_size_mm),
            design=built_from,
        )
        return
    if name:
        raise WedgeError(
            f"`wedge data list` takes no name: `wedge data path {name}` prints its folder."
        )
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


def _refuse_ignored(action: str, given: Sequence[str]) -> None:
    """Refuse options that an action would take no notice of.

    Raises:
        WedgeError: names the first of them.
    """
    taken = {"list": ("--json",), "path": (), "import": IMPORT_OPTIONS}[action]
    for option in given:
        if option not in taken:
            takers = "list" if option == "--json" else "import"
            raise WedgeError(
                f"`wedge data {action}` takes no {option}: use it with `wedge data {takers}`."
            )


def _folder(name: str) -> Path:
    from validation.datasets import dataset_folder

    with progress(f"dataset {name}"):
        return dataset_folder(name)


def _rows() -> list[dict[str, Any]]:
    from validation.datasets import DATASETS

    rows = []
    for known in DATASETS:
        source = known.find()
        folder = None if source is None else known.folder(source)
        imported = folder is not None and (folder / CARD_FILE).is_file()
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
