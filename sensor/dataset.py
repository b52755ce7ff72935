# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The dataset folder: frames of one sensor pressed by balls, real or rendered, all the same.

``dataset.toml`` says what it is, ``labels.csv`` where each ball touched; the frames lie beside
them as images or as ``frames[n,h,w,3]`` in an ``.npz``, named ``frames.npz#17``.
"""

import csv
import io
import math
import os
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any

from sensor.errors import WedgeError
from sensor.files import read_text, sha256_of_files, write_atomic
from sensor.toml import (
    LEAST,
    MOST,
    Pair,
    finite,
    located,
    positive,
    positive_pair,
    read_toml,
    refuse_missing_keys,
    refuse_unknown_keys,
    text_line,
    toml_changed,
    toml_text,
)

CARD_FILE, LABELS_FILE, LENS_FILE = "dataset.toml", "labels.csv", "camera.toml"
"""In its folder: the card, the circles and, where there is one, a camera calibration."""
REQUIRED_KEYS = ("name", "source", "licence", "mm_per_px", "ball_radius_mm", "background")
OPTIONAL_KEYS = ("corners_px", "pad_size_mm", "lights_deg")
REQUIRED_COLUMNS = ("file", "center_x_px", "center_y_px", "contact_radius_px")
OPTIONAL_COLUMNS = ("ball_radius_mm", "quality")
IMAGES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
"""Endings of the images that frames come in, in small letters."""
LARGEST_SIDE_PX = 8192
MOST_LABEL_BYTES = 16 << 20
"""Of a table of labels: a hundred thousand rows."""
SHOWN = 5
"""Presses that a sentence names."""


@dataclass(frozen=True, kw_only=True)
class BallLabel:
    """Where one ball touched, in pixels of the unwarped frame (pixel centres are integers)."""

    file: str
    center_x_px: float
    center_y_px: float
    contact_radius_px: float
    """In pixels of sqrt(x * y) of the card's ``mm_per_px``, where pixels are not square."""
    ball_radius_mm: float | None = None
    """Of this press, where it differs from the data set's ball."""
    quality: float | None = None
    """0 (useless) to 1 (certain)."""

    @property
    def center_px(self) -> Pair:
        """Of the circle, x and y."""
        return self.center_x_px, self.center_y_px


@dataclass(frozen=True, kw_only=True)
class DatasetCard:
    """What ``dataset.toml`` says."""

    name: str
    source: str
    licence: str
    mm_per_px: Pair
    ball_radius_mm: float
    background: tuple[str, ...]
    corners_px: tuple[Pair, Pair, Pair, Pair] | None = None
    """Top left, top right, bottom right, bottom left of the pad in the raw frame; ``None``
    where the frames already show the gel plane."""
    pad_size_mm: Pair | None = None
    lights_deg: Mapping[str, float] | None = None
    """Azimuth that each colour's light comes from, in the gel frame."""

    @property
    def unwarped_size_px(self) -> tuple[int, int] | None:
        """(width, height) of the unwarped frame; ``None`` where frames are used as they are."""
        if self.corners_px is None or self.pad_size_mm is None:
            return None
        width, height = (
            round(size / scale)
            for size, scale in zip(self.pad_size_mm, self.mm_per_px, strict=True)
        )
        return width, height


@dataclass(frozen=True, kw_only=True)
class Dataset:
    """A dataset folder as read: its card, its labels, and where it lies."""

    folder: Path
    card: DatasetCard
    labels: tuple[BallLabel, ...]

    def label(self, file: str) -> BallLabel | None:
        """The label of a frame, ``None`` where it has none."""
        name = frame_name(file)
        return next((label for label in self.labels if frame_name(label.file) == name), None)

    def ball_radius_mm(self, label: BallLabel | None) -> float:
        """Radius of the ball that made this press: its own, else, or without a label, the card's.

        Whoever needs a press's ball asks here, as a set may hold presses of several.
        """
        own_mm = None if label is None else label.ball_radius_mm
        return self.card.ball_radius_mm if own_mm is None else own_mm

    def is_within_ball(self, label: BallLabel) -> bool:
        """Whether a press's circle is smaller than its ball."""
        return self._contact_radius_mm(label) < self.ball_radius_mm(label)

    def refuse_wide_circles(self) -> None:
        """Refuse circles that are not smaller than their balls.

        Raises:
            WedgeError: names them, and how they are found anew.
        """
        wide = [label for label in self.labels if not self.is_within_ball(label)]
        if not wide:
            return
        first, *others = wide
        named = ", ".join(
            [
                f"{first.file} ({self._contact_radius_mm(first):.2f} mm in radius, its ball "
                f"{self.ball_radius_mm(first):g} mm)",
                *(label.file for label in others[: SHOWN - 1]),
            ]
        )
        more = f" and {len(wide) - SHOWN} more" if len(wide) > SHOWN else ""
        again = shlex.join(["wedge", "label", str(self.folder), "--again"])
        number = "ball_radius_mm"
        if 2 * len(wide) > len(self.labels):  # as by a mistaken scale
            pitches = ", ".join(f"{pitch:g}" for pitch in self.card.mm_per_px)
            number = f"ball_radius_mm or mm_per_px (now [{pitches}])"
        raise WedgeError(
            f"{self.folder / LABELS_FILE} has circles that are not smaller than their ball, of "
            f"{named}{more}: correct {number}, or remove those drawn by hand from the table "
            f"and find them again with `{again}`."
        )

    def _contact_radius_mm(self, label: BallLabel) -> float:
        return label.contact_radius_px * math.sqrt(math.prod(self.card.mm_per_px))

    @property
    def ball_radii_mm(self) -> tuple[float, ...]:
        """Radii of the balls that made its presses, the smallest first."""
        return tuple(sorted({self.ball_radius_mm(label) for label in self.labels or (None,)}))

    @property
    def sha256(self) -> str:
        """Hash of the card, the labels, every frame that they name, and the lens."""
        frames = (*self.card.background, *(label.file for label in self.labels))
        names = {CARD_FILE, LABELS_FILE, *(name.partition("#")[0] for name in frames)}
        names |= {LENS_FILE} if (self.folder / LENS_FILE).is_file() else set()
        try:
            return sha256_of_files({name: self.folder / name for name in names})
        except OSError as error:
            raise WedgeError(f"{error.filename} cannot be read: {error.strerror}.") from error


