# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""TOML read with known keys only, and the small subset of it that we write."""

import difflib
import math
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from sensor.errors import WedgeError, shown
from sensor.files import read_text

Pair = tuple[float, float]

MOST_BYTES = 4 << 20
"""Of a file; a unit's, with the fingerprints of a thousand frames, has less than a tenth."""
MOST_NESTED, MOST_PARTS = 16, 64
_PART = r"""(?:"(?:[^"\\\n]|\\.)*"|'[^'\n]*'|[^\s.=,{}\[\]\#"'][^\s.=,{}\[\]\#]*)[ \t]*\.[ \t]*"""
DEEP_KEY = re.compile(rf"(?<![^\s.=,{{}}\[\]#])(?:{_PART}){{{MOST_PARTS}}}")
"""A dotted key of more parts, of which tomllib takes time and memory as their square."""
LEAST, MOST = 1e-6, 1e6
"""Sizes beyond these are slips; their squares would leave what a float32 can hold."""
PIECE = re.compile(
    r"""\"{3}(?:\\.|[^\\])*?\"{3,5} | "(?:\\.|[^"\\])*" | '{3}.*?'{3,5} | '[^']*'
    | (?<![ \t])[ \t]*\#[^\n]* | [][{}\n]""",
    re.DOTALL | re.VERBOSE,
)
"""Of TOML: a string, a comment with the blanks before it, a bracket or the end of a line."""


def read_toml(path: Path) -> dict[str, Any]:
    """The document of a TOML file.

    Raises:
        WedgeError: the file is missing, unreadable or not TOML, or has more in it than makes sense.
    """
    try:
        text = read_text(path, MOST_BYTES)
        if DEEP_KEY.search(text):
            raise ValueError(f"a key has more than {MOST_PARTS} parts")
        document = tomllib.loads(text)
        _refuse_large(document)
    except (ValueError, RecursionError) as error:
        raise WedgeError(f"{path} is not valid TOML: {error}.") from error
    return document


def _refuse_large(document: Mapping[str, Any]) -> None:
    """Refuse numbers and nesting that no file of ours has; TOML promises 64 bits of an integer.

    Raises:
        ValueError: names the key.
    """
    left: list[tuple[str, object, int]] = [(key, value, 1) for key, value in document.items()]
    while left:
        key, value, depth = left.pop()
        if isinstance(value, int) and not -(2**63) <= value < 2**63:
            raise ValueError(f"{key} must be a finite number, of 64 bits at most")
        if isinstance(value, dict | list) and depth == MOST_NESTED:
            raise ValueError(f"{key} is nested too deeply")
        if isinstance(value, dict):
            left += [(f"{key}.{inner}", item, depth + 1) for inner, item in value.items()]
        elif isinstance(value, list):
            left += [(key, item, depth + 1) for item in value]


def refuse_unknown_keys(given: Mapping[str, Any], known: list[str], where: str) -> None:
    """Refuse a misspelt key, naming the nearest known one.

    Raises:
        WedgeError: a key of ``given`` is not in ``known``.
    """
    for key in given:
        if key not in known:
            near = difflib.get_close_matches(key, known, n=1)
            hint = f"did you mean {near[0]}?" if near else f"known: {', '.join(known)}."
            raise WedgeError(f"{where}unknown key {key}; {hint}")


def refuse_missing_keys(given: Mapping[str, Any], required: Iterable[str]) -> None:
    """Refuse a document without a required key.

    Raises:
        WedgeError: names the first key that is missing.
    """
    for key in required:
        if key not in given:
            raise WedgeError(f"the key {key} is missing.")


def located(path: Path, error: WedgeError) -> WedgeError:
    """The same fault, with the file's name before it where it is not there yet."""
    text = str(error)
    return error if text.startswith(str(path)) else WedgeError(f"{path}: {text}")


def text_line(value: object, key: str) -> str:
    """A value that must be a line of text."""
    if not isinstance(value, str) or not value.strip() or value.splitlines() != [value]:
        raise WedgeError(f"{key} must be a line of text, not {shown(value)}.")
    return value


def finite(value: object, key: str) -> float:
    """A value that must be a finite number."""
    with suppress(OverflowError):
        if isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
            return float(value)
    raise WedgeError(f"{key} must be a finite number, not {shown(value)}.")


