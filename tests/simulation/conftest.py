# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Small renders by the engine that every machine has."""

from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import Any

import pytest

from simulation.engine import SCALAR


class InLine(Executor):
    """Runs each task at once, in this process."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


@pytest.fixture(scope="session")
def mitsuba() -> Any:
    pytest.importorskip("mitsuba", reason="the twin renders with mitsuba")
    with SCALAR.loaded() as mi:
        return mi
