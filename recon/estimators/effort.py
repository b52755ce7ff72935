# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How thorough a fit is to be."""

from enum import Enum, auto


class Effort(Enum):
    """What a fit is to find out; estimators that are fitted at once make no difference."""

    WHOLE = auto()
    """Slopes, and how unsure they are."""
    SLOPES = auto()
    """The same slopes alone: of ``default`` in two thirds of the time."""
    HASTY = auto()
    """Slopes alone, trained a third as long: good for a verdict, not for a unit."""
