# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The last seconds of a number on the page of `wedge live`, as a line."""

from collections.abc import Sequence
from itertools import pairwise

from nicegui import ui

HISTORY_S = 20.0
GAP_S = 2.5
"""Nothing is drawn between points farther apart: nobody knows what was there. Pictures of a dataset
come every second."""


class Course:
    """The last seconds of a number as a line, and below it what its top stands for."""

    def __init__(self, unit: str, digits: int, name: str) -> None:
        self._unit, self._digits = unit, digits
        self._line = ui.html("", sanitize=False).classes("w-full")
        self._words = ui.label(f"last {HISTORY_S:g} s").classes(f"quiet text-xs {name}-most")

    def show(self, points: Sequence[tuple[float, float]]) -> None:
        """Draw times in seconds and values in the unit."""
        self._line.set_content(sparkline(points))
        most = max((value for _, value in points), default=0.0)
        self._words.set_text(f"last {HISTORY_S:g} s, up to {most:.{self._digits}f} {self._unit}")


def sparkline(points: Sequence[tuple[float, float]]) -> str:
    """The last seconds of a number as a small drawing, from zero to its largest.

    Args:
        points: times in seconds, in order, and values.
    """
    if len(points) < 2:
        return ""
    last_s = points[-1][0]
    most = max(1e-6, *(value for _, value in points))
    places = [
        f"{100 * (1 - (last_s - t) / HISTORY_S):.2f},{29 - 27 * max(value, 0) / most:.2f}"
        for t, value in points
    ]
    gaps = [i for i, ((t, _), (later, _)) in enumerate(pairwise(points), 1) if later - t > GAP_S]
    lines = [places[i:j] for i, j in pairwise([0, *gaps, len(places)])]
    drawn = "".join(
        # A line of one point is a dot.
        f'<polyline points="{" ".join(line if len(line) > 1 else 2 * line)}" fill="none" '
        'stroke="#6fe3d0" stroke-width="1.6" stroke-linecap="round" '
        'vector-effect="non-scaling-stroke"/>'
        for line in lines
    )
    return (
        '<svg viewBox="0 0 100 30" preserveAspectRatio="none" width="100%" height="44">'
        '<line x1="0" y1="29.5" x2="100" y2="29.5" stroke="#2a3542" stroke-width=".5"/>'
        f"{drawn}</svg>"
    )
