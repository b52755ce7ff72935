# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The certificate's pictures, and all of it on one sheet of A4 but for the limits' reasons."""

import io
from textwrap import wrap

import numpy as np
from matplotlib.backends.backend_pdf import FigureCanvasPdf
from matplotlib.figure import Figure

from recon.lights import channel_indices
from sensor.toml import Pair
from sensor.unit import UnitCard
from validation.acceptance.gel import SMOOTHING_PX, smooth
from validation.acceptance.limits import GROUPS, Grade, verdict
from validation.acceptance.measurements import Acceptance
from validation.figures.ball_press import deepest_mm, press_window
from validation.figures.maps import (
    AMPLIFIED_TITLE,
    SIGNED_COLORS,
    TITLE_IN,
    amplified,
    blank,
    color_bar,
    fit_box,
    outline,
    scale_bar,
    show_map,
    size_mm,
)
from validation.figures.style import BLUE, INK, ORANGE, RED, SOFT, spell_out, styled
from validation.report.certificate import (
    WORDS,
    Occasion,
    failures,
    lead,
    lines,
    not_measured,
    origin,
    remarks,
)

COLORS: dict[Grade, str] = {"A": BLUE, "B": ORANGE, "fail": RED}
PAGE_IN = (8.27, 11.69)
"""A4."""
LEFT_IN, WIDTH_IN = 0.5, 7.27
TITLE_PT, TITLE_LETTERS = 16.0, 44
"""So many letters are as wide as the page; a longer title is smaller."""
SMALL_PT = 7.0
"""The least that is read on paper."""
TALLEST_ROW_IN, FOOT_IN = 0.2, 0.35
COLUMNS_IN = (0.5, 2.9, 5.9, 6.6, 7.3)
"""Title, value, A, B, grade."""
ELSEWHERE = "The page next to this sheet gives the reason for each limit."
LETTERS = 130
"""In a line as wide as the page."""
MOST_FAILURES = 3
"""Sentences below the verdict; the table has all."""
LOWEST_IN, TALLEST_IN, GAP_IN, BAR_IN = 0.85, 1.5, 0.12, 0.6
"""Of a picture, by the room there is; between pictures; beside one for a colour bar."""
NOTE_IN = 0.12
FLATTER_THAN = 0.02
"""Of the depth: an error map's least range."""


@styled
def picture(card: UnitCard, found: Acceptance) -> Figure:
    """The blank gel, its weakest light, where it serves; a press, its depth, its error."""
    figure = blank(PAGE_IN[0], 2 * _row_height_in(found, card.mm_per_px, TALLEST_IN) + 0.35)
    _pictures(figure, card, found, 0.3, TALLEST_IN)
    return figure


def pdf_bytes(card: UnitCard, occasion: Occasion, found: Acceptance) -> bytes:
    """The certificate on one sheet of A4."""
    figure = sheet(card, occasion, found)
    FigureCanvasPdf(figure)
    stream = io.BytesIO()
    spell_out(figure)
    figure.savefig(stream, format="pdf", metadata={"CreationDate": None, "Producer": None})
    return stream.getvalue()


@styled
def sheet(card: UnitCard, occasion: Occasion, found: Acceptance) -> Figure:
    """Verdict, pictures, and every measurement with its limits."""
    figure = blank(*PAGE_IN)
    grade = verdict(found.values)
    _title(figure, card)
    _say(figure, LEFT_IN, 0.88, WORDS[grade], size=13.0, color=COLORS[grade])
    top = 1.05
    for text in (lead(card, occasion, found), origin(card, occasion)):
        for line in wrap(text, LETTERS):
            _say(figure, LEFT_IN, top, line, color=SOFT)
            top += 0.13
    failed = failures(found)
    said = failed[:MOST_FAILURES]
    if len(failed) > MOST_FAILURES:
        more = len(failed) - MOST_FAILURES
        words = "1 more failure is" if more == 1 else f"{more} more failures are"
        said = [*said, f"{words} in the table."]
    for text in said:
        for line in wrap(text, LETTERS):
            _say(figure, LEFT_IN, top, line)
            top += 0.13
    for line in wrap(" ".join(remarks(found)), LETTERS):
        _say(figure, LEFT_IN, top, line)
        top += NOTE_IN
    last = [*not_measured(found), ELSEWHERE]
    notes = [line for text in last for line in wrap(text, LETTERS)]
    bottom = PAGE_IN[1] - FOOT_IN - NOTE_IN * len(notes)
    rows = len(found.values) + len(GROUPS)
    room = bottom - TALLEST_ROW_IN * rows - top - 2 * (TITLE_IN + 0.04) - 0.28
    tall = min(max(room / 2, LOWEST_IN), TALLEST_IN)
    _pictures(figure, card, found, top + 0.13, tall)
    top += 2 * _row_height_in(found, card.mm_per_px, tall) + 0.28
    top = _table(figure, found, top, bottom)
    for note in notes:
        _say(figure, LEFT_IN, top, note, color=SOFT)
        top += NOTE_IN
    return figure


