# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The lines of the Pi's config.txt that let its USB socket act as a network card.

The Pi starts by this file, and it is its owner's: all but the lines between our two stays as it is.
"""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

from sensor.errors import WedgeError
from sensor.files import clear_leftovers, write_atomic

BEGIN, ALL, END = b"# gelsight-wedge begin", b"[all]", b"# gelsight-wedge end"
LINES = (BEGIN, ALL, b"dtoverlay=dwc2,dr_mode=peripheral", END)


def lay_cable(file: Path) -> None:
    """Give a config.txt our lines, unless it has them; correct what an older installer wrote.

    Raises:
        WedgeError: the file cannot be read or written.
    """
    _change(file, with_cable)


def remove_cable(file: Path) -> None:
    """Take our lines out of a config.txt.

    Raises:
        WedgeError: the file cannot be read or written.
    """
    _change(file, without_cable)


def with_cable(config: bytes) -> bytes:
    """A config.txt with our lines: at its end, or where they are already."""
    lines = _lines(config)
    blocks = _blocks(lines)
    if not blocks:
        end = b"" if config.endswith(b"\n") or not config else b"\n"
        return config + end + b"".join(line + b"\n" for line in LINES)
    # The older installer did not find its own lines, and so wrote them again right behind.
    again = {at for one, two in pairwise(blocks) if two.start == one.stop for at in two}
    return b"".join(line for at, line in enumerate(lines) if at not in again)


def without_cable(config: bytes) -> bytes:
    """A config.txt without our lines; what was written behind them still holds for all Pis."""
    lines = _lines(config)
    ours = {at for block in _blocks(lines) for at in block}
    kept: list[bytes] = []
    section, behind = ALL, False
    for at, line in enumerate(lines):
        words = line.strip()
        if at in ours:
            behind = True
            continue
        if words.startswith(b"["):
            section, behind = words.lower(), False
        elif behind and words and not words.startswith(b"#"):
            if section != ALL:
                kept.append(ALL + b"\n")
            section, behind = ALL, False
        kept.append(line)
    return b"".join(kept)


def _lines(config: bytes) -> list[bytes]:
    """Its lines with their ends.

    Where the last line had none, an older installer wrote its first line behind it, so that the
    setting there became another: the two are parted.
    """
    read = config.splitlines(keepends=True)
    lines: list[bytes] = []
    for at, line in enumerate(read):
        words = line.rstrip(b"\r\n")
        rest = tuple(other.rstrip(b"\r\n") for other in read[at + 1 : at + len(LINES)])
        if words != BEGIN and words.endswith(BEGIN) and rest == LINES[1:]:
            end = line[len(words) :]
            lines += [words.removesuffix(BEGIN) + end, BEGIN + end]
        else:
            lines.append(line)
    return lines


def _blocks(lines: list[bytes]) -> list[range]:
    """Where our lines are, each time from the first to the last; one without the other is none."""
    blocks: list[range] = []
    begin = None
    for at, line in enumerate(lines):
        words = line.rstrip(b"\r\n")
        if words == BEGIN:
            begin = at
        elif words == END and begin is not None:
            blocks.append(range(begin, at + 1))
            begin = None
    return blocks


def _change(file: Path, change: Callable[[bytes], bytes]) -> None:
    try:
        config = file.read_bytes()
    except OSError as error:
        raise WedgeError(f"{file} cannot be read: {error.strerror}.") from error
    clear_leftovers(file.resolve())
    if (changed := change(config)) != config:
        write_atomic(file.resolve(), changed)
