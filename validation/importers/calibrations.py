# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Calibration folders that others' tools make, turned into dataset folders.

Known by what they hold: gs_sdk's ``catalog.csv`` (a folder a press, diameter in mm), Taxim's
``dataPack.npz`` (frames and circles in one archive, BGR), and frames with their circles in text
files (``circle_texts``). None of them says everything, so pitch, and where it is not in there the
ball, are asked for. Circles that were drawn go round the visible disc: they are refitted to the
contact.
"""

import csv
import io
from dataclasses import dataclass, replace
from math import isclose
from pathlib import Path

import numpy as np

from recon.geometry.unwarp import is_within
from recon.images import read_image, write_image
from recon.presses import LeftOut
from sensor.dataset import BallLabel, DatasetCard
from sensor.errors import WedgeError
from validation.importers.circle_texts import read_circle_texts, read_text
from validation.importers.drawn import drawn_label, read_numbers, refuse_count
from validation.importers.folder import plain_name, write_dataset
from validation.importers.taxim_pack import (
    BACKGROUND,
    TaximPack,
    read_taxim_pack,
    write_taxim_frames,
)

CATALOG = "catalog.csv"
TEXTS = "frames with circle texts"
MOST_TOLD = 5
"""Of the lines and the pictures that did not fit each other."""
WIDEST = 0.95
"""Of the ball's radius: a refit begins at no wider circle."""


@dataclass(frozen=True, kw_only=True)
class Found:
    """What lay in someone's calibration folder: pictures and the circles drawn on them."""

    kind: str
    backgrounds: tuple[Path, ...]
    labels: tuple[BallLabel, ...]
    """Their files as they will be called."""
    drawn_in: tuple[str, ...]
    """Of each label: the file, and the line in a text, that its circle was read from."""
    frames: tuple[Path, ...]
    """Of each label, where the frames are pictures."""
    pack: TaximPack | None = None
    """Where the frames came in one archive."""
    unmatched: tuple[str, ...] = ()
    """Lines of texts that draw no circle on a press's picture there."""
    without: tuple[str, ...] = ()
    """Names of pictures on which texts draw no circle."""

    @property
    def left_aside(self) -> str | None:
        """A sentence on lines and pictures that did not fit each other; ``None`` where all did."""
        parts = [
            f"{len(of)} {what}{'s' * (len(of) > 1)} without a circle{where}: "
            f"{', '.join(of[:MOST_TOLD])}{' ...' * (len(of) > MOST_TOLD)}"
            for of, what, where in (
                (self.unmatched, "line", " for a picture of a press in the folder"),
                (self.without, "picture", ""),
            )
            if of
        ]
        return f"Ignored: {'; '.join(parts)}." if parts else None


def find_calibration(source: Path) -> Found | None:
    """What a source holds; ``None`` where it is neither of these formats.

    Raises:
        WedgeError: it is one of them, but a part is missing, damaged or hostile.
    """
    if source.suffix.lower() == ".npz" and source.is_file():
        return _taxim(source)
    if (source / CATALOG).is_file():
        return _gs_sdk(source)
    if (source / "dataPack.npz").is_file():
        return _taxim(source / "dataPack.npz")
    return _circle_texts(source) if source.is_dir() else None


