# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Which means over presses have an interval, and what is said and drawn of those that have none."""

import math
from collections.abc import Sequence

Interval = tuple[float, float]
"""Lower and upper end."""
LEAST_PRESSES = 2
"""One press does not tell how presses scatter: drawn anew, it is itself."""


def enough(presses: int) -> bool:
    """Whether a mean over so many presses has an interval."""
    return presses >= LEAST_PRESSES


def counted(presses: int) -> str:
    """So many presses in words."""
    return f"{presses} press" if presses == 1 else f"{presses} presses"


def remark(words: str, *presses: int) -> str:
    """A caption's words on intervals, with what is said of means over too few presses for one.

    Args:
        words: such as "below each its 95 % interval".
        presses: of each mean that the caption speaks of.
    """
    few = sorted({count for count in presses if not enough(count)})
    if not few:
        return words
    said = " or ".join(map(counted, few))
    if any(map(enough, presses)):
        return f"{words}; of {said} there is none"
    return f"{said}, too few for an interval"


def whiskers(
    means: Sequence[float], intervals: Sequence[Interval | None]
) -> tuple[list[float], list[float]] | None:
    """How far intervals reach below and above their means, as error bars take it.

    NaN, which is not drawn, where a mean has none; ``None`` where none of them has one.
    """
    if not any(intervals):
        return None
    below, above = [], []
    for mean, interval in zip(means, intervals, strict=True):
        low, high = interval or (math.nan, math.nan)
        below.append(mean - low)
        above.append(high - mean)
    return below, above
