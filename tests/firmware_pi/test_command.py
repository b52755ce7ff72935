# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`gelsight-wedge`: the paper's command line and passwords."""

import shlex
from pathlib import Path

import pytest

from firmware_pi.__main__ import main, read_credentials
from firmware_pi.mjpg_streamer import mjpg_streamer_command
from firmware_pi.settings import Settings, write_settings
from sensor.errors import WedgeError


def options(plugin: str) -> dict[str, str]:
    """Words that begin with a dash, each with the word after it where that is a value."""
    words = plugin.split()[1:]
    pairs = zip(words, [*words[1:], ""], strict=True)
    return {
        name: "" if value.startswith("-") and not value[1:].isdigit() else value
        for name, value in pairs
        if name.startswith("-") and not name[1:].isdigit()
    }


@pytest.mark.parametrize("ev", [-10, 0, 10])
def test_the_papers_server_is_told_both_gains_and_the_time(ev: int) -> None:
    settings = Settings(rate_hz=60.0, red_gain=1.25, blue_gain=0.8, ev=ev, address="10.55.0.1")
    program, _, camera, _, output = mjpg_streamer_command(settings)
    assert program == "mjpg_streamer"
    assert options(camera) == {
        "-x": "640",
        "-y": "480",
        "-fps": "60",
        "-quality": "85",
        "-timestamp": "",
        "-awb": "off",
        "-awbgainR": "1.250",
        "-awbgainB": "0.800",
        "-ev": str(ev),
    }
    assert options(output) == {"-l": "10.55.0.1", "-p": "8080", "-n": ""}


def test_the_printed_command_is_what_a_shell_reads(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_settings(tmp_path / "0.toml", Settings())
    (tmp_path / "login").write_text("wedge:s$(x)'\n")
    words = ["mjpg-streamer", str(tmp_path / "0.toml"), "--credentials", str(tmp_path / "login")]
    assert main(words) == 0
    printed = shlex.split(capsys.readouterr().out)
    assert printed == mjpg_streamer_command(Settings(), "wedge:s$(x)'")


@pytest.mark.parametrize(
    ("address", "warned"),
    [("127.0.0.1", True), ("127.0.0.2", True), ("::1", True), ("192.168.1.42", False)],
)
def test_an_address_that_the_pi_alone_reaches_is_warned_of(
    address: str, warned: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_settings(tmp_path / "0.toml", Settings(address=address))
    assert main(["mjpg-streamer", str(tmp_path / "0.toml")]) == 0
    printed, said = capsys.readouterr()
    assert f"-l {address} " in printed and printed.count("\n") == 1
    assert (address in said and "only the Pi itself" in said) == warned == bool(said)


@pytest.mark.parametrize("text", ["wedge", "a b:c", "a:b c", "a:b\nc:d", ":x", "a:"])
def test_a_password_file_that_holds_none_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "login").write_text(text)
    with pytest.raises(WedgeError, match="user:password"):
        read_credentials(tmp_path / "login")


def test_the_password_is_systemds_credential_unless_it_is_empty(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert read_credentials(None) is None
    monkeypatch.setenv("CREDENTIALS_DIRECTORY", str(tmp_path))
    assert read_credentials(None) is None
    (tmp_path / "login").write_text("")
    assert read_credentials(None) is None
    (tmp_path / "login").write_text("wedge:secret\n")
    assert read_credentials(None) == "wedge:secret"
    with pytest.raises(WedgeError, match="cannot be read"):
        read_credentials(tmp_path / "none")
