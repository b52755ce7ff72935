# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The outcome of one check."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Result:
    """One figure against its bound, in words for the report."""

    check: str
    subject: str
    value: float
    unit: str
    bound: float
    sense: Literal["at least", "at most", "for information"]
    detail: str = ""

    @property
    def passed(self) -> bool:
        """Whether the figure keeps its bound; NaN never does."""
        if self.sense == "for information":
            return True
        if self.sense == "at least":
            return bool(self.value >= self.bound)
        return bool(self.value <= self.bound)
