# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The camera's settings: one TOML file on the Pi, of which every key is known and in range.

Only the standard library and ``sensor`` are needed: the Pi has nothing else of this repository.
"""

import ipaddress
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from sensor.errors import WedgeError, shown
from sensor.files import clear_leftovers, write_atomic
from sensor.toml import finite, located, read_toml, refuse_unknown_keys, toml_text
from sensor.wire import DEFAULT_PORT, SIZES_PX

NOISE_REDUCTIONS = {
    "off": "Off",
    "minimal": "Minimal",
    "fast": "Fast",
    "high quality": "HighQuality",
}
SYNCS = {"off": "Off", "server": "Server", "client": "Client"}
US_PER_S = 1_000_000
BROADCAST = ipaddress.ip_address("255.255.255.255")
OF_THE_PI = ("camera", "camera_id", "sync", "address", "port", "max_clients")
"""Which camera it is and where its stream is served, whatever the gel asks for."""


def _key(default: Any, says: str, least: float | None = None, most: float | None = None) -> Any:
    return field(default=default, metadata={"says": says, "least": least, "most": most})


@dataclass(frozen=True)
class Settings:
    """The camera's settings and where the stream is served; nothing is automatic.

    Raises:
        WedgeError: a value is of another kind or out of range; names the key.
    """

    camera: int = _key(0, "which of the Pi's cameras, counted from 0", 0, 3)
    camera_id: str = _key("", "selects a camera whatever its number: its id in /settings")
    width_px: int = _key(640, "640 or 320; the sensor reads 640 x 480 in both cases")
    height_px: int = _key(480, "480 or 240")
    rate_hz: float = _key(58.0, "frames per second; docs/howto/pi.md says what a Pi can do", 1, 90)
    exposure_us: int = _key(10_000, "fixed; at most the time between two frames", 30, 66_666)
    analogue_gain: float = _key(1.0, "fixed; raise it when the exposure is at its maximum", 1, 16)
    red_gain: float = _key(1.5, "fixed white balance, red relative to green", 0.1, 8)
    blue_gain: float = _key(1.5, "fixed white balance, blue relative to green", 0.1, 8)
    noise_reduction: str = _key("off", "off, minimal, fast or high quality")
    jpeg_quality: int = _key(85, "used on a Pi 5, which encodes in software", 30, 100)
    megabits_per_s: float = _key(12.0, "used on other Pis, which encode in hardware", 1, 50)
    sync: str = _key(
        "off", "two sensors in step: server on one, client on the other; otherwise off"
    )
    ev: int = _key(0, "sixths of a stop; used by the paper's mjpg_streamer only", -10, 10)
    address: str = _key("127.0.0.1", "the one address of the Pi at which the stream is served")
    port: int = _key(DEFAULT_PORT, "its TCP port", 1, 65_535)
    max_clients: int = _key(4, "most streams served at once", 1, 16)

    def __post_init__(self) -> None:
        for known in fields(self):
            _check(known.name, getattr(self, known.name), type(known.default), known.metadata)
        if (self.width_px, self.height_px) not in SIZES_PX:
            raise WedgeError(
                f"width_px and height_px = {self.width_px} x {self.height_px} must be 640 x 480 "
                "or 320 x 240."
            )
        if self.exposure_us > US_PER_S / self.rate_hz:
            raise WedgeError(
                f"exposure_us = {self.exposure_us} is longer than a frame at rate_hz = "
                f"{self.rate_hz:g}: at most {US_PER_S / self.rate_hz:.0f}."
            )
        _check_name("noise_reduction", self.noise_reduction, NOISE_REDUCTIONS)
        _check_name("sync", self.sync, SYNCS)
        _check_address(self.address)

    @property
    def camera_called(self) -> str:
        """The camera in sentences: by its id where that is set, else by its number."""
        return self.camera_id or str(self.camera)

    @property
    def frame_duration_us(self) -> int:
        """Time between two frames."""
        return round(US_PER_S / self.rate_hz)


def read_settings(path: Path) -> Settings:
    """The settings in a file; a key that it does not name has its default.

    Raises:
        WedgeError: names the file and the first key that is unknown or wrong.
    """
    document = read_toml(path)
    try:
        return settings_of(document)
    except WedgeError as error:
        raise located(path, error) from error


def settings_of(document: dict[str, Any]) -> Settings:
    """The settings in a TOML or JSON document.

    Raises:
        WedgeError: names the first key that is unknown or wrong.
    """
    known = {key.name: type(key.default) for key in fields(Settings)}
    refuse_unknown_keys(document, list(known), "")
    values = dict(document)
    for key, value in document.items():
        if known[key] is float and type(value) is int:  # a file may well say rate_hz = 50
            values[key] = finite(value, key)
    return Settings(**values)


def applied(new: Settings, old: Settings) -> Settings:
    """New settings for a camera that has old ones: what is ``OF_THE_PI`` stays."""
    return replace(new, **{key: getattr(old, key) for key in OF_THE_PI})


def settings_text(settings: Settings) -> str:
    """The settings as TOML, with what each key is beside it."""
    lines = toml_text(asdict(settings)).splitlines()
    width = max(map(len, lines))
    says = [key.metadata["says"] for key in fields(settings)]
    return "".join(f"{line:{width}}  # {text}\n" for line, text in zip(lines, says, strict=True))


def write_settings(path: Path, settings: Settings) -> None:
    """Write the settings file, whole or not at all, for the service's user to read.

    Raises:
        WedgeError: the file cannot be written.
    """
    clear_leftovers(path)
    write_atomic(path, settings_text(settings).encode())
    path.chmod(0o644)


def _check(key: str, value: object, kind: type, limits: Any) -> None:
    if kind is str:
        if not isinstance(value, str):
            raise WedgeError(f"{key} must be text, not {shown(value)}.")
        return
    if kind is int and type(value) is not int:
        raise WedgeError(f"{key} must be a whole number, not {shown(value)}.")
    number = finite(value, key)
    least, most = limits["least"], limits["most"]
    if least is not None and not least <= number <= most:
        raise WedgeError(f"{key} = {number:g} must lie between {least:g} and {most:g}.")


def _check_name(key: str, value: str, names: Iterable[str]) -> None:
    if value not in names:
        raise WedgeError(f"{key} = {shown(value)} must be one of {', '.join(names)}.")


def _check_address(text: str) -> None:
    try:
        address = ipaddress.ip_address(text)
    except ValueError:
        raise WedgeError(f"address = {text!r} must be an IP address of the Pi.") from None
    if address.is_unspecified or address.is_multicast or address == BROADCAST:
        raise WedgeError(
            f"address = {text!r} is not the address of one machine: set one of the Pi's."
        )
    if address.version == 6 and (address.is_link_local or "%" in text):
        raise WedgeError(
            f"address = {text!r} is known on one link only, so that no client can ask for it: set "
            "another of the Pi's, such as its IPv4 address."
        )
