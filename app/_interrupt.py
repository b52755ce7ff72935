# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Ctrl-C as the way to end a loop over frames, with what was done so far kept."""

import signal
from collections.abc import Iterable, Iterator
from typing import Generic, TypeVar

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
