# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A field's value against its bound, refused in one sentence."""

import math

from sensor.errors import WedgeError

EPSILON = 1e-6


def at_least(field: str, value: float, bound: float, why: str) -> None:
    """Raise if a field's value is below its bound."""
    if value < bound - EPSILON:
        shown = math.ceil(bound * 1000 - 1e-3) / 1000
        raise WedgeError(f"{field} = {value:g} must be at least {shown:g}: {why}.")


def at_most(field: str, value: float, bound: float, why: str) -> None:
    """Raise if a field's value is above its bound."""
    if value > bound + EPSILON:
        shown = math.floor(bound * 1000 + 1e-3) / 1000
        raise WedgeError(f"{field} = {value:g} must be at most {shown:g}: {why}.")
