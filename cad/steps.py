# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What an assembly is: bodies, each with its way, and the steps that bring them together.

No solid is made here: who draws the steps need not load the solid modeller.
"""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

from cad.motions import Way


@dataclass(frozen=True)
class Body:
    """One body in its place, and the way by which it is taken out again."""

    name: str
    part: str
    """Id of the part in the bill."""
    material: str
    way: Way


@dataclass(frozen=True)
class Step:
    """One step of the guide: new bodies, or a group made before, join a group."""

    id: str
    title: str
    group: str
    bodies: tuple[str, ...]
    brings: str = ""
    """A group finished before, that now goes in as a whole along the step's first body's way."""


@dataclass(frozen=True)
class Assembly:
    """All bodies by name, and the steps in the order of the guide."""

    bodies: Mapping[str, Body]
    steps: tuple[Step, ...]

    def counts(self) -> dict[str, int]:
        """How many of each part the sensor holds, in the order of the guide."""
        return dict(Counter(self.bodies[name].part for step in self.steps for name in step.bodies))

    def moving(self, step: Step) -> tuple[str, ...]:
        """Bodies that move in a step."""
        return self.group_before(step, step.brings) if step.brings else step.bodies

    def standing(self, step: Step) -> tuple[str, ...]:
        """Bodies that a step's bodies must pass."""
        return self.group_before(step, step.group)

    def group_before(self, step: Step, group: str) -> tuple[str, ...]:
        """Bodies of a group before a step."""
        names: list[str] = []
        for earlier in self.steps[: self.steps.index(step)]:
            if earlier.group == group:
                names += self.moving(earlier)
        return tuple(names)

    def way(self, step: Step, name: str) -> Way:
        """The way of a body in a step; a group moves along the way of its first body."""
        return self.bodies[self.moving(step)[0] if step.brings else name].way
