# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""config.txt gets our lines and loses them again; all else in it stays, and means the same."""

import signal
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from firmware_pi.__main__ import main
from firmware_pi.cable import LINES, with_cable, without_cable

BLOCK = b"".join(line + b"\n" for line in LINES)
LINE = st.sampled_from(
    [
        b"",
        b"dtparam=audio=on",
        b"arm_boost=1",
        b"  gpu_mem=64",
        b"dtoverlay=dwc2,dr_mode=host",
        b"[cm5]",
        b"[pi4]",
        b"[ALL]",
        b"# a remark",
        b"# see # gelsight-wedge begin",
        b"caf\xe9=1",
    ]
)
LINES_OF_TEXT = st.lists(st.tuples(LINE, st.sampled_from([b"\n", b"\r\n"])), max_size=8)
CONFIG = st.builds(
    lambda lines, last: b"".join(line + end for line, end in lines) + last, LINES_OF_TEXT, LINE
)
WHOLE = st.builds(lambda lines: b"".join(line + end for line, end in lines), LINES_OF_TEXT)


def meaning(config: bytes) -> list[tuple[bytes, bytes]]:
    """The settings, each with the section in which it stands."""
    section, settings = b"[all]", []
    for line in map(bytes.strip, config.splitlines()):
        if line.startswith(b"["):
            section = line.lower()
        elif line and not line.startswith(b"#"):
            settings.append((section, line))
    return settings


def written_by_older_installer(config: bytes) -> bytes:
    """What it wrote: it looked for a line of its own, and took no heed of the last line's end."""
    return config if LINES[0] in config.split(b"\n") else config + BLOCK


def ended(config: bytes) -> bytes:
    return config if config.endswith(b"\n") or not config else config + b"\n"


@given(CONFIG)
def test_our_lines_come_once_and_go_again(config: bytes) -> None:
    laid = with_cable(config)
    assert laid == ended(config) + BLOCK
    assert with_cable(laid) == laid
    assert without_cable(laid) == ended(config)
    assert without_cable(config) == config


@given(CONFIG, st.integers(1, 2))
@example(b"arm_boost=1", 1)
@example(b"arm_boost=1", 2)
@example(b"# a remark", 2)
def test_what_an_older_installer_wrote_is_mended(config: bytes, runs: int) -> None:
    wrong = config
    for _ in range(runs):
        wrong = written_by_older_installer(wrong)
    assert with_cable(wrong) == ended(config) + BLOCK
    assert without_cable(wrong) == ended(config)


@given(CONFIG, WHOLE)
@example(b"[cm5]\ndtoverlay=dwc2,dr_mode=host\n", b"# a remark\ndtparam=audio=on\n")
def test_what_is_written_behind_our_lines_means_the_same_without_them(
    config: bytes, behind: bytes
) -> None:
    laid = with_cable(config) + behind
    assert with_cable(laid) == laid
    ours = (b"[all]", LINES[2])
    assert meaning(without_cable(laid)) == [x for x in meaning(laid) if x != ours]
    assert without_cable(without_cable(laid)) == without_cable(laid)


@pytest.mark.parametrize(
    "config",
    [
        b"# gelsight-wedge begin\n[all]\ndtparam=audio=on\n",  # its last line is gone
        b"dtparam=audio=on\n# gelsight-wedge end\narm_boost=1\n",
        b"# not # gelsight-wedge begin\n[all]\narm_boost=1\n# gelsight-wedge end\n",
    ],
)
def test_what_is_not_whole_is_not_taken_for_ours(config: bytes) -> None:
    assert without_cable(config) == config
    assert with_cable(config) == config + BLOCK


def test_lines_that_a_computer_ended_otherwise_are_known_again() -> None:
    config = (b"arm_boost=1\n" + BLOCK).replace(b"\n", b"\r\n")
    assert with_cable(config) == config
    assert without_cable(config) == b"arm_boost=1\r\n"


def test_a_file_that_needs_no_change_is_not_written_and_none_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "config.txt"
    assert main(["cable", "lay", str(file)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    file.write_bytes(b"arm_boost=1")
    assert main(["cable", "lay", str(file)]) == 0
    before = file.stat()
    assert main(["cable", "lay", str(file)]) == 0
    assert file.stat().st_ino == before.st_ino
    assert main(["cable", "remove", str(file)]) == 0
    assert file.read_bytes() == b"arm_boost=1\n"
    assert [path.name for path in tmp_path.iterdir()] == ["config.txt"]


@pytest.mark.parametrize("moment", ["os.fsync", "pathlib.Path.replace"])
def test_what_a_killed_write_leaves_is_gone_after_the_next_and_the_file_is_whole(
    tmp_path: Path, moment: str
) -> None:
    file, swap, other = (
        tmp_path / name for name in ("config.txt", ".config.txt.swp", ".cmdline.txt.0123456789ab")
    )
    file.write_bytes(b"arm_boost=1\n")
    swap.write_text("an editor's, with what nobody has saved yet")
    other.write_text("another file's")
    killed = f"""if True:
        import os, pathlib, signal, sys
        {moment} = lambda *_: os.kill(os.getpid(), signal.SIGKILL)
        from firmware_pi.__main__ import main
        main(["cable", "lay", sys.argv[1]])"""
    for _ in range(2):  # the second takes away what the first left
        words = [sys.executable, "-c", killed, str(file)]
        assert subprocess.run(words, check=False).returncode == -signal.SIGKILL
        assert file.read_bytes() == b"arm_boost=1\n"
        (left,) = set(tmp_path.iterdir()) - {file, swap, other}
    kept = left.read_bytes()
    assert main(["cable", "lay", str(file)]) == 0
    assert set(tmp_path.iterdir()) == {file, swap, other}
    left.write_bytes(kept)
    assert main(["cable", "lay", str(file)]) == 0  # a run that writes nothing clears up as well
    assert file.read_bytes() == b"arm_boost=1\n" + BLOCK
    assert set(tmp_path.iterdir()) == {file, swap, other}