def _table(figure: Figure, found: Acceptance, top: float, bottom: float) -> float:
    """Every measurement; returns where the table ends."""
    groups = [[line for line in lines(found) if line.group == group] for group in GROUPS]
    groups = [group for group in groups if group]
    row_in = min(TALLEST_ROW_IN, (bottom - top) / sum(len(group) + 1 for group in groups))
    for left, heading in zip(COLUMNS_IN[1:4], ("value", "A", "B"), strict=True):
        _say(figure, left, top, heading, color=SOFT)
    for group in groups:
        _say(figure, LEFT_IN, top, group[0].group, size=7.5, color=SOFT)
        top += row_in
        for line in group:
            for left, text in zip(COLUMNS_IN, line.cells[:4], strict=False):
                _say(figure, left, top, text)
            _say(figure, COLUMNS_IN[4], top, line.grade, color=COLORS[line.grade])
            top += row_in
    return top


def _title(figure: Figure, card: UnitCard) -> None:
    title = f"GelSight Wedge {card.serial}"
    _say(figure, LEFT_IN, 0.6, title, size=TITLE_PT * min(1, TITLE_LETTERS / len(title)))


def _say(
    figure: Figure,
    left_in: float,
    top_in: float,
    text: str,
    *,
    size: float = SMALL_PT,
    color: str = INK,
) -> None:
    width_in, height_in = figure.get_size_inches()
    figure.text(left_in / width_in, 1 - top_in / height_in, text, fontsize=size, color=color)


def _pictures(
    figure: Figure, card: UnitCard, found: Acceptance, top_in: float, tallest_in: float
) -> None:
    mm_per_px = card.mm_per_px
    even = smooth(found.gel, SMOOTHING_PX)
    even = even / np.maximum(np.quantile(even, 0.98, axis=(0, 1)), 1e-6)
    shown = found.press.picture
    window = press_window(shown)
    error_mm = (shown.depth_mm - shown.depth_truth_mm)[window]
    flat_mm = FLATTER_THAN * found.press.depth.peak_truth_mm
    worst_mm = max(float(np.nanmax(np.abs(error_mm))), flat_mm)
    width = _picture_width_in()
    gray = found.blank.mean(-1)
    weakest = even[..., channel_indices(card.channels)].min(-1)
    maps = (
        ("blank gel", found.blank.clip(0, 1), "gray", (0.0, 1.0), ""),
        ("weakest light", weakest, "cividis", (0.0, 1.0), "of its brightest"),
        ("presses (white), usable (black)", gray, "gray", (0.0, 1.3 * float(gray.max())), ""),
        (f"a press: {AMPLIFIED_TITLE}", amplified(shown.difference), "gray", (0.0, 1.0), ""),
        ("its depth", shown.depth_mm[window], "viridis", (0.0, deepest_mm(shown)), "mm"),
        ("depth error in the contact", error_mm, SIGNED_COLORS, (-worst_mm, worst_mm), "mm"),
    )
    for index, (title, values, colors, limits, unit) in enumerate(maps):
        column = index % 3
        left = LEFT_IN + column * (width + GAP_IN) + (BAR_IN if column == 2 else 0.0)
        top = top_in + index // 3 * _row_height_in(found, mm_per_px, tallest_in)
        box = fit_box(left, top, width, tallest_in, size_mm(values, mm_per_px))
        image = show_map(figure, box, values, mm_per_px, title, colors=colors, limits=limits)
        image.axes.set_title(title, fontsize=8.0)
        if unit:
            color_bar(figure, image, unit)
        if index in (0, 3, 4, 5):
            scale_bar(image)
        if index == 2:
            outline(image, found.usable, mm_per_px, color="black")
            outline(image, found.covered, mm_per_px)


def _picture_width_in() -> float:
    return (WIDTH_IN - 2 * GAP_IN - 2 * BAR_IN) / 3


def _row_height_in(found: Acceptance, mm_per_px: Pair, tallest_in: float) -> float:
    size = size_mm(found.blank, mm_per_px)
    return fit_box(0.0, 0.0, _picture_width_in(), tallest_in, size).height + TITLE_IN + 0.04