def import_calibration(
    found: Found,
    source: Path,
    folder: Path,
    *,
    mm_per_px: float,
    ball_radius_mm: float | None,
) -> tuple[LeftOut, ...]:
    """Write a dataset folder from what was found, every circle refitted to its ball's shading.

    Args:
        found: what the source holds.
        source: where it was found, for the card.
        folder: to write to.
        mm_per_px: pitch of the frames, which must show the gel plane.
        ball_radius_mm: of the ball, where the source does not say; each press keeps its own.

    Returns:
        Presses whose circle is centred outside the frame or could not be refitted, and why.

    Raises:
        WedgeError: no picture has a circle, the ball's radius is nowhere or contradicts the source,
            most circles are not smaller than their balls, none is centred in its frame, or a frame
            is damaged or does not fit.
    """
    if not found.labels:
        raise WedgeError(f"{source} has no picture with a circle. {found.left_aside}")
    radius_mm = _card_radius_mm(found, source, ball_radius_mm)
    narrowed = _narrowed(found, source, mm_per_px, radius_mm)
    if found.pack is not None:
        write_taxim_frames(found.pack, folder)
        names: tuple[str, ...] = (BACKGROUND,)
    else:
        names = tuple(f"background-{i}.png" for i in range(len(found.backgrounds)))
        for path, name in zip(found.backgrounds, names, strict=True):
            write_image(folder / name, read_image(path))
        for path, label in zip(found.frames, found.labels, strict=True):
            write_image(folder / label.file, read_image(path))
    place = source.resolve()  # of . and .. too
    card = DatasetCard(
        name=plain_name(place.stem, "calibration"),
        source=f"{found.kind}: {place.name}",
        licence="as the source's",
        mm_per_px=(mm_per_px, mm_per_px),
        ball_radius_mm=radius_mm,
        background=names,
    )
    height, width = read_image(folder / names[0]).shape[:2]
    beside = _beside_frame(found, (width, height))
    if len(beside) == len(narrowed):
        raise WedgeError(
            f"{source} has no circle in its frame: of {beside[0].file}, {beside[0].reason}."
        )
    outside = {press.file for press in beside}
    labels = [
        replace(label, ball_radius_mm=None) if label.ball_radius_mm == radius_mm else label
        for label in narrowed
        if label.file not in outside
    ]
    return (*beside, *write_dataset(folder, card, labels, mend_circles=True))


def _beside_frame(found: Found, size_px: tuple[int, int]) -> list[LeftOut]:
    """The presses whose circle is centred outside a frame of that size (width, height)."""
    width, height = size_px
    return [
        LeftOut(
            file=label.file,
            reason=f"its circle ({drawn_in}) is centred outside the {width}x{height} frame, at "
            f"({label.center_x_px:g}, {label.center_y_px:g})",
        )
        for label, drawn_in in zip(found.labels, found.drawn_in, strict=True)
        if not is_within(label.center_px, size_px)
    ]


def _card_radius_mm(found: Found, source: Path, given_mm: float | None) -> float:
    """Radius of the ball that the card states: as given, or the largest that the source states.

    Raises:
        WedgeError: nobody says, or what is given is another one than what the source states.
    """
    stated_mm = sorted({x.ball_radius_mm for x in found.labels if x.ball_radius_mm is not None})
    for radius_mm in stated_mm:
        if given_mm is not None and not isclose(radius_mm, given_mm):
            raise WedgeError(
                f"{source} states a ball of radius {radius_mm:g} mm, which "
                f"--ball-radius-mm {given_mm:g} contradicts: leave the option out."
            )
    largest_mm = max(stated_mm, default=given_mm)
    if largest_mm is None:
        raise WedgeError(f"{source} does not say how large the ball is: add --ball-radius-mm.")
    return largest_mm


def _narrowed(
    found: Found, source: Path, mm_per_px: float, card_radius_mm: float
) -> tuple[BallLabel, ...]:
    """The labels, with circles that are drawn too wide made narrower than their balls.

    Circles drawn round the visible disc may be, in deep presses, and the refit begins at them. At a
    wrong pitch most are too wide.

    Raises:
        WedgeError: most are not smaller than their balls.
    """
    widest_px = np.array(
        [(label.ball_radius_mm or card_radius_mm) / mm_per_px for label in found.labels]
    )
    drawn_px = np.array([label.contact_radius_px for label in found.labels])
    shares = drawn_px / widest_px
    if np.median(shares) >= 1:
        first = int(np.argmax(shares >= 1))
        label = found.labels[first]
        name = label.file
        if found.pack is None and found.frames[first].is_relative_to(source):
            name = str(found.frames[first].relative_to(source))
        both = "are --mm-per-px and --ball-radius-mm"
        raise WedgeError(
            f"{source}: the circle of {name} has a radius of {drawn_px[first] * mm_per_px:.2f} mm "
            f"at {mm_per_px:g} mm/px, which is not smaller than its ball's "
            f"{widest_px[first] * mm_per_px:g} mm: "
            f"{both if label.ball_radius_mm is None else 'is --mm-per-px'} right?"
        )
    return tuple(
        replace(label, contact_radius_px=min(label.contact_radius_px, WIDEST * float(widest)))
        for label, widest in zip(found.labels, widest_px, strict=True)
    )


