# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The unit folder: one built sensor, measured. Written by calibration, never edited by hand.

``unit.toml`` is described here; ``background.png`` and ``gradients.safetensors`` beside it hold
arrays, which ``recon`` reads and writes, and ``design.toml`` a design that has no name here.
"""

import tomllib
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any, Literal, NoReturn, cast, get_args

from sensor.dataset import LARGEST_SIDE_PX, corners, lights
from sensor.errors import WedgeError, shown
from sensor.files import write_atomic
from sensor.toml import (
    Pair,
    finite,
    located,
    positive_pair,
    read_toml,
    refuse_missing_keys,
    refuse_unknown_keys,
    text_line,
    toml_text,
)

MissingAxis = Literal["none", "zero", "network"]
"""What stands in for the gradient that the lights cannot see."""

UNIT_FILE, BACKGROUND_FILE = "unit.toml", "background.png"
GRADIENTS_FILE, DESIGN_FILE = "gradients.safetensors", "design.toml"

REQUIRED_KEYS = (
    "serial",
    "created",
    "dataset",
    "dataset_sha256",
    "estimator",
    "channels",
    "missing_axis",
    "mm_per_px",
    "frame_size_px",
    "size_px",
    "metrics",
)
OPTIONAL_KEYS = (
    "design_sha256",
    "corners_px",
    "pad_size_mm",
    "lights_deg",
    "markers",
    "learnt_frames",
    "learnt_truths",
)
MARKER_KEYS = ("count", "spacing_mm", "diameter_mm")


@dataclass(frozen=True, kw_only=True)
class UnitCard:
    """What ``unit.toml`` says."""

    serial: str
    created: str
    """Day of the calibration, YYYY-MM-DD."""
    dataset: str
    dataset_sha256: str
    estimator: str
    channels: str
    """The colours that carry information, such as "RGB" or "RB"."""
    missing_axis: MissingAxis
    mm_per_px: Pair
    frame_size_px: tuple[int, int]
    """(width, height) of the camera's frames."""
    size_px: tuple[int, int]
    """(width, height) of the unwarped frames."""
    metrics: Mapping[str, int | float]
    """Errors on the presses held out at calibration."""
    design_sha256: str | None = None
    """Of the design that it was built from; ``None`` where nobody named one."""
    corners_px: tuple[Pair, Pair, Pair, Pair] | None = None
    pad_size_mm: Pair | None = None
    lights_deg: Mapping[str, float] | None = None
    markers: Mapping[str, int | float] | None = None
    """Dots of the blank gel: ``count``, ``spacing_mm``, ``diameter_mm``; ``None``: it has none."""
    learnt_frames: tuple[str, ...] | None = None
    """Fingerprints of the frames that it learnt from; ``None``: a unit of before they were kept."""
    learnt_truths: tuple[str, ...] | None = None
    """Of the circle, ball and scale with which it learnt from each."""


def refuse_no_unit(folder: Path) -> NoReturn:
    """Say what is where a unit folder should be.

    Raises:
        WedgeError: always.
    """
    if not folder.exists():
        raise WedgeError(
            f"{folder} does not exist: name a unit folder; `wedge calibrate` makes one."
        )
    if not folder.is_dir():
        raise WedgeError(f"{folder} is a file: name the unit folder that `wedge calibrate` made.")
    raise WedgeError(f"{folder} is not a unit folder: it has no unit.toml; run wedge calibrate.")


def read_unit_card(folder: Path) -> UnitCard:
    """Read ``unit.toml`` of a unit folder.

    Raises:
        WedgeError: names the file, the key, and what is wrong with it.
    """
    path = folder / UNIT_FILE
    if not path.is_file():
        refuse_no_unit(folder)
    try:
        return _card(read_toml(path))
    except WedgeError as error:
        raise located(path, error) from error


def write_unit_card(folder: Path, card: UnitCard) -> None:
    """Write ``unit.toml`` atomically.

    Raises:
        WedgeError: the card says what could not be read back, or the file cannot be written.
    """
    keys = (*REQUIRED_KEYS, *OPTIONAL_KEYS)
    document = {key: value for key in keys if (value := getattr(card, key)) is not None}
    text = "# Written by `wedge calibrate`: measured, never edited by hand.\n" + toml_text(document)
    _card(tomllib.loads(text))  # whose errors come before anything is written
    write_atomic(folder / UNIT_FILE, text.encode())


