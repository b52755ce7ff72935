# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A field's value against its bound, refused in one sentence."""

import math
from dataclasses import fields
from typing import get_type_hints

from sensor.design import Wedge
from sensor.errors import WedgeError

EPSILON = 1e-6


def at_least(field: str, value: float, bound: float, why: str) -> None:
    """Raise if a field's value is below its bound."""
    if value < bound - EPSILON:
        shown = math.ceil(bound * 1000 - 1e-3) / 1000
        _, most = _own_range(field)
        but = f", but may be {most:g} at most" if shown > most else ""
        raise WedgeError(_sentence(field, value, f"at least {shown:g}{but}", why, bool(but)))


def at_most(field: str, value: float, bound: float, why: str) -> None:
    """Raise if a field's value is above its bound."""
    if value > bound + EPSILON:
        shown = math.floor(bound * 1000 + 1e-3) / 1000
        least, _ = _own_range(field)
        but = f", but may not be below {least:g}" if shown < least else ""
        raise WedgeError(_sentence(field, value, f"at most {shown:g}{but}", why, bool(but)))


def _sentence(field: str, value: float, bound: str, why: str, in_vain: bool) -> str:
    other = "; so another field has to change" if in_vain else ""
    return f"{field} = {value:g} must be {bound}: {why}{other}."


def _own_range(field: str) -> tuple[float, float]:
    """What a field may be in any design."""
    section, _, name = field.partition(".")
    of_section = get_type_hints(Wedge)[section]
    metadata = next(item.metadata for item in fields(of_section) if item.name == name)
    return metadata.get("low", -math.inf), metadata.get("high", math.inf)
