# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the figures share: type, and colours that colour-blind readers tell apart."""

from functools import cache

import matplotlib
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.font_manager import findfont, get_font
from matplotlib.text import Text

# Okabe and Ito, Color Universal Design, 2008.
BLUE, ORANGE, GREEN, RED, SKY, PURPLE = (
    "#0072B2",
    "#E69F00",
    "#009E73",
    "#D55E00",
    "#56B4E9",
    "#CC79A7",
)
INK, SOFT, FAINT = "#1b1f24", "#5b6470", "#e3e6ea"
CHANNELS = {"R": RED, "G": GREEN, "B": BLUE}
SERIES = (BLUE, ORANGE, GREEN, PURPLE, SKY, RED)
"""For estimators, in the order in which they are given."""
MARKS = "os^Dv<"
DASHES = ("-", "--", ":", "-.")
"""With colours: who sees none, or prints without, tells curves apart by these."""

HALF_IN, FULL_IN = 4.8, 9.4
"""Widths of figures: two share a line of the page, or one takes it."""

TITLE_PT = 9.5
MEAN_LETTER_PT = 0.62
"""Width of a letter of the title, as a share of its size."""

FONT = "DejaVu Sans"
UNKNOWN = "?"
"""Instead of a letter that the font lacks, as a name may have."""

styled = matplotlib.rc_context(
    {
        "font.family": FONT,
        "font.size": 9,
        "text.color": INK,
        "text.parse_math": False,  # a unit's name may have dollars
        "axes.labelcolor": INK,
        "axes.edgecolor": SOFT,
        "axes.linewidth": 0.8,
        "axes.titlesize": TITLE_PT,
        "axes.titlelocation": "left",
        "axes.axisbelow": True,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.grid": False,
        "grid.color": FAINT,
        "grid.linewidth": 0.8,
        "xtick.color": SOFT,
        "ytick.color": SOFT,
        "xtick.labelsize": 8,
        "ytick.labelsize": 8,
        "legend.frameon": False,
        "legend.fontsize": 8,
        "lines.linewidth": 1.6,
    }
)
"""Decorates every function that makes a figure; the user's own settings come back after it."""


def name_decades(axis: Axis) -> None:
    """Plain numbers along a logarithmic axis, whose own names are the formulas that we forbid."""
    axis.set_major_formatter(lambda value, _: f"{value:g}")
    axis.set_minor_formatter(lambda value, _: f"{value:g}" if f"{value:e}"[0] in "25" else "")


def card(width_in: float, height_in: float) -> Figure:
    """An empty white figure that lays itself out."""
    return Figure(figsize=(width_in, height_in), facecolor="white", layout="constrained")


@cache
def _letters() -> frozenset[str]:
    return frozenset(map(chr, get_font(findfont(FONT)).get_charmap()))


def spell_out(figure: Figure) -> None:
    """Put ``UNKNOWN`` for letters that would be drawn as boxes, with a warning each."""
    known = _letters() | {"\n"}
    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        if not known.issuperset(text.get_text()):
            text.set_text("".join(x if x in known else UNKNOWN for x in text.get_text()))


def fitted(text: str, width_in: float) -> str:
    """A title cut in its middle so that it fits a width."""
    letters = int(72 * width_in / (TITLE_PT * MEAN_LETTER_PT))
    if len(text) <= letters:
        return text
    kept = max(letters - 1, 2)
    return f"{text[: kept - kept // 2]}…{text[-(kept // 2) :]}"