def positive(value: object, key: str) -> float:
    """A value that must be a positive number of sensible size."""
    number = finite(value, key)
    if number <= 0:
        raise WedgeError(f"{key} must be a positive number, not {shown(value)}.")
    if not LEAST <= number <= MOST:
        raise WedgeError(f"{key} = {number:g} must lie between {LEAST:g} and {MOST:g}.")
    return number


def positive_pair(value: object, key: str) -> Pair:
    """A value that must be a pair of positive numbers."""
    if not isinstance(value, list) or len(value) != 2:
        raise WedgeError(f"{key} must be a pair [x, y], not {shown(value)}.")
    return positive(value[0], key), positive(value[1], key)


def toml_text(document: Mapping[str, object]) -> str:
    """TOML of a flat document whose values are scalars, lists or one level of tables.

    Raises:
        TypeError: a value has no form in that subset.
        WedgeError: a text holds what is no character.
    """
    lines = [f"{key} = {_toml_value(value)}" for key, value in document.items()]
    return "\n".join(lines) + "\n"


def toml_changed(text: str, document: Mapping[str, object]) -> str:
    """TOML of a document in the order and layout of another, and with that one's comments.

    Lines whose values stay are kept to the letter. Of a value that changes, the comment behind it
    stays; those within it go, as do those behind what is in the document no more.

    Args:
        text: TOML that somebody may have written by hand.
        document: what it is to say, as for ``toml_text``.

    Raises:
        ValueError: ``text`` is not TOML.
    """
    before, after = tomllib.loads(text), tomllib.loads(toml_text(document))
    new = {
        key: toml_text({key: value}).strip()
        for key, value in document.items()
        if before.get(key) != after[key]
    }
    end = "\r\n" if "\r\n" in text else "\n"
    lines: list[str] = []
    table, top = None, 0
    for statement, comment in _statements(text if text.endswith("\n") else text + end):
        key = next(iter(tomllib.loads(statement)), None)
        if statement.lstrip().startswith("["):
            table = key
        if key is None or before[table or key] == after.get(table or key):
            lines.append(statement)
        elif (table or key) in new:
            lines.append(new.pop(table or key) + comment + end)
        if key is not None and table is None:
            top = len(lines)  # what is new goes before the tables
    lines[top:top] = [line + end for line in new.values()]
    changed = "".join(lines)
    with suppress(ValueError):
        if tomllib.loads(changed) == after:
            return changed
    return toml_text(document)  # what changes lay in one of several tables


def _statements(text: str) -> Iterator[tuple[str, str]]:
    """The lines of TOML, those of one value together, and the comment at their end."""
    begin, depth, comment = 0, 0, ""
    for piece in PIECE.finditer(text):
        mark = piece[0].lstrip(" \t")[0]
        if mark in "[{":
            depth += 1
        elif mark in "]}":
            depth -= 1
        elif mark == "#" and not depth:
            comment = piece[0].rstrip("\r")
        elif mark == "\n" and not depth:
            yield text[begin : piece.end()], comment
            begin, comment = piece.end(), ""


def _toml_value(value: object) -> str:
    match value:
        case bool():
            return "true" if value else "false"
        case int():
            return int.__repr__(value)
        case float():
            return float.__repr__(value)  # of a subclass too, such as numpy's
        case str():
            if any("\ud800" <= c <= "\udfff" for c in value):  # of bytes that are no UTF-8
                raise WedgeError(f"{value!a} cannot be written as text: use other characters.")
            return '"' + "".join(_toml_character(c) for c in value) + '"'
        case list() | tuple():
            return "[" + ", ".join(_toml_value(item) for item in value) + "]"
        case Mapping():
            items = (f"{_toml_key(key)} = {_toml_value(item)}" for key, item in value.items())
            return "{" + ", ".join(items) + "}"
    raise TypeError(f"no TOML form for {type(value).__name__}")


def _toml_key(key: str) -> str:
    bare = key and all(c.isascii() and (c.isalnum() or c in "_-") for c in key)
    return key if bare else _toml_value(key)


def _toml_character(character: str) -> str:
    if character in '"\\':
        return "\\" + character
    if character < " " or character == "\x7f":
        return f"\\u{ord(character):04x}"
    return character
