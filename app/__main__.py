# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Entry point of `wedge`, `./wedge` and `python -m app`: finds the subcommand and runs it.

Each subcommand is a module `app.<name>` with a function `main` whose typed parameters and docstring
make its command line. Only the module that was asked for is imported, so help answers at once.
"""

import difflib
import importlib
import os
import sys
from collections.abc import Sequence
from types import ModuleType

from sensor.errors import WedgeError

SUBCOMMANDS = {
    "reproduce": "calibrate on real ball presses, make the error tables and figures, build/index.html",
    "test": "run every check of the project: style, types, floors, docs, tests",
    "data": "list the datasets known by name, with folder and licence",
    "calibrate": "make a unit folder for one sensor from its ball presses",
    "evaluate": "measure one unit's errors on another dataset",
    "table": "print the error table per light configuration, cross-validated by press",
    "reconstruct": "turn images into depth in millimetres with a calibrated unit",
    "bench": "measure every figure of the performance page",
}

_WIDTH = max(map(len, SUBCOMMANDS)) + 2
HELP = "\n".join(
    [
        "usage: wedge SUBCOMMAND ...",
        "",
        "From a ball pressed on a GelSight Wedge to depth in millimetres.",
        "",
        *(f"  {name:{_WIDTH}}{summary}" for name, summary in SUBCOMMANDS.items()),
        "",
        "`wedge SUBCOMMAND --help` explains one of them, `wedge --version` names the version.",
        "Begin with `wedge reproduce`: it needs nothing but this command.",
    ]
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 well, 1 a check failed, 2 bad input or usage, 130 interrupted.

    Args:
        arguments: The words after `wedge`; the process's own by default.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    try:
        status = _dispatch(words)
        sys.stdout.flush()
    except WedgeError as error:
        status = _complain(str(error))
    except KeyboardInterrupt:
        status = 130
    except BrokenPipeError:
        # The reader, `head` say, has had enough. Python would complain again when it closes stdout.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        status = 0
    except OSError as error:
        if error.errno is None:
            raise
        status = _complain(_os_sentence(error))
    sys.exit(status)


def _dispatch(words: list[str]) -> int:
    """Run the subcommand that the words begin with; return its exit status."""
    match words:
        case [] | ["-h" | "--help", *_]:
            print(HELP)
            return 0
        case ["--version", *_]:
            from importlib.metadata import version

            print(f"wedge {version('gelsight-wedge')}")
            return 0
        case [name, *rest] if name in SUBCOMMANDS:
            return _run(name, importlib.import_module(f"app.{name}"), rest)
        case [name, *_]:
            near = difflib.get_close_matches(name, SUBCOMMANDS, n=1)
            guess = f"did you mean `wedge {near[0]}`?" if near else "`wedge --help` lists them."
            raise WedgeError(f"there is no subcommand {name!r}: {guess}")
    raise AssertionError(words)


def _run(name: str, module: ModuleType, words: list[str]) -> int:
    """Read the words as the parameters of the module's `main` and call it."""
    import tyro

    result = tyro.cli(
        module.main,
        prog=f"wedge {name}",
        args=words,
        config=(tyro.conf.AvoidSubcommands, tyro.conf.FlagConversionOff),
    )
    return result if isinstance(result, int) else 0


def _complain(sentence: str) -> int:
    """Print what is wrong to stderr; return the exit status for bad input."""
    print(f"wedge: {sentence}", file=sys.stderr)
    return 2


def _os_sentence(error: OSError) -> str:
    """Say what the operating system refused, and for which file."""
    reason = error.strerror or str(error)
    return f"{error.filename}: {reason}." if error.filename else f"{reason}."


if __name__ == "__main__":
    main()
