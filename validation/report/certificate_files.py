# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The certificate as files: a page for the screen, and a sheet of A4 beside it."""

from pathlib import Path

from sensor.files import write_atomic
from sensor.unit import UnitCard
from validation.acceptance.limits import verdict
from validation.acceptance.measurements import Acceptance
from validation.figures.png import frames_bytes
from validation.intervals import counted
from validation.report.certificate import WORDS, Occasion, page_html
from validation.report.certificate_sheet import pdf_bytes, picture
from validation.report.page import PAGE, Picture, Section, figure_html, write_report

SHEET = "certificate.pdf"


def certificate_files(out: Path) -> tuple[Path, Path]:
    """Where the page and the sheet are written, given a folder."""
    return out / PAGE, out / SHEET


def write_certificate(out: Path, card: UnitCard, occasion: Occasion, found: Acceptance) -> None:
    """Write ``certificate_files``, each whole or not at all.

    Raises:
        WedgeError: one of them cannot be written.
    """
    _, sheet = certificate_files(out)
    shown = Picture(
        content=frames_bytes(picture(card, found)),
        alt="The blank gel, its weakest light, the areas that are covered by presses and usable; "
        "a press, its depth and its depth error",
        caption=f"Unit {card.serial}, {occasion.dataset}, {counted(found.presses)}; below: "
        f"{found.press.depth.file}.",
        wide=True,
    )
    write_report(
        out,
        title=f"GelSight Wedge {card.serial}",
        lead="Certificate of one sensor, written by wedge accept.",
        sections=[
            Section(
                title=WORDS[verdict(found.values)],
                html=page_html(card, occasion, found, figure_html(shown)),
            )
        ],
    )
    write_atomic(sheet, pdf_bytes(card, occasion, found))
