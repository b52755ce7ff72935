# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Fields of a design by name: their values, their bounds, and refusals in one sentence."""

import math
from dataclasses import dataclass, fields, replace
from operator import attrgetter
from typing import NoReturn, get_type_hints

from sensor.design import Wedge
from sensor.errors import WedgeError

EPSILON = 1e-6


@dataclass(frozen=True)
class Other:
    """The bound on a field's other side, for a refusal to name where both cannot be kept."""

    bound: float
    why: str
    """What it is for, as in "but may be 13.55 at most to fit in the case"."""
    way_out: str
    """What to change instead."""


@dataclass(frozen=True)
class Bounds:
    """Refuses a design that has a field beyond its bound."""

    design: Wedge

    def at_least(self, field: str, bound: float, why: str, most: Other | None = None) -> None:
        """Raise if a field's value is below its bound.

        Args:
            field: Group and name.
            bound: Least value.
            why: What is wrong below it.
            most: The design's largest value.
        """
        value = value_of(self.design, field)
        if value < bound - EPSILON:
            shown = _rounded_up(bound)
            own = own_range(field)[1]
            if shown > own:
                but = f"but may be {own:g} at most"
                _refuse(field, value, f"at least {shown:g}, {but}", why, _OTHER)
            if most and shown > _rounded_down(most.bound):
                but = f"but may be {_rounded_down(most.bound):g} at most {most.why}"
                _refuse(field, value, f"at least {shown:g}, {but}", why, most.way_out)
            _refuse(field, value, f"at least {shown:g}", why)

    def at_most(self, field: str, bound: float, why: str, least: Other | None = None) -> None:
        """Raise if a field's value is above its bound.

        Args:
            field: Group and name.
            bound: Largest value.
            why: What is wrong above it.
            least: The design's least value.
        """
        value = value_of(self.design, field)
        if value > bound + EPSILON:
            shown = _rounded_down(bound)
            own = own_range(field)[0]
            if shown < own:
                but = f"but may not be below {own:g}"
                _refuse(field, value, f"at most {shown:g}, {but}", why, _OTHER)
            if least and shown < _rounded_up(least.bound):
                but = f"but may not be below {_rounded_up(least.bound):g} {least.why}"
                _refuse(field, value, f"at most {shown:g}, {but}", why, least.way_out)
            _refuse(field, value, f"at most {shown:g}", why)


_OTHER = "so another field has to change"


def _rounded_up(bound: float) -> float:
    return math.ceil(bound * 1000 - 1e-3) / 1000


def _rounded_down(bound: float) -> float:
    return math.floor(bound * 1000 + 1e-3) / 1000


def _refuse(field: str, value: float, bound: str, why: str, way_out: str = "") -> NoReturn:
    out = f"; {way_out}" if way_out else ""
    raise WedgeError(f"{field} = {value:g} must be {bound}: {why}{out}.")


def own_range(field: str) -> tuple[float, float]:
    """What a field may be in any design."""
    section, _, name = field.partition(".")
    of_section = get_type_hints(Wedge)[section]
    metadata = next(item.metadata for item in fields(of_section) if item.name == name)
    return metadata.get("low", -math.inf), metadata.get("high", math.inf)


def value_of(design: Wedge, field: str) -> float:
    """What a field is in a design."""
    return float(attrgetter(field)(design))


def with_value(design: Wedge, field: str, value: float) -> Wedge:
    """The design with another value of one field."""
    section, _, name = field.partition(".")
    return replace(design, **{section: replace(getattr(design, section), **{name: value})})
