# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Entry point of `wedge`, `./wedge` and `python -m app`: finds the subcommand and runs it.

Each subcommand is a module `app.<name>` with a function `main` whose typed parameters and docstring
make its command line. Only the module that was asked for is imported, so help answers at once.
"""

import difflib
import importlib
import io
import os
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress

from sensor.errors import WedgeError

SUBCOMMANDS = {
    "reproduce": "make both sensors' build files, calibrate on ball presses, show the errors",
    "test": "run every check of the project: style, types, imports, docs, tests",
    "fabricate": "write and check every file to build a sensor: print, laser, boards, bill, guide",
    "simulate": "render a design's frames, path-traced, as a dataset with ground truth",
    "sweep": "vary one field of a design; predict gradient error and lit area",
    "data": "list the known datasets; import raw frames and other tools' calibrations",
    "capture": "take ball presses from a sensor, only good ones, with a map of the pad",
    "lens": "measure a wide camera's lens from pictures of a chessboard",
    "label": "find the circles of ball presses, then correct the doubtful ones in the browser",
    "calibrate": "make a unit folder for one sensor from its ball presses",
    "evaluate": "measure units' errors on other datasets, and what has changed since",
    "accept": "grade one sensor A, B or fail against limits; write its certificate",
    "table": "print the error table per light configuration, cross-validated by press",
    "reconstruct": "turn images into depth in millimetres with a calibrated unit",
    "cloud": "turn frames into point clouds and meshes in millimetres",
    "markers": "follow the dots of a marker gel and write how each moved",
    "stream": "watch a sensor's stream: rates, latency, losses, depth",
    "live": "show sensors in the browser: raw, difference, depth, contact",
    "record": "record streams to an MCAP file that ROS 2's tools open",
    "replay": "send a recording over HTTP as if its sensor were here",
    "tune": "find the camera's gains and exposure from frames of the blank gel",
    "track": "follow the pose of the touched object, with overlay, plot and MCAP transforms",
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
        "`wedge SUBCOMMAND --help` explains one of them, `wedge --version` prints the version.",
        "Start with `wedge reproduce`: it needs no sensor and no other files.",
    ]
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 well, 1 failed checks, 2 bad input, 130 interrupted.

    Ended by SIGTERM or SIGHUP it leaves as little behind as by Ctrl-C, and exits 143 or 129; a
    recording, a replay or a stream that is followed ends well, and exits 0, once it has begun.

    Args:
        arguments: The words after `wedge`; the process's own by default.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    if isinstance(sys.stdout, io.TextIOWrapper):  # not where a caller has put something else
        with suppress(OSError):  # a pipe in the place of a file that could be sought
            sys.stdout.reconfigure(errors="backslashreplace")  # as stderr: no result is lost to a θ
    try:
        with _ended_like_interrupted():
            status = _dispatch(words)
        print(end="", flush=True)  # a full disk shows now, where it can still be said
    except WedgeError as error:
        status = _complain(str(error))
    except KeyboardInterrupt:
        status = 130
    except BrokenPipeError:  # the reader, `head` say, has had enough
        status = 0
        _abandon_stdout()
    except OSError as error:
        status = _complain(_os_sentence(error))
        _abandon_stdout()
    sys.exit(status)


@contextmanager
def _ended_like_interrupted() -> Iterator[None]:
    """Let what asks this process to end unwind it: workers end, half-written folders go."""

    def end(number: int, _: object) -> None:
        sys.exit(128 + number)

    asked = [number for number in (signal.SIGTERM, getattr(signal, "SIGHUP", None)) if number]
    # nohup's, say, are left as they are.
    ours = [number for number in asked if signal.getsignal(number) is signal.SIG_DFL]
    for number in ours:
        signal.signal(number, end)
    try:
        yield
    finally:
        for number in ours:
            signal.signal(number, signal.SIG_DFL)


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
        case ["test", first, *_] if first not in ("-h", "--help"):
            from app.test import run_pytest

            return run_pytest(words[1:])
        case [name, *rest] if name in SUBCOMMANDS:
            return _run(name, rest)
        case [name, *_]:
            near = difflib.get_close_matches(name, SUBCOMMANDS, n=1)
            guess = f"did you mean `wedge {near[0]}`?" if near else "`wedge --help` lists them."
            raise WedgeError(f"there is no subcommand {name!r}: {guess}")
    raise AssertionError(words)


def _run(name: str, words: list[str]) -> int:
    """Read the words as the parameters of the subcommand's `main` and call it."""
    from app._words import understood
    from app._workers import on_one_thread

    on_one_thread()
    command = importlib.import_module(f"app.{name}").main
    result = understood(command, f"wedge {name}", words)()
    return result if isinstance(result, int) else 0


def _complain(sentence: str) -> int:
    """Print what is wrong to stderr; return the exit status for bad input."""
    print(f"wedge: {sentence}", file=sys.stderr)
    return 2


def _os_sentence(error: OSError) -> str:
    """Say what the operating system refused, and for which file."""
    reason = error.strerror or str(error)
    return f"{error.filename}: {reason}." if error.filename else f"{reason}."


def _abandon_stdout() -> None:
    """Drop what stdout cannot take, or Python would complain again as it closes."""
    try:
        print(end="", flush=True)
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


if __name__ == "__main__":
    main()
