# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Intervals of means over presses, and what is said and drawn of those that have none."""

import math
from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float64
from scipy.special import stdtrit

Interval = tuple[float, float]
"""Lower and upper end."""
WITHIN = 0.95
RESAMPLES = 2000
LEAST_PRESSES = 3
"""One press does not tell how presses scatter. Two tell so little that where errors scatter by a
quarter, three intervals of ten would reach beyond ten times the mean."""


def enough(presses: int) -> bool:
    """Whether a mean over so many presses has an interval."""
    return presses >= LEAST_PRESSES


def bootstrap_intervals(
    statistic: Callable[[Float64[np.ndarray, "r p"]], Float64[np.ndarray, "r k"]],
    presses: int,
    seed: int,
) -> list[Interval] | None:
    """95 % intervals over presses of numbers that are never negative, such as mean errors.

    Presses are drawn again, as many as there are, ``RESAMPLES`` times; how the numbers scatter is
    their standard error, and Student's t tells how many of it to go. Draws scatter about these
    presses and not about all that could be, so their variance is short by (p - 1) / p (Hesterberg,
    2015, doi.org/10.1080/00031305.2015.1089789), which is set right. The steps are ratios, those
    of the number's logarithm to first order: no end is negative, and the upper one is farther, as
    few presses seldom hold the worst.

    Args:
        statistic: numbers from how often each press was drawn, both one row a draw; NaN where a
            draw does not tell.
        presses: how many there are.
        seed: of the draws.

    Returns:
        One for each number; ``None`` for too few presses.
    """
    if not enough(presses):
        return None
    drawn = np.random.default_rng(seed).multinomial(
        presses, np.full(presses, 1 / presses), size=RESAMPLES
    )
    values = statistic(np.ones((1, presses)))[0]
    scatter = np.nanstd(statistic(drawn.astype(float)), axis=0)
    error = math.sqrt(presses / (presses - 1)) * scatter
    share = np.divide(error, values, out=np.zeros_like(error), where=values > 0)
    factor = np.exp(stdtrit(presses - 1, (1 + WITHIN) / 2) * share)
    return list(zip((values / factor).tolist(), (values * factor).tolist(), strict=True))


def counted(presses: int) -> str:
    """So many presses in words."""
    return f"{presses} press" if presses == 1 else f"{presses} presses"


def remark(words: str, *presses: int) -> str:
    """A caption's words on intervals, with what is said of means over too few presses for one.

    Args:
        words: such as "the 95 % interval below each".
        presses: of each mean that the caption speaks of.
    """
    few = sorted({count for count in presses if not enough(count)})
    if not few:
        return words
    said = " or ".join(map(counted, few))
    if any(map(enough, presses)):
        return f"{words}; there is none for {said}"
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
