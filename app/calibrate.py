# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge calibrate`: ball presses to a unit folder."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from app._importing import import_source
from app._lights import misplaced_remark, one_line_remark, with_dead_lights
from app._output import OutputFile, command_line, keep_inputs, print_error_table
from app._pad import assumed_pad_mm, pad_remark, refuse_other_pad, refuse_smaller_pad
from app._pitch import pitch_remarks
from app._progress import progress
from app._seed import Seed
from sensor.dataset import CARD_FILE, Dataset, read_dataset
from sensor.design import Wedge
from sensor.design_file import load_design
from sensor.errors import WedgeError
from sensor.files import check_new_folder, check_outputs, write_json
from sensor.unit import UNIT_FILE

if TYPE_CHECKING:
    from recon.calibration import Calibration
    from recon.presses import PressSet
    from validation.error_table import ErrorTable


def main(
    dataset: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="DATASET")],
    out: Path,
    estimator: str = "default",
    design: str | None = None,
    ball_radius_mm: float | None = None,
    seed: Seed = 0,
    json: OutputFile = None,
) -> None:
    """Calibrate one sensor from ball presses and write its unit folder.

    The errors are measured first, on presses that the estimator has not seen (8 of 40, or a
    fifth). The estimator that is kept is then fitted to all presses. The name of the unit folder
    becomes the unit's serial.

    A folder of your own raw frames works too: the blank gel in background.png, a caliper's jaws
    5 mm apart, along and across, in 5mm-1.png, 5mm-2.png and so on, ball presses in all others.
    Corners, scale and circles are then found first, and kept as a dataset next to the unit,
    UNIT-presses.

    Example: wedge calibrate taxim-gelsight --out units/bench-001

    Example: wedge calibrate my-frames --ball-radius-mm 2.42 --out units/wedge-001

    Args:
        dataset: A dataset folder, a name from `wedge data list`, or a folder of raw frames.
        out: The unit folder to write; new or empty.
        estimator: default (ours), mlp (the paper's network) or table (the lookup table that it
            replaced).
        design: The design the sensor was built from, which is written into the unit: standard,
            finger or a .toml file. It gives the expected lights and, for raw frames, the size of
            the pad (by default the standard's).
        ball_radius_mm: Radius of the ball, for raw frames.
        seed: Seed for the split, drawing pixels and training.
        json: Write the errors on the held-out presses here as JSON.
    """
    from recon.estimators import refuse_unfittable
    from recon.labels.ball_size import refuse_wrong_ball
    from recon.labels.press_doubts import press_doubts
    from recon.presses import press_reader
    from validation.datasets import dataset_folder
    from validation.table_text import table_document

    if out.name in ("", ".."):
        raise WedgeError(f"--out {out} gives the unit no name: name a new folder.")
    check_new_folder(out)
    check_outputs(out / UNIT_FILE, json)
    keep_inputs([dataset, design], [json])
    refuse_unfittable(estimator)
    built_from = None if design is None else load_design(design)
    folder = _dataset_of(
        Path(dataset),
        out,
        built_from,
        ball_radius_mm,
        estimator,
        again=[
            *(() if estimator == "default" else ("--estimator", estimator)),
            *(() if design is None else ("--design", design)),
            *(() if seed == 0 else ("--seed", str(seed))),
            *(() if json is None else ("--json", json)),
        ],
    )
    source = read_dataset(folder or dataset_folder(dataset))
    refuse_other_pad(source.card.pad_size_mm, built_from, str(source.folder / CARD_FILE))
    if built_from is not None and source.card.pad_size_mm is None:
        size_px, mm_per_px = press_reader(source).unwarp.size_px, source.card.mm_per_px
        refuse_smaller_pad(size_px, mm_per_px, built_from, dataset)
    try:
        refuse_wrong_ball(source.labels, source.card)
    except WedgeError as error:
        again = command_line("label", source.folder, "--again")
        raise WedgeError(
            f"{source.folder}: {error} Correct dataset.toml, then run `{again}`."
        ) from error
    card, dead = with_dead_lights(source, built_from)
    stated, source = source, replace(source, card=card)
    unit, presses, measured = _fit(
        source, estimator, built_from, seed, serial=out.resolve().name, called=dataset
    )
    unit.save(out)
    print_error_table(measured)
    one_line = one_line_remark(source, presses.presses)
    pad = pad_remark(source.card.pad_size_mm, built_from)
    of_lights: tuple[str, ...] = ()
    if folder is None:  # else the import has said it
        of_lights = (dead, misplaced_remark(stated, presses.presses, built_from))
    remarks = (pad, *pitch_remarks(source), *of_lights, one_line, _light_remark(unit))
    for sentence in (*filter(None, remarks), *press_doubts(presses, source.labels)):
        print(sentence)
    print(f"Unit folder: {out}")
    if folder is not None:
        print(f"Next: {command_line('accept', out, folder, '--out', f'{out}-certificate')}")
        print("Judge presses from another day instead to see what has changed since.")
    write_json(json, table_document(measured))


