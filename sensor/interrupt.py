# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C, and what else asks to end, as the way to end well: what was done so far is kept."""

import signal
import threading
from collections.abc import Iterable, Iterator
from types import FrameType
from typing import Any, Generic, NoReturn, TypeVar

Item = TypeVar("Item")


def _asking() -> list[signal.Signals]:
    """What asks to end; Windows has no hangup."""
    return [x for x in signal.Signals if x.name in ("SIGINT", "SIGTERM", "SIGHUP")]


class UntilInterrupted(Generic[Item]):
    """Gives what it is given until Ctrl-C, SIGTERM or SIGHUP ends it, between two items.

    While the next item is awaited they end it at once, and amid one never, but for a second Ctrl-C,
    which is the usual one. A second SIGTERM or SIGHUP is not heard, as `timeout` sends its signal
    twice, nor is one afterwards, when what came is being kept. Outside the main thread, or where
    one was ignored or Ctrl-C is somebody's already, nothing is changed.
    """

    def __init__(self, items: Iterable[Item]) -> None:
        self._items = items
        self._awaited = False
        self._before: dict[int, Any] = {}
        self._number = signal.SIGINT
        self.interrupted = False
        """Whether one of them has ended it."""

    def __iter__(self) -> Iterator[Item]:
        self._listen()
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
            self._restore(also_asked=not self.interrupted)

    @property
    def asked_by(self) -> str:
        """What has ended it, in words."""
        return "Ctrl-C" if self._number == signal.SIGINT else self._number.name

    def give_up(self) -> NoReturn:
        """End as if nobody had listened: there is nothing to keep."""
        self._restore(also_asked=True)
        signal.raise_signal(self._number)
        raise KeyboardInterrupt

    def _listen(self) -> None:
        if threading.current_thread() is not threading.main_thread():
            return
        for number in _asking():
            before = signal.getsignal(number)
            is_ours = number != signal.SIGINT or before is signal.default_int_handler
            if is_ours and before not in (signal.SIG_IGN, None):
                self._before[number] = signal.signal(number, self._end)

    def _restore(self, *, also_asked: bool) -> None:
        for number in [x for x in self._before if also_asked or x == signal.SIGINT]:
            signal.signal(number, self._before.pop(number))

    def _end(self, number: int, _: FrameType | None) -> None:
        is_first, self.interrupted = not self.interrupted, True
        if is_first:
            self._number = signal.Signals(number)
        if (is_first and self._awaited) or (not is_first and number == signal.SIGINT):
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
        for number in _asking():
            if signal.getsignal(number) not in (signal.SIG_IGN, None):
                self._before[number] = signal.signal(number, self._note)
        return self

    def __exit__(self, *_: object) -> None:
        for number, before in self._before.items():
            signal.signal(number, before)

    def _note(self, number: int, _: FrameType | None) -> None:
        self.again |= self.to_end and number == signal.SIGINT
        self.to_end = True
