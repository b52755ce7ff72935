# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Once a tracker is warm, no touch waits for a compiler."""

from collections.abc import Iterator
from types import ModuleType

from recon.pose import agreement, cells, equations, level, template, warm_up
from recon.pose.tracker import Tracker
from tests.recon.pose.touched import bead_pair, corner

MODULES = (agreement, cells, equations, level, template)


def loops(module: ModuleType) -> Iterator[tuple[str, object]]:
    return ((name, item) for name, item in vars(module).items() if hasattr(item, "signatures"))


def signatures() -> dict[str, list[object]]:
    return {
        f"{module.__name__}.{name}": list(loop.signatures)  # type: ignore[attr-defined]
        for module in MODULES
        for name, loop in loops(module)
    }


def test_every_loop_has_run_before_a_touch_comes() -> None:
    warm_up.warm_up.__wrapped__()
    before = signatures()
    assert sum(map(bool, before.values())) > 10
    for touches in (bead_pair(0)[:2], (corner(), corner())):
        track = Tracker()
        for touch in touches:
            track(touch)
    assert signatures() == before
