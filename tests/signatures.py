# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How the types and shapes in signatures are checked while tests run.

jaxtyping's own decorator takes as long as what small functions do, at each of millions of calls.
It sees nothing but types, dtypes and shapes, so it is asked once for each that come together.
"""

import inspect
from collections.abc import Callable, Hashable
from functools import cache, wraps
from itertools import islice
from threading import local
from types import FunctionType
from typing import Any

import jaxtyping
import numpy as np
from beartype import beartype

LOOKED_AT = 4
"""Items of a list or mapping that tell its kind; beartype looks at one."""

each_call = jaxtyping.jaxtyped


def checked(function: Callable[..., Any]) -> Callable[..., Any]:
    """What jaxtyping asks to check a call: arguments and result together, after it.

    It would check the arguments once more, before the call; every function here says what it
    returns, so nothing remains unchecked without that.
    """
    return beartype(function) if "ret0" in inspect.signature(function).parameters else function


def each_kind(*, typechecker: Any) -> Callable[[Any], Any]:
    """The decorator of all that is imported under test: it checks calls of a new kind."""
    check = each_call(typechecker=typechecker)

    def decorate(item: Any) -> Any:
        if not isinstance(item, FunctionType):
            return check(item)
        known: set[Hashable] = set()
        given = local()

        @wraps(item)
        def answered(*_args: Any, **_named: Any) -> Any:
            return given.answer

        @cache
        def checked_answer() -> Callable[..., Any]:
            return check(answered)

        @wraps(item)
        def call(*args: Any, **named: Any) -> Any:
            __tracebackhide__ = True
            answer = item(*args, **named)
            kind = (kind_of(answer), *map(kind_of, args), *named, *map(kind_of, named.values()))
            if kind not in known:
                given.answer = answer
                try:
                    checked_answer()(*args, **named)
                finally:
                    del given.answer
                known.add(kind)
            return answer

        return call

    return decorate


def kind_of(value: Any) -> Hashable:
    """All that a check may look at."""
    kind = type(value)
    if kind is np.ndarray:
        return value.dtype, value.shape
    if kind is str or kind is bool:  # of which a signature may list those that are allowed
        return value
    if kind in (float, int, type(None)):
        return kind
    if kind in (tuple, list):
        return kind, len(value), *map(kind_of, value[:LOOKED_AT])
    if kind is dict:
        return kind, *((key, kind_of(item)) for key, item in islice(value.items(), LOOKED_AT))
    if hasattr(value, "shape") and hasattr(value, "dtype"):
        return kind, value.dtype, value.shape
    return kind


jaxtyping.jaxtyped = each_kind
