# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The words of a command line as parameters of a subcommand, or what is wrong with them."""

import inspect
import io
import os
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stderr
from functools import partial, wraps
from itertools import pairwise
from typing import Annotated, Any, get_args, get_origin

from sensor.errors import WedgeError

KINDS = {"INT": "whole number", "FLOAT": "number"}
"""Tyro's words for what a value should be."""
SUCH_AS = {"FLOAT": ", such as 2.42"}
METAVARS = {
    "address": "ADDRESS",
    "background": "IMAGE",
    "cluster": "ADDRESS",
    "design": "DESIGN",
    "estimator": "NAME",
    "like": "DATASET",
    "mesh": "FILE",
    "out": "DIR",
    "pad_size_mm": "FLOAT FLOAT",
    "scene": "NAME|FILE",
    "sensor": "NAME",
    "start": "FILE",
}
"""What stands for a parameter's value in every subcommand that says nothing else of its own."""

HEADING = re.compile(r"\s*[A-Z][a-z]+:")
"""Of a docstring's section."""
RULE = re.compile(r"\s*-{4,}\s*")
"""Between the parts of a box where the terminal knows ASCII alone."""


def understood(command: Callable[..., Any], name: str, words: Sequence[str]) -> Callable[[], Any]:
    """The subcommand with its parameters, to be called.

    Args:
        command: its `main`.
        name: as a person types it, such as `wedge calibrate`.
        words: what was typed behind the name.

    Raises:
        WedgeError: says which word is wrong, or what is missing.
        SystemExit: help was asked for and is printed.
    """
    import tyro

    @wraps(command)
    def given(*values: Any, **named: Any) -> Callable[[], Any]:
        return partial(command, *values, **named)

    del given.__wrapped__  # whose docstring tyro would read instead
    given.__signature__ = inspect.signature(command)  # type: ignore[attr-defined]
    given.__annotations__ = {
        name: _as_shown(parameter)
        for name, parameter in inspect.signature(command).parameters.items()
    }
    given.__doc__ = without_breaks(command.__doc__ or "")
    complaint = io.StringIO()
    try:
        with redirect_stderr(complaint), _on_one_line(not {"-h", "--help"} & set(words)):
            call: Callable[[], Any] = tyro.cli(
                given,
                prog=name,
                args=words,
                config=(tyro.conf.FlagCreatePairsOff, tyro.conf.DisallowNone),
            )
    except SystemExit as stop:
        if not stop.code:
            raise
        sentence = in_a_sentence(complaint.getvalue(), name)
        raise WedgeError(f"{sentence} `{name} --help` explains.") from stop
    if again := _given_again(command, words):
        raise WedgeError(f"{again} is given again: name all values behind one {again}.")
    return call


def _given_again(command: Callable[..., Any], words: Sequence[str]) -> str:
    """An option of several values that stands there twice, where tyro keeps the last ones alone."""
    given = [word.partition("=")[0] for word in words]
    for name, parameter in inspect.signature(command).parameters.items():
        kind = parameter.annotation
        if get_origin(kind) is Annotated:
            kind = get_args(kind)[0]
        option = f"--{name}".replace("_", "-")
        if ... in get_args(kind) and given.count(option) > 1:
            return option
    return ""


def _as_shown(parameter: inspect.Parameter) -> Any:
    """A parameter's type, which help shows in words of ours, with no default where none is."""
    import tyro

    told: Sequence[Any] = ()
    kind = parameter.annotation
    if get_origin(kind) is Annotated:
        kind, *told = get_args(kind)
    hint = None
    if parameter.default in (None, "", ()) or parameter.default is False:
        hint = ""
    elif parameter.default is parameter.empty and get_origin(kind) is tuple:
        hint = "(required)"  # one or more, of which tyro says that none is the default
    shown = tyro.conf.arg(
        metavar=None if kind is bool else METAVARS.get(parameter.name), help_behavior_hint=hint
    )
    # What a subcommand says of its own comes later and counts.
    return Annotated[(kind, shown, *told)]


