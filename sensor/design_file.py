# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Designs by name or from a TOML file that changes some numbers of a known one."""

from collections.abc import Mapping
from dataclasses import asdict, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

from sensor.design import FINGER, STANDARD, Wedge
from sensor.errors import WedgeError, shown
from sensor.toml import finite, read_toml, refuse_unknown_keys, toml_text

DESIGNS: Mapping[str, Wedge] = {design.name: design for design in (STANDARD, FINGER)}


def load_design(name_or_file: str) -> Wedge:
    """Find a known design by name, or read one from a TOML file.

    The file names a base and changes some of its numbers:

        base = "standard"
        name = "thin-acrylic"

        [acrylic]
        thickness_mm = 3.0

    Raises:
        WedgeError: unknown name, unreadable file, no base in it, unknown key, or a value or name
            that cannot work.
    """
    if not isinstance(name_or_file, str | Path):
        raise WedgeError(
            f"a design is a name ({', '.join(DESIGNS)}) or a .toml file, not {name_or_file!r}."
        )
    if name_or_file in DESIGNS:
        return DESIGNS[name_or_file]
    path = Path(name_or_file)
    if path.suffix != ".toml":
        raise WedgeError(
            f"{name_or_file!r} is neither a design ({', '.join(DESIGNS)}) nor a .toml file."
        )
    document = read_toml(path)
    if "base" not in document:
        raise WedgeError(f'{path} has no base: begin it with base = "standard" or "finger".')
    base = document.pop("base")
    if base not in list(DESIGNS):
        raise WedgeError(f"{path}: base = {base!r} must be one of {', '.join(DESIGNS)}.")
    try:
        design: Wedge = _override(DESIGNS[base], {"name": path.stem, **document}, "")
        _refuse_name(design.name)
    except WedgeError as error:
        raise WedgeError(f"{path}: {error}") from error
    return design


def design_text(design: Wedge) -> str:
    """A design as a file with all its numbers, which ``load_design`` reads."""
    return "# All numbers of a design.\n" + toml_text({"base": STANDARD.name, **asdict(design)})


def known_design(sha256: str | None) -> Wedge | None:
    """The design of this hash, if it is known by name."""
    return next((design for design in DESIGNS.values() if design.sha256 == sha256), None)


def _refuse_name(name: str) -> None:
    """Refuse what cannot be a folder's name in one line of text; 60 characters fit any disk."""
    good = name.strip() == name and name.isprintable() and not {"/", "\\"} & {*name}
    if not good or name.startswith(".") or not 1 <= len(name) <= 60:
        raise WedgeError(
            f"name = {name!r} must be 1 to 60 printable characters without / and \\, with no space"
            " at its ends and no dot at its start."
        )


def _override(base: Any, changes: Mapping[str, Any], prefix: str) -> Any:
    known = [item.name for item in fields(base)]
    keys = [prefix + key for key in known] if prefix else ["base", *known]
    refuse_unknown_keys({prefix + key: 0 for key in changes}, keys, "")
    values: dict[str, Any] = {}
    for key, value in changes.items():
        current = getattr(base, key)
        if is_dataclass(current) != isinstance(value, dict):
            wanted = "a table" if is_dataclass(current) else "a value"
            raise WedgeError(f"{prefix}{key} must be {wanted}.")
        if is_dataclass(current):
            values[key] = _override(current, value, f"{prefix}{key}.")
        elif isinstance(current, bool | str) and type(value) is not type(current):
            wanted = "true or false" if isinstance(current, bool) else "text"
            raise WedgeError(f"{prefix}{key} must be {wanted}, not {shown(value)}.")
        else:
            as_float = isinstance(current, float) and type(value) is int
            values[key] = finite(value, prefix + key) if as_float else value
    return replace(base, **values)
