# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C, and what else asks to end, as the way to end well: what was done so far is kept."""

import signal
from collections.abc import Iterable, Iterator
from types import FrameType
from typing import Any, Generic, TypeVar

Item = TypeVar("Item")


class UntilInterrupted(Generic[Item]):
    """Gives what it is given until Ctrl-C, which ends it between two items and never amid one.

    While the next item is awaited Ctrl-C ends at once. A second Ctrl-C is the usual one. Outside
    the main thread, or where Ctrl-C was ignored or is somebody's already, nothing is changed.
    """

    def __init__(self, items: Iterable[Item]) -> None:
        self._items = items
        self._awaited = False
        self.interrupted = False
        """Whether Ctrl-C has ended it."""

    def __iter__(self) -> Iterator[Item]:
        before = signal.getsignal(signal.SIGINT)
        ours = before is signal.default_int_handler
        if ours:
            try:
                signal.signal(signal.SIGINT, self._end)
            except ValueError:  # not the main thread
                ours = False
        items = iter(self._items)
        try:
            while not self.interrupted:
                try:
                    self._awaited = True
                    item = next(items)
                except StopIteration:
                    return
                except KeyboardInterrupt:
                    if not self.interrupted:
                        raise
                    return
                finally:
                    self._awaited = False
                yield item
        finally:
            if ours:
                signal.signal(signal.SIGINT, before)

    def _end(self, *_: object) -> None:
        twice, self.interrupted = self.interrupted, True
        if self._awaited or twice:
            raise KeyboardInterrupt


class Asked:
    """Whether Ctrl-C, SIGTERM or SIGHUP has asked to end the block, which breaks off nowhere.

    They do no more than that in it, however often they come: `timeout` sends its signal twice. What
    was ignored stays so.
    """

    def __init__(self) -> None:
        self.to_end = False
        self.again = False
        """Whether Ctrl-C has asked twice: nothing should be waited for any more."""
        self._before: dict[int, Any] = {}

    def __enter__(self) -> "Asked":
        for name in ("SIGINT", "SIGTERM", "SIGHUP"):
            number = getattr(signal, name, None)  # Windows has no hangup
            if number is not None and signal.getsignal(number) not in (signal.SIG_IGN, None):
                self._before[number] = signal.signal(number, self._note)
        return self

    def __exit__(self, *_: object) -> None:
        for number, before in self._before.items():
            signal.signal(number, before)

    def _note(self, number: int, _: FrameType | None) -> None:
        self.again |= self.to_end and number == signal.SIGINT
        self.to_end = True
