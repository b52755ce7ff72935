# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How much a fit takes upon itself."""

from enum import Enum, auto


class Effort(Enum):
    """What is asked of a fit; estimators that learn at once, or tell no doubt, know no less."""

    WHOLE = auto()
    """Slopes, and how unsure they are."""
    SLOPES = auto()
    """The same slopes alone: of ``default`` in two thirds of the time."""
    HASTY = auto()
    """Slopes alone, trained a third as long: good for a verdict, not for a unit."""
