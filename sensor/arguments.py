# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What programs beside `wedge` ask of the words they are given, and how they end early."""

import argparse
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager

from sensor.errors import WedgeError


def at_least(least: int) -> Callable[[str], int]:
    """A type for ``argparse``: whole numbers from ``least`` on."""

    def parsed(text: str) -> int:
        if not text.isdecimal() or int(text) < least:
            raise argparse.ArgumentTypeError(f"{text!r} is no whole number from {least} on")
        return int(text)

    return parsed


def some_of(known: Collection[str]) -> Callable[[str], tuple[str, ...]]:
    """A type for ``argparse``: some of the known words, with commas between them."""

    def parsed(text: str) -> tuple[str, ...]:
        words = tuple(word.strip() for word in text.split(","))
        for word in words:
            if word not in known:
                raise argparse.ArgumentTypeError(
                    f"{word!r} is none of {', '.join(known)}, which have commas between them"
                )
        return words

    return parsed


@contextmanager
def ending_in_a_sentence(parser: argparse.ArgumentParser) -> Iterator[None]:
    """Exit with 2 and the sentence of what the block refuses; with 130 where Ctrl-C ends it."""
    try:
        yield
    except WedgeError as error:
        parser.exit(2, f"{parser.prog}: {error}\n")
    except KeyboardInterrupt as interrupted:
        parser.exit(130, f"{parser.prog}: {str(interrupted) or 'interrupted'}\n")