def _card(document: dict[str, Any]) -> UnitCard:
    refuse_unknown_keys(document, [*REQUIRED_KEYS, *OPTIONAL_KEYS], "")
    refuse_missing_keys(document, REQUIRED_KEYS)
    texts = ("serial", "dataset", "dataset_sha256", "estimator")
    channels = text_line(document["channels"], "channels")
    if channels not in ("R", "G", "B", "RG", "RB", "GB", "RGB"):
        raise WedgeError(f'channels = "{channels}" must be some of R, G and B in that order.')
    if document["missing_axis"] not in get_args(MissingAxis):
        raise WedgeError(f"missing_axis must be one of {', '.join(get_args(MissingAxis))}.")
    if ("corners_px" in document) != ("pad_size_mm" in document):
        raise WedgeError("corners_px and pad_size_mm must be given together.")
    pad_size, design = document.get("pad_size_mm"), document.get("design_sha256")
    card = UnitCard(
        **{key: text_line(document[key], key) for key in texts},
        created=_day(document["created"]),
        channels=channels,
        missing_axis=cast(MissingAxis, document["missing_axis"]),
        mm_per_px=positive_pair(document["mm_per_px"], "mm_per_px"),
        frame_size_px=_size(document["frame_size_px"], "frame_size_px"),
        size_px=_size(document["size_px"], "size_px"),
        metrics=_metrics(document["metrics"]),
        design_sha256=None if design is None else text_line(design, "design_sha256"),
        corners_px=corners(document["corners_px"]) if "corners_px" in document else None,
        pad_size_mm=None if pad_size is None else positive_pair(pad_size, "pad_size_mm"),
        lights_deg=lights(document["lights_deg"]) if "lights_deg" in document else None,
        markers=_markers(document["markers"]) if "markers" in document else None,
        learnt_frames=_fingerprints(document, "learnt_frames"),
        learnt_truths=_fingerprints(document, "learnt_truths"),
    )
    if card.learnt_truths and len(card.learnt_truths) != len(card.learnt_frames or ()):
        raise WedgeError("learnt_truths must have one fingerprint for each of learnt_frames.")
    if card.lights_deg is not None and (unsaid := set(channels) - set(card.lights_deg)):
        raise WedgeError(f"lights_deg must say where the light of {min(unsaid)} is, too.")
    if card.pad_size_mm is not None:
        for pad_mm, pitch_mm, size_px in zip(
            card.pad_size_mm, card.mm_per_px, card.size_px, strict=True
        ):
            if abs(pad_mm / pitch_mm - size_px) > 1:
                raise WedgeError(
                    f"pad_size_mm / mm_per_px gives {pad_mm / pitch_mm:.0f} pixels, but size_px "
                    f"says {size_px}: the file was edited by hand; calibrate again."
                )
    return card


def _day(value: object) -> str:
    text = text_line(value, "created")
    with suppress(ValueError):
        if date.fromisoformat(text).isoformat() == text:  # it takes other forms as well
            return text
    raise WedgeError(f'created = "{text}" must be a day, such as "2026-03-01".')


def _metrics(value: object) -> dict[str, float]:
    if not isinstance(value, dict):
        raise WedgeError("metrics must be a table of numbers.")
    numbers = {key: finite(number, f"metrics.{key}") for key, number in value.items()}
    for key, number in numbers.items():
        if number < 0 and "bias" not in key:
            raise WedgeError(f"metrics.{key} = {number:g} must not be negative.")
    return numbers


def _markers(value: object) -> dict[str, float]:
    if not isinstance(value, dict) or sorted(value) != sorted(MARKER_KEYS):
        raise WedgeError(f"markers must be a table of {', '.join(MARKER_KEYS)}.")
    numbers = {key: finite(value[key], f"markers.{key}") for key in MARKER_KEYS}
    if min(numbers.values()) <= 0:
        raise WedgeError("markers: every number must be above zero.")
    return numbers


def _fingerprints(document: Mapping[str, Any], key: str) -> tuple[str, ...] | None:
    if key not in document:
        return None
    if not isinstance(document[key], list):
        raise WedgeError(f"{key} must be a list of fingerprints.")
    return tuple(text_line(item, key) for item in document[key])


def _size(value: object, key: str) -> tuple[int, int]:
    whole = isinstance(value, list) and len(value) == 2 and all(type(n) is int for n in value)
    if not whole or not all(1 <= side <= LARGEST_SIDE_PX for side in cast(list[int], value)):
        raise WedgeError(
            f"{key} must be [width, height] in whole pixels, 1 to {LARGEST_SIDE_PX}, not"
            f" {shown(value)}."
        )
    width, height = cast(list[int], value)
    return width, height
