# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Pictures and the text files that say where circles were drawn on them.

There is one text a picture (``x y r``) or one for all (``name x y r``). In the latter a name's case
does not matter, and it may have its folders before it. Numbers are set apart by spaces, commas or
semicolons, in brackets or not; between semicolons a comma is a decimal point. What follows ``#``,
``%`` or ``//`` is a remark.
"""

import re
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from recon.labels.label_book import refuse_name
from sensor.dataset import IMAGES
from sensor.errors import WedgeError
from validation.importers.drawn import MOST_PRESSES, is_circle
from validation.importers.raw_frames import is_background

LARGEST_TEXT = 10**7
"""Bytes."""
LONGEST_LINE, LONGEST_TOLD = 1000, 60
"""Characters of a line that are looked at, and that are told of."""
NAMED = re.compile(
    r"""(.+?\.(?:png|jpe?g|bmp|tiff?|webp|gif|heic))["'\s,;:(\[]+([-+.\d].*)""",
    re.IGNORECASE,
)
"""A picture's name, of one that cannot be read here too, and what begins as a number after it."""
NUMBERS = re.compile(r"(?=\D*\d)[-+.,;()\[\]\s\deE]+")
"""What may be a circle, and is told of where it is not."""
REMARK = re.compile(r"(?:^|\s)(?:#|%|//).*")
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")

Circle = tuple[float, float, float]
"""Centre x, centre y and radius in pixels."""


@dataclass(frozen=True, kw_only=True)
class CircleTexts:
    """What the texts of a folder say of the pictures that lie there."""

    circles: Mapping[Path, Circle]
    """By picture."""
    lines: Mapping[Path, str]
    """Of each picture's circle: the text and the line in it."""
    backgrounds: tuple[Path, ...]
    unmatched: tuple[str, ...]
    """Lines that draw no circle, or one on no press's picture that lies there."""
    without: tuple[str, ...]
    """Names of pictures on which no circle is drawn."""


def read_circle_texts(source: Path) -> CircleTexts:
    """Read the texts of a folder and of the folders in it.

    Raises:
        WedgeError: there are too many texts, one cannot be read, one picture has two circles, or
            two pictures are called alike but for their endings.
    """
    files = _files(source)
    pictures = [path for path in files if path.suffix.lower() in IMAGES]
    beside = [path for path in pictures if path.parent == source]
    texts = [path for path in files if path.suffix.lower() == ".txt"]
    if len(texts) > MOST_PRESSES + 1:  # one a picture, and one for all
        raise WedgeError(
            f"{source} holds {len(texts)} texts, more than the {MOST_PRESSES} presses that can be "
            "imported: keep those with circles."
        )
    stems = _Pictures((path.stem, path) for path in beside)
    names = _Pictures((path.relative_to(source).as_posix(), path) for path in pictures)
    circles: dict[Path, Circle] = {}
    lines: dict[Path, str] = {}
    unmatched: list[str] = []
    for text in texts:
        for number, line in enumerate(read_text(text).splitlines(), start=1):
            words = line[:LONGEST_LINE].strip("\"' \t")
            if REMARK.match(words):
                continue
            if named := NAMED.match(words):
                picture, circle = names.ending(named[1]), _circle(named[2], more=True)
            elif NUMBERS.fullmatch(REMARK.sub("", words)):
                picture, circle = stems.called(text.stem), _circle(words)
            else:
                continue
            told = f"{text.relative_to(source)}, line {number}"
            if picture is None or circle is None or is_background(picture.name):
                unmatched.append(f"{told} ({words[:LONGEST_TOLD]})")
            elif circles.setdefault(picture, circle) != circle:
                raise WedgeError(
                    f"{source / told}: {picture.name} has another circle already: keep one."
                )
            else:
                lines.setdefault(picture, told)
    if circles:
        _refuse_alike(sorted({*beside, *circles}))
    folders = {source, *(path.parent for path in circles)}
    seen = [path for path in pictures if path.parent in folders]
    return CircleTexts(
        circles=circles,
        lines=lines,
        backgrounds=tuple(path for path in seen if is_background(path.name)),
        unmatched=tuple(unmatched),
        without=tuple(x.name for x in seen if x not in circles and not is_background(x.name)),
    )


def read_text(path: Path) -> str:
    """A text's content, without its byte order mark.

    Raises:
        WedgeError: it is no UTF-8, or too large for a list of circles.
    """
    try:
        if path.stat().st_size > LARGEST_TEXT:
            raise WedgeError(f"{path} is larger than 10 MB: it is not a list of circles.")
        return path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise WedgeError(f"{path} cannot be read as text: {error}.") from error


class _Pictures:
    """Pictures by their names, whose case matters only where nothing else tells two apart."""

    def __init__(self, named: Iterable[tuple[str, Path]]) -> None:
        self._exact: dict[str, Path] = {}
        self._folded: dict[str, list[Path]] = {}
        for name, path in named:
            self._exact[_composed(name)] = path
            self._folded.setdefault(_composed(name).casefold(), []).append(path)

    def called(self, name: str) -> Path | None:
        """The picture of this name; ``None`` where there is none, or no telling which."""
        alike = self._folded.get(_composed(name).casefold(), [])
        return self._exact.get(_composed(name), alike[0] if len(alike) == 1 else None)

    def ending(self, name: str) -> Path | None:
        """The picture of a name with folders before it, of which all but the last are unknown."""
        parts = re.split(r"[\\/]+", name)
        return self.called("/".join(parts[-2:])) or self.called(parts[-1])


def _composed(name: str) -> str:
    """One spelling of each accented letter: some systems write it as two characters."""
    return unicodedata.normalize("NFC", name)


def _files(source: Path) -> list[Path]:
    """Files of a folder, then those of the folders in it, without hidden ones."""

    def entries(folder: Path) -> list[Path]:
        return sorted(path for path in folder.iterdir() if not path.name.startswith("."))

    try:
        first = entries(source)
        second = [path for folder in first if folder.is_dir() for path in entries(folder)]
        return [path for path in [*first, *second] if path.is_file()]
    except OSError as error:
        raise WedgeError(f"{error.filename} cannot be read: {error.strerror}.") from error


def _circle(text: str, *, more: bool = False) -> Circle | None:
    """A circle's three numbers, perhaps with ``more`` behind them; ``None`` where they are none."""
    text = re.sub(r"[()\[\]{}\"']", " ", REMARK.sub("", text)).strip(" \t,;")
    words = [word.strip().replace(",", ".") for word in text.split(";")]
    if len(words) < 3:
        words = re.split(r"[\s,;]+", text)
        if len(words) > 3 and re.search(r"\d,\d", text) and re.search(r"\d\s+[-+.\d]", text):
            return None  # no telling whether a comma separates or is a decimal point
    if len(words) < 3 or (len(words) > 3 and not more) or not all(map(NUMBER.fullmatch, words[:3])):
        return None
    x_px, y_px, radius_px = map(float, words[:3])
    return (x_px, y_px, radius_px) if is_circle(x_px, y_px, radius_px) else None


def _refuse_alike(pictures: Sequence[Path]) -> None:
    """Refuse names that the dataset cannot keep, or cannot keep apart."""
    by_stem = {path.stem: path for path in pictures}
    for path in pictures:
        refuse_name(path)
        if (other := by_stem[path.stem]) != path:
            raise WedgeError(
                f"{path} and {other.name} have the same name except for the ending: move "
                "or rename one."
            )
