# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`gelsight-wedge` on the Pi, `python -m firmware_pi` elsewhere."""

import argparse
import os
import re
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

from firmware_pi.cable import lay_cable, remove_cable
from firmware_pi.mjpg_streamer import mjpg_streamer_command, only_the_pi_reaches
from firmware_pi.settings import OF_THE_PI, Settings, applied, read_settings, write_settings
from sensor.errors import WedgeError


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a subcommand; return the exit status: 0 well, 2 bad input."""
    parser = argparse.ArgumentParser(prog="gelsight-wedge", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    serve = commands.add_parser("serve", help="stream the camera until stopped")
    check = commands.add_parser("check", help="check a settings file")
    apply = commands.add_parser(
        "apply",
        help="replace a settings file, but keep its camera, address and port",
        description=f"Replace a settings file by another. The old file's {', '.join(OF_THE_PI)} "
        "stay: to change them, edit it.",
    )
    default = commands.add_parser(
        "default",
        help="write a settings file, or check the existing one",
        description="Write a settings file, or check the existing one, and print its address and "
        "port.",
    )
    paper = commands.add_parser("mjpg-streamer", help="print the command of the paper's server")
    cable = commands.add_parser(
        "cable", help="let the USB socket act as a network card, or undo that"
    )
    for command in (serve, check, apply, default, paper):
        command.add_argument("settings", type=Path, help="settings file (TOML)")
    apply.add_argument("place", type=Path, help="the file that the service reads")
    default.add_argument("--address", default=Settings.address, help="address to listen at")
    default.add_argument("--camera", type=int, default=0, help="which camera, from 0")
    default.add_argument("--port", type=int, default=Settings.port, help="its TCP port")
    cable.add_argument("action", choices=("lay", "remove"))
    cable.add_argument("config", type=Path, help="the Pi's config.txt")
    for command in (serve, paper):
        command.add_argument("--credentials", type=Path, help="file that holds user:password")
    given = parser.parse_args(arguments)
    try:
        return _run(given)
    except WedgeError as error:
        print(f"gelsight-wedge: {error}", file=sys.stderr)
        return 2


def _run(given: argparse.Namespace) -> int:
    match given.command:
        case "default":
            settings = Settings(camera=given.camera, address=given.address, port=given.port)
            if given.settings.exists():
                settings = read_settings(given.settings)
            else:
                write_settings(given.settings, settings)
            print(settings.address, settings.port)
        case "serve":
            from firmware_pi.service import Service

            Service(given.settings, read_credentials(given.credentials)).run()
        case "check":
            read_settings(given.settings)
        case "apply":
            _apply(given.settings, given.place)
        case "cable":
            (lay_cable if given.action == "lay" else remove_cable)(given.config)
        case "mjpg-streamer":
            settings = read_settings(given.settings)
            if only_the_pi_reaches(settings):
                print(
                    f"gelsight-wedge: only the Pi itself can reach address = {settings.address!r}: "
                    f"set it in {given.settings} to the Pi's address in your network.",
                    file=sys.stderr,
                )
            words = mjpg_streamer_command(settings, read_credentials(given.credentials))
            print(shlex.join(words))
    return 0


def _apply(file: Path, place: Path) -> None:
    new = read_settings(file)
    if not place.exists():
        write_settings(place, new)
        return
    settings = applied(new, read_settings(place))
    write_settings(place, settings)
    kept = [key for key in OF_THE_PI if getattr(new, key) != getattr(settings, key)]
    if kept:
        said = ", ".join(f"{key} = {getattr(settings, key)!r}" for key in kept)
        print(f"{place} keeps {said}, whatever {file} says: to change that, edit {place}.")


def read_credentials(file: Path | None) -> str | None:
    """The line user:password that clients must bring: of a file, or of systemd's credential.

    Raises:
        WedgeError: the file cannot be read or holds something else.
    """
    if file is None:
        folder = os.environ.get("CREDENTIALS_DIRECTORY")
        file = Path(folder) / "login" if folder else None
        if file is None or not file.exists():
            return None
    try:
        line = file.read_text(encoding="utf-8").strip()
    except (OSError, UnicodeError) as error:
        raise WedgeError(f"{file} cannot be read: {error}.") from error
    if not line:
        return None
    if not re.fullmatch(r"[^\s:]+:\S+", line):
        raise WedgeError(f"{file} must hold one line user:password without spaces.")
    return line


if __name__ == "__main__":
    sys.exit(main())