def _light_remark(unit: "Calibration") -> str | None:
    """Say it where the unit's light is known, as its contact masks then come from another way."""
    from recon.touched import in_known_light

    card = unit.card
    if card.markers or not in_known_light(unit.estimator, card.size_px, card.mm_per_px):
        return None
    return "Its balls are lit as the rendered standard's: contact masks use that light, too."


def _fit(
    source: "Dataset",
    estimator: str,
    design: Wedge | None,
    seed: int,
    *,
    serial: str,
    called: str,
) -> "tuple[Calibration, PressSet, ErrorTable]":
    """A unit that has learnt from every press, the presses, and its errors on some held out."""
    from recon.calibration import lit_channels, unit_of
    from recon.estimators import fit_estimator, lesson_of
    from recon.presses import read_presses
    from validation.evaluation import held_out_metrics, hold_out
    from validation.fits import concurrent_fits

    with progress(f"calibration on {called}") as show:
        presses = read_presses(source, lambda share: show(0.2 * share, "reading presses"))
        everything = lesson_of(estimator, presses.presses, range(len(presses.presses)), seed)
        lit, _ = lit_channels(source)
        with concurrent_fits() as fits:
            kept = fits.begin(
                lambda report: fit_estimator(estimator, everything, lit, seed, report)
            )
            measured = fits.begin(
                lambda report: hold_out(source, presses, estimator, seed=seed, progress=report)
            )
            fits.wait(lambda share: show(0.2 + 0.8 * share, "fitting, measuring held-out presses"))
        table = measured.result()
        unit = unit_of(
            source,
            presses,
            kept.result(),
            serial=serial,
            created=datetime.now(UTC).date().isoformat(),
            metrics=held_out_metrics(table, fitted_presses=len(presses.presses)),
            design=design,
        )
    return unit, presses, table


def _dataset_of(
    frames: Path,
    out: Path,
    design: Wedge | None,
    ball_radius_mm: float | None,
    estimator: str,
    *,
    again: Sequence[str | Path],
) -> Path | None:
    """The dataset made from a folder of raw frames; ``None`` where it is none.

    Other processes find the circles. What the estimator is fitted with takes seconds to import:
    that is begun meanwhile.

    Args:
        frames: a dataset's folder or name, or a folder of raw frames.
        out: of the unit.
        design: of the sensor.
        ball_radius_mm: of raw frames.
        estimator: its name.
        again: options, for who is told to go on with what an earlier run has found.
    """
    from recon.estimators import kind_of
    from validation.datasets import dataset_folder

    if not frames.is_dir() or (frames / CARD_FILE).exists():
        if ball_radius_mm is not None:
            dataset_folder(frames)  # says so where there is neither
            raise WedgeError("--ball-radius-mm is for raw frames: a dataset states its own.")
        return None
    if ball_radius_mm is None:
        raise WedgeError(
            f"{frames} is not a dataset folder: it has no dataset.toml; if it holds raw frames, "
            "give the radius of the ball with --ball-radius-mm."
        )
    presses = out.with_name(f"{out.name}-presses")
    if (presses / CARD_FILE).exists():
        raise WedgeError(
            f"{presses} holds the presses of an earlier run: continue with "
            f"`{command_line('calibrate', presses, '--out', out, *again)}`, or name another --out."
        )
    if kind_of(estimator).needs_torch:
        ThreadPoolExecutor(1).submit(import_module, "torch")
    import_source(
        frames,
        presses,
        ball_radius_mm=ball_radius_mm,
        mm_per_px=None,
        pad_size_mm=assumed_pad_mm(design),
        design=design,
    )
    return presses