def read_dataset(folder: Path, *, labelled: bool = True, within_balls: bool = True) -> Dataset:
    """Read ``dataset.toml`` and ``labels.csv``; frames are read when they are needed.

    Args:
        folder: of the dataset.
        labelled: whether ``labels.csv`` must be there; else a folder without it has no labels.
        within_balls: whether every circle must be smaller than its ball.

    Raises:
        WedgeError: names the file, the key or the line, and what is wrong with it.
    """
    path = folder / CARD_FILE
    if not path.is_file():
        raise WedgeError(f"{folder} is not a dataset folder: it has no dataset.toml.")
    try:
        card = _card(read_toml(path))
    except WedgeError as error:
        raise located(path, error) from error
    table = folder / LABELS_FILE
    labels = _read_labels(table) if labelled or table.exists() else ()
    dataset = Dataset(folder=folder, card=card, labels=labels)
    seen: set[str] = set()
    blank = {frame_name(name) for name in card.background}
    for label in dataset.labels:
        file = frame_name(label.file)
        if file in seen:  # it would teach in one row and judge in the other
            raise WedgeError(
                f"{folder / LABELS_FILE} labels {label.file} twice: keep one circle per frame."
            )
        if file in blank:
            raise WedgeError(
                f"{folder / LABELS_FILE} labels {label.file}, which dataset.toml says is the "
                "blank gel: remove it from one of them."
            )
        seen.add(file)
    if within_balls:
        dataset.refuse_wide_circles()
    return dataset


def write_labels(path: Path, labels: Sequence[BallLabel]) -> None:
    """Write ``labels.csv`` atomically; optional columns appear where any label has them."""
    optional = [key for key in OPTIONAL_COLUMNS if any(getattr(x, key) is not None for x in labels)]
    columns = [*REQUIRED_COLUMNS, *optional]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    for label in labels:
        values = [getattr(label, column) for column in columns]
        writer.writerow(["" if value is None else value for value in values])
    write_atomic(path, text.getvalue().encode())


def write_card(path: Path, card: DatasetCard) -> None:
    """Write ``dataset.toml`` atomically; over one that is there, only what changes."""
    keys = (*REQUIRED_KEYS, *OPTIONAL_KEYS)
    document = {key: value for key in keys if (value := getattr(card, key)) is not None}
    try:
        text = toml_changed(path.read_bytes().decode("utf-8-sig"), document)
    except (OSError, ValueError, RecursionError):  # none is there, or none that says anything
        text = toml_text(document)
    write_atomic(path, text.encode())


def frame_name(name: str) -> str:
    """By which a frame is known however it is written: ``./frames.npz#07`` is ``frames.npz#7``."""
    file, hash_mark, number = name.partition("#")
    return f"{PurePath(file)}{hash_mark}{number.lstrip('0') or number[:1]}"


def _card(document: dict[str, Any]) -> DatasetCard:
    refuse_unknown_keys(document, [*REQUIRED_KEYS, *OPTIONAL_KEYS], "")
    refuse_missing_keys(document, REQUIRED_KEYS)
    background = document["background"]
    if not (isinstance(background, list) and background) or not all(
        isinstance(name, str) for name in background
    ):
        raise WedgeError('background must be a list of file names, such as ["background.png"].')
    for name in background:
        _refuse_outside_path(name)
    if ("corners_px" in document) != ("pad_size_mm" in document):
        raise WedgeError("corners_px and pad_size_mm must be given together.")
    pad_size = document.get("pad_size_mm")
    card = DatasetCard(
        name=text_line(document["name"], "name"),
        source=text_line(document["source"], "source"),
        licence=text_line(document["licence"], "licence"),
        mm_per_px=positive_pair(document["mm_per_px"], "mm_per_px"),
        ball_radius_mm=positive(document["ball_radius_mm"], "ball_radius_mm"),
        background=tuple(background),
        corners_px=corners(document["corners_px"]) if "corners_px" in document else None,
        pad_size_mm=None if pad_size is None else positive_pair(pad_size, "pad_size_mm"),
        lights_deg=lights(document["lights_deg"]) if "lights_deg" in document else None,
    )
    if card.pad_size_mm is not None:
        sides = [size / pitch for size, pitch in zip(card.pad_size_mm, card.mm_per_px, strict=True)]
        if not 1 <= min(sides) <= max(sides) <= LARGEST_SIDE_PX:
            raise WedgeError(
                f"pad_size_mm / mm_per_px gives unwarped frames of {sides[0]:g} x {sides[1]:g} "
                f"pixels; each side must be 1 to {LARGEST_SIDE_PX}."
            )
    return card


