# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The option --seed, which several subcommands share."""

from typing import Annotated

from tyro.constructors import PrimitiveConstructorSpec

MOST = 2**63 - 1
"""The largest that numpy and torch both take."""


def seed_of(words: list[str]) -> int:
    """The seed that a word of the command line names.

    Raises:
        ValueError: the word is no whole number from 0 to MOST.
    """
    (word,) = words
    if not (word.isascii() and word.isdecimal() and len(word) < 20 and int(word) <= MOST):
        raise ValueError(f"{word} is not a whole number from 0 to {MOST}")
    return int(word)


Seed = Annotated[
    int,
    PrimitiveConstructorSpec(
        nargs=1,
        metavar="INT",
        instance_from_str=seed_of,
        is_instance=lambda value: isinstance(value, int),
        str_from_instance=lambda seed: [str(seed)],
    ),
]
