# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The one exception that a user may see, and what may stand in its sentence."""


class WedgeError(Exception):
    """A fault that the user can correct, in one sentence: what, where, what to do.

    The command line prints it without a traceback and exits with status 2.
    """


def printable(text: str, most: int = 100) -> str:
    """A stranger's text for a sentence: cut, and without what would steer a terminal."""
    kept = "".join(
        letter if letter.isprintable() else "\N{REPLACEMENT CHARACTER}" for letter in text[:most]
    )
    return kept + "…" * (len(text) > most)


def shown(value: object) -> str:
    """A value as somebody wrote it, cut."""
    try:
        return printable(repr(value))
    except (ValueError, RecursionError):  # thousands of digits, or of lists in each other
        return f"a {type(value).__name__} too large to show"
