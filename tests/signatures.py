# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How the types and shapes in signatures are checked while tests run."""

import inspect
from collections.abc import Callable
from typing import Any

from beartype import beartype


def checked(function: Callable[..., Any]) -> Callable[..., Any]:
    """What jaxtyping asks to check a call: arguments and result together, after it.

    It would check the arguments once more, before the call; every function here says what it
    returns, so nothing remains unchecked without that.
    """
    return beartype(function) if "ret0" in inspect.signature(function).parameters else function