def _read_labels(path: Path) -> tuple[BallLabel, ...]:
    try:
        if path.parent.is_dir() and not os.path.lexists(path):
            raise WedgeError(f"{path} is missing: label the presses first.")
        rows = list(csv.reader(io.StringIO(read_text(path, MOST_LABEL_BYTES))))
    except (UnicodeDecodeError, csv.Error) as error:
        raise WedgeError(f"{path} cannot be read as a table: {error}.") from error
    header = [cell.strip() for cell in rows[0]] if rows else []
    if len(header) == 1 and ";" in header[0]:
        raise WedgeError(f"{path} has semicolons between its columns: separate them by commas.")
    if "" in header[1:]:
        raise WedgeError(
            f"{path} has a column without a name: is there a comma too many in the header?"
        )
    for column in REQUIRED_COLUMNS:
        if column not in header:
            raise WedgeError(f"{path} has no column {column}.")
    for column in header:
        if header.count(column) > 1:
            raise WedgeError(f"{path} has the column {column} more than once.")
    refuse_unknown_keys(dict.fromkeys(header), [*REQUIRED_COLUMNS, *OPTIONAL_COLUMNS], f"{path}: ")
    labels = []
    for line, row in enumerate(rows[1:], start=2):
        if not any(cell.strip() for cell in row):
            continue
        try:
            if len(row) != len(header):
                raise WedgeError(f"{len(row)} values for {len(header)} columns.")
            labels.append(_label(dict(zip(header, (cell.strip() for cell in row), strict=True))))
        except WedgeError as error:
            raise WedgeError(f"{path}, line {line}: {error}") from error
    return tuple(labels)


def _label(cells: dict[str, str]) -> BallLabel:
    if not cells["file"]:
        raise WedgeError("file is empty.")
    _refuse_outside_path(cells["file"])
    numbers: dict[str, float] = {}
    for key, text in cells.items():
        if key == "file" or (key in OPTIONAL_COLUMNS and not text):
            continue
        try:
            numbers[key] = float(text)
        except ValueError as error:
            raise WedgeError(f"{key} = {text!r} ({cells['file']}) is not a number.") from error
        if key in ("contact_radius_px", "ball_radius_mm"):
            within, wanted = LEAST <= numbers[key] <= MOST, f"from {LEAST:g} to {MOST:g}"
            wanted = wanted if numbers[key] > 0 else "a positive number"
        elif key == "quality":
            within, wanted = 0 <= numbers[key] <= 1, "from 0 to 1"
        else:
            within, wanted = math.isfinite(numbers[key]), "a finite number"
        if not within:
            raise WedgeError(f"{key} = {text} ({cells['file']}) must be {wanted}.")
    return BallLabel(file=cells["file"], **numbers)


def corners(value: object) -> tuple[Pair, Pair, Pair, Pair]:
    """A value that must be the four corners of a pad."""
    wanted = "corners_px must be four [x, y]: top left, top right, bottom right, bottom left."
    if not isinstance(value, list) or len(value) != 4:
        raise WedgeError(wanted)
    if not all(isinstance(point, list) and len(point) == 2 for point in value):
        raise WedgeError(wanted)
    points = [(finite(x, "corners_px"), finite(y, "corners_px")) for x, y in value]
    turns = [_turn(points[i], points[(i + 1) % 4], points[(i + 2) % 4]) for i in range(4)]
    if not (min(turns) > 0 or max(turns) < 0):  # either way round: a mirror flips the picture
        raise WedgeError("corners_px are not the corners of a convex pad, taken in turn.")
    return points[0], points[1], points[2], points[3]


def _turn(a: Pair, b: Pair, c: Pair) -> float:
    """Twice the signed area of a triangle."""
    return (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])


def lights(value: object) -> dict[str, float]:
    """A value that must be a table of the lights' azimuths."""
    if not isinstance(value, dict) or not value or not set(value) <= {"R", "G", "B"}:
        raise WedgeError("lights_deg must be a table such as {R = 90.0, B = -90.0, G = 180.0}.")
    return {key: finite(angle, "lights_deg") for key, angle in value.items()}


def _refuse_outside_path(name: str) -> None:
    parts = Path(name.partition("#")[0]).parts
    if not parts or Path(name).is_absolute() or ".." in parts or "\0" in name:
        raise WedgeError(f"{name!r} must be a file inside the dataset folder.")