def without_breaks(text: str) -> str:
    """A docstring whose lines go on where tyro would break them amid a sentence.

    That is before a line within a paragraph that is inset or begins with no letter.
    """
    lines: list[str] = []
    for line in text.splitlines():
        words, before = line.strip(), lines[-1] if lines else ""
        inset = len(line) - len(line.lstrip()) > len(before) - len(before.lstrip())
        goes_on = before.strip() and not HEADING.fullmatch(before)
        if words and goes_on and (inset or not words[0].isalpha()):
            lines[-1] += f" {words}"
        else:
            lines.append(line)
    return "\n".join(lines)


@contextmanager
def _on_one_line(wanted: bool) -> Iterator[None]:
    """Let a complaint have lines of any length, so that no word in it is cut in two."""
    before = os.environ.get("COLUMNS")
    if wanted:
        os.environ["COLUMNS"] = "10000"
    try:
        yield
    finally:
        if wanted:
            del os.environ["COLUMNS"]
        if wanted and before is not None:
            os.environ["COLUMNS"] = before


def in_a_sentence(box: str, name: str) -> str:
    """What tyro says in a box of several lines."""
    lines = [line.strip("│╭╮╰╯") for line in box.splitlines()]
    rules = [i for i, line in enumerate(lines) if "──" in line or RULE.fullmatch(line)]
    parts = [lines[i + 1 : j] for i, j in pairwise([*rules, len(lines)])]
    first = " ".join(" ".join(parts[0]).split()) if parts else " ".join(box.split())
    if first.startswith("Missing from"):
        return f"`{name}` needs {' and '.join(_entries(parts[0]))}."
    if found := re.match(r"Unrecognized options: (.*)", first):
        near = [entry.split()[0] for part in parts[1:] for entry in _entries(part)]
        guess = f": did you mean {' or '.join(near)}?" if near else "."
        return f"`{name}` does not know {found[1]}{guess}"
    if found := re.match(
        r"invalid choice '(.*)' for argument '(.*)'. Expected one of (.*)\.", first
    ):
        choices = ", ".join(re.findall(r"'([^']*)'", found[3]))
        return f"{found[2]} {found[1]} is not one of {choices}."
    if found := re.match(r"Error parsing (\S+): (.* is not a whole .*)", first):  # in words of ours
        return f"{found[1]} {found[2]}."
    if found := re.match(r"Error parsing (\S+): (.*)", first):
        given = re.search(r"instantiated from \[(.*?)\]|: ('.*)$", found[2])
        values = re.findall(r"'([^']*)", given[0])[::2] if given else []
        form = parts[1][1].strip().removeprefix(found[1])
        return f"{found[1]} {_no(values, form.split())}"
    if found := re.match(r"Missing value for argument '(.*?)'", first):
        return f"{found[1]} needs a value."
    return first


def _no(values: Sequence[str], forms: Sequence[str]) -> str:
    """That values are not of the forms that tyro names."""
    kind = KINDS.get(forms[0], forms[0]) if len(set(forms)) == 1 else " ".join(forms)
    if len(forms) == 1 and values:
        return f"{' '.join(values)} is not a {kind}{SUCH_AS.get(forms[0], '')}."
    wanted = f"{len(forms)} {kind}s" if len(forms) > 1 else f"a {kind}"
    return f"{' '.join(values)} is not {wanted}." if values else f"needs {wanted}."


def _entries(lines: Sequence[str]) -> list[str]:
    """What a list names: the lines that stand farther out than what explains them."""
    inset = [len(line) - len(line.lstrip()) for line in lines[1:] if line.strip()]
    return [
        line.strip()
        for line in lines[1:]
        if line.strip() and len(line) - len(line.lstrip()) == min(inset)
    ]
