# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Where on the pad balls were pressed, and where presses are missing."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float, Int

from sensor.toml import Pair

COLUMNS, ROWS = 5, 4
FAR = 0.25
"""Of the pad's length. Ten presses led over the pad leave no cell's middle farther than 0.23 on 14
of 15 draws from three sets; ten drawn without looking leave one at 0.18 to 0.49."""


@dataclass
class Coverage:
    """Where on the pad presses lie, and how many in each of its cells."""

    size_px: tuple[int, int]
    mm_per_px: Pair
    counts: Int[np.ndarray, "rows columns"] = field(
        default_factory=lambda: np.zeros((ROWS, COLUMNS), np.int64)
    )
    centers_px: list[Pair] = field(default_factory=list)

    def add(self, center_px: Pair) -> None:
        """Count a press by its centre."""
        self.centers_px.append(center_px)
        column = int(np.clip(center_px[0] / self.size_px[0] * COLUMNS, 0, COLUMNS - 1))
        row = int(np.clip(center_px[1] / self.size_px[1] * ROWS, 0, ROWS - 1))
        self.counts[row, column] += 1

    def __str__(self) -> str:
        """The map in one line: a group a row from the top, a character a cell, dots empty."""
        rows = ("".join("." if n == 0 else str(min(n, 9)) for n in row) for row in self.counts)
        return f"[{' '.join(rows)}]"

    @property
    def gaps_mm(self) -> Float[np.ndarray, "rows columns"]:
        """From the middle of each cell to the nearest press; infinite where there is none."""
        cells = np.stack(np.meshgrid(np.arange(COLUMNS), np.arange(ROWS)), -1)
        middles_px = (cells + 0.5) * np.array(self.size_px) / (COLUMNS, ROWS)
        presses_px = np.array(self.centers_px).reshape(-1, 2)
        away_mm = (middles_px[:, :, None] - presses_px) * self.mm_per_px
        return np.asarray(np.linalg.norm(away_mm, axis=-1).min(-1, initial=np.inf))

    @property
    def next_cell(self) -> tuple[int, int]:
        """Row and column of the cell to press next: of the emptiest, the farthest from any press.

        After any number of presses they then lie all over the pad, and no part waits for the last.
        The first goes to the middle.
        """
        if not self.centers_px:
            return (ROWS - 1) // 2, COLUMNS // 2
        emptiest = self.counts == self.counts.min()
        return _largest(np.where(emptiest, self.gaps_mm, -np.inf))

    @property
    def next_px(self) -> Pair:
        """The middle of that cell."""
        row, column = self.next_cell
        width_px, height_px = self.size_px
        return (column + 0.5) * width_px / COLUMNS, (row + 0.5) * height_px / ROWS

    @property
    def next_place(self) -> str:
        """Where to press next, in words."""
        return place_in_words(*self.next_cell)

    @property
    def left_out(self) -> str | None:
        """A sentence where part of the pad is far from every press; ``None`` where none is."""
        gaps_mm = self.gaps_mm
        far = gaps_mm > FAR * self.size_px[0] * self.mm_per_px[0]
        if not far.any():
            return None
        where = place_in_words(*_largest(gaps_mm))
        count = int(far.sum())
        places = f"1 of {far.size} places of the pad, {where}, lies" if count == 1 else (
            f"{count} of {far.size} places of the pad, such as {where}, lie"
        )  # fmt: skip
        return (
            f"{places} farther than {FAR:g} of its length from every press: no press shows the "
            "colours there. Press the ball over the whole pad."
        )

    @property
    def share(self) -> float:
        """Of the cells that hold a press."""
        return float((self.counts > 0).mean())


def place_in_words(row: int, column: int) -> str:
    """A cell of the map, as somebody at the sensor would call it."""
    across = ("top", "upper middle", "lower middle", "bottom")[row]
    along = ("left (base)", "centre left", "centre", "centre right", "right (tip)")[column]
    return f"{across}, {along}"


def _largest(values: Float[np.ndarray, "rows columns"]) -> tuple[int, int]:
    """Row and column of the largest, the first of several."""
    row, column = np.unravel_index(values.argmax(), values.shape)
    return int(row), int(column)
