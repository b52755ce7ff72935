# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Numbers that say where they come from, and dataclasses that check their own bounds.

A number of the design is a plain ``float`` or ``int`` to whoever computes with it; it also
carries its source: ``paper`` (GelSight Wedge, arXiv 2106.08851), ``datasheet``, ``measured``
(on a built sensor or on a public drawing of one) or ``chosen`` by this project.
"""

from dataclasses import dataclass, field, fields
from typing import Any, Literal, TypeVar, cast

from sensor.errors import WedgeError, shown

Source = Literal["paper", "datasheet", "measured", "chosen"]
Number = TypeVar("Number", int, float)


class MarkedFloat(float):
    """A float with a source."""

    source: Source


class MarkedInt(int):
    """An int with a source."""

    source: Source


def _marked(value: Number, source: Source) -> Number:
    marked = MarkedInt(value) if isinstance(value, int) else MarkedFloat(value)
    marked.source = source
    return cast(Number, marked)


def paper(value: Number) -> Number:
    """A number that the paper states."""
    return _marked(value, "paper")


def datasheet(value: Number) -> Number:
    """A number from a manufacturer's or a standard's sheet."""
    return _marked(value, "datasheet")


def measured(value: Number) -> Number:
    """A number measured on a built sensor, or on a public drawing of one."""
    return _marked(value, "measured")


def chosen(value: Number) -> Number:
    """A number that this project chose."""
    return _marked(value, "chosen")


def source_of(value: float) -> Source:
    """Where a number of a design comes from; an unmarked one is a choice."""
    return getattr(value, "source", "chosen")


def bounded(low: float, high: float) -> Any:
    """A dataclass field whose value must lie in ``low <= value <= high``."""
    return field(metadata={"low": low, "high": high})


@dataclass(frozen=True, kw_only=True)
class Bounded:
    """Base of the design's dataclasses: every ``bounded`` field is checked when it is made."""

    def __post_init__(self) -> None:
        """Check the fields.

        Raises:
            WedgeError: a field is not a finite number within its bounds, or has another type.
        """
        for item in fields(self):
            if "low" in item.metadata:
                self._check(item.name, item.metadata["low"], item.metadata["high"], item.type)

    def _check(self, name: str, low: float, high: float, declared: object) -> None:
        value = getattr(self, name)
        where = f"{type(self).__name__.lower()}.{name}"
        whole = declared in (int, "int")
        if isinstance(value, bool) or not isinstance(value, int if whole else (int, float)):
            kind = "a whole number" if whole else "a number"
            raise WedgeError(f"{where} must be {kind}, not {shown(value)}.")
        if not low <= value <= high:
            raise WedgeError(f"{where} = {value} is outside its bounds {low:g} to {high:g}.")
