# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge accept`: is this sensor good?"""

from pathlib import Path
from typing import Annotated

import tyro

from app._output import OutputFile, check_outputs, print_table, write_json
from app._progress import progress
from app._seed import Seed


def main(
    unit: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="UNIT")],
    dataset: Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="DATASET")],
    out: Annotated[Path | None, tyro.conf.arg(metavar="DIR")] = None,
    seed: Seed = 0,
    json: OutputFile = None,
    junit: OutputFile = None,
) -> int:
    """Measure a sensor against limits, each with its reason; exit 0 only where it passes.

    Judged are its errors on balls, noise and drift of untouched gel, its lights (evenness,
    saturation, contrast, place, cross-talk, balance), the lit, covered and worn area of the pad,
    and whether the camera has moved since the calibration. The worst grade decides: A, B or fail.
    Press the ball over the whole pad first; presses of another day than the calibration's also
    show what has changed since.

    Example: wedge accept units/wedge-001 presses/today --out certificate

    Args:
        unit: A unit folder, written by `wedge calibrate`.
        dataset: A dataset folder, or a name that `wedge data list` knows.
        out: Write the certificate here: index.html and certificate.pdf.
        seed: Seed of the drawn pixels and the intervals.
        json: Write measurements, limits and grade here as JSON.
        junit: Write them here as JUnit XML, one test case a limit.
    """
    from recon.calibration import load_calibration
    from sensor.dataset import read_dataset
    from sensor.files import write_atomic
    from validation.acceptance.certificate import (
        WORDS,
        document,
        junit_xml,
        page_html,
        pdf_bytes,
        picture,
        sentence,
        table_rows,
    )
    from validation.acceptance.limits import LIMITS, grades, verdict
    from validation.acceptance.measurements import accept_unit
    from validation.datasets import dataset_folder
    from validation.figures.png import png_bytes
    from validation.report.page import Picture, Section, figure_html, write_report

    pdf = None if out is None else out / "certificate.pdf"
    check_outputs(pdf, json, junit)
    calibration = load_calibration(unit)
    source = read_dataset(dataset_folder(dataset))
    card, name = calibration.card, source.card.name
    with progress(f"acceptance of {card.serial}") as show:
        found = accept_unit(
            calibration, source, seed=seed, progress=lambda share: show(share, "measuring")
        )
    grade = verdict(found.values)
    rows = [row[:5] for row in table_rows(found)]
    print_table(("measured", "value", "A", "B", "grade"), rows)
    for limit in LIMITS:
        if grades(found.values).get(limit.name) == "fail":
            print(f"{sentence(limit, found)}: {limit.reason}.")
    print(f"{card.serial}: {WORDS[grade]}.")
    write_json(json, document(card, name, found))
    if junit:
        write_atomic(junit, junit_xml(card, name, found))
    if out is not None and pdf is not None:
        shown = Picture(
            png=png_bytes(picture(found, card.mm_per_px)),
            alt="The blank gel, its weakest light, and the area that presses cover",
            caption=f"Unit {card.serial}, {name}, {found.errors.test} presses.",
            wide=True,
        )
        body = page_html(card, name, found) + figure_html(shown)
        write_report(
            out,
            title=f"GelSight Wedge {card.serial}",
            lead="Certificate of one sensor, written by `wedge accept`.",
            sections=[Section(title=WORDS[grade], html=body)],
        )
        write_atomic(pdf, pdf_bytes(card, name, found))
        print(f"Certificate: {out / 'index.html'}, {pdf}")
    return 1 if grade == "fail" else 0