def _gs_sdk(source: Path) -> Found:
    """gs_sdk: ``catalog.csv`` names a folder a press with ``gelsight.png`` and ``label.npz``."""
    try:
        rows = list(csv.reader(io.StringIO(read_text(source / CATALOG))))
    except csv.Error as error:
        raise WedgeError(f"{source / CATALOG} cannot be read as a table: {error}.") from error
    header = [cell.strip() for cell in rows[0]] if rows else []
    for column in ("experiment_reldir", "diameter(mm)"):
        if column not in header:
            raise WedgeError(f"{source / CATALOG} has no column {column}.")
    labels: list[BallLabel] = []
    frames: list[Path] = []
    drawn_in: list[str] = []
    for line, row in enumerate(rows[1:], start=2):
        if not any(row):
            continue
        cells = dict(zip(header, (cell.strip() for cell in row), strict=False))
        folder = cells.get("experiment_reldir", "").replace("\\", "/")  # written on Windows
        press = _inside(source, folder, f"{CATALOG}, line {line}")
        if not (press / "label.npz").is_file():
            continue  # their tool labels one after the other; the rest are not labelled yet
        diameter_mm = _number(cells.get("diameter(mm)", ""), f"{source / CATALOG}, line {line}")
        arrays = read_numbers(press / "label.npz", ("center", "radius"))
        center, radius = arrays["center"].ravel(), arrays["radius"].ravel()
        if center.size != 2 or radius.size != 1:
            raise WedgeError(
                f"{press / 'label.npz'} must hold a center of two numbers and one radius."
            )
        name = f"press-{len(labels):04d}.png"
        circle = np.concatenate([center, radius]).astype(float).tolist()
        labels.append(drawn_label(name, circle, press / "label.npz", diameter_mm / 2))
        frames.append(press / "gelsight.png")
        drawn_in.append(f"{folder}/label.npz")
    refuse_count(source, len(labels))
    return Found(
        kind="gs_sdk catalogue",
        backgrounds=(source / "background.png",),
        labels=tuple(labels),
        drawn_in=tuple(drawn_in),
        frames=tuple(frames),
    )


def _taxim(path: Path) -> Found:
    pack = read_taxim_pack(path)
    return Found(
        kind="Taxim data pack",
        backgrounds=(),
        labels=pack.labels,
        drawn_in=(path.name,) * len(pack.labels),
        frames=(),
        pack=pack,
    )


def _circle_texts(source: Path) -> Found | None:
    """Frames with ``NAME.txt`` beside them or in a folder of texts, or one text for all."""
    texts = read_circle_texts(source)
    if not (texts.circles or texts.unmatched):
        return None
    if texts.circles and not texts.backgrounds:
        raise WedgeError(
            f"{source} has circles, but no picture of the blank gel: name it background.png."
        )
    if texts.circles:
        refuse_count(source, len(texts.circles))
    return Found(
        kind=TEXTS,
        backgrounds=texts.backgrounds,
        labels=tuple(
            drawn_label(f"{path.stem}.png", circle, path) for path, circle in texts.circles.items()
        ),
        drawn_in=tuple(texts.lines[path] for path in texts.circles),
        frames=tuple(texts.circles),
        unmatched=texts.unmatched,
        without=texts.without,
    )


def _inside(source: Path, name: str, where: str) -> Path:
    """A folder that a catalogue names, which must lie within the source."""
    try:
        path = (source / name).resolve()
        inside = name != "" and path.is_relative_to(source.resolve())
    except (OSError, RuntimeError, ValueError):  # links in a circle, or a NUL
        inside = False
    if not inside:
        raise WedgeError(f"{source / where}: {name!r} is not a folder inside {source.name}.")
    return path


def _number(text: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError as error:
        raise WedgeError(f"{where}: {text!r} is not a number.") from error
    if not 0 < value < 1e3:
        raise WedgeError(f"{where}: {text} mm is not the size of a ball.")
    return value
