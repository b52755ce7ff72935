# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Calibration folders that others' tools make, turned into dataset folders.

Known by what they hold: gs_sdk's ``catalog.csv`` (a folder a press, diameter in mm), Taxim's
``dataPack.npz`` (frames and circles in one archive, BGR), and frames with their circles in text
files, one a frame (``x y r``) or one for all (``name x y r``). None of them says everything, so
pitch, and where it is not in there the ball, are asked for. Circles are taken as they are: they go
round the visible disc, and ``mend_circles`` refits them to the contact.
"""

import csv
import io
import re
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from recon.images import UNREADABLE_ARCHIVE, read_image, write_image
from sensor.dataset import BallLabel, DatasetCard
from sensor.errors import WedgeError
from validation.importers.folder import write_dataset
from validation.importers.raw_frames import IMAGES, is_background

CATALOG = "catalog.csv"
TEXTS = "frames with circle texts"
LARGEST_TEXT, LARGEST_ARCHIVE = 10**7, 4 * 10**9
"""Bytes; an archive's are those that it unpacks to."""
MOST_PRESSES = 10_000
NUMBER = r"([-+]?\d+(?:\.\d+)?)"
CIRCLE = re.compile(rf"^\W*{NUMBER}[\s,;()]+{NUMBER}[\s,;()]+{NUMBER}\W*$")
NAMED_CIRCLE = re.compile(rf"^(\S+\.(?:png|jpe?g))[\s,;:(]+{NUMBER}[\s,;]+{NUMBER}[\s,;)]+{NUMBER}")


@dataclass(frozen=True, kw_only=True)
class Found:
    """What lay in someone's calibration folder: pictures and the circles drawn on them."""

    kind: str
    backgrounds: tuple[Path, ...]
    labels: tuple[BallLabel, ...]
    """Their files as they will be called."""
    frames: tuple[Path, ...]
    """Of each label, where the frames are pictures."""
    arrays: tuple[np.ndarray, np.ndarray] | None = None
    """Background and frames, RGB, where they came in one archive."""


def find_calibration(source: Path) -> Found | None:
    """What a source holds; ``None`` where it is neither of these formats.

    Raises:
        WedgeError: it is one of them, but a part is missing, damaged or hostile.
    """
    if source.suffix == ".npz" and source.is_file():
        return _taxim_pack(source)
    if (source / CATALOG).is_file():
        return _gs_sdk(source)
    if (source / "dataPack.npz").is_file():
        return _taxim_pack(source / "dataPack.npz")
    return _circle_texts(source) if source.is_dir() else None


def import_calibration(
    found: Found,
    source: Path,
    folder: Path,
    *,
    mm_per_px: float,
    ball_radius_mm: float | None,
    mend_circles: bool = True,
) -> None:
    """Write a dataset folder from what was found.

    Args:
        found: what the source holds.
        source: where it was found, for the card.
        folder: to write to.
        mm_per_px: pitch of the frames, which must show the gel plane.
        ball_radius_mm: of the ball, where the source does not say.
        mend_circles: refit every circle to its ball's shading.

    Raises:
        WedgeError: the ball's radius is nowhere, or a frame is damaged or does not fit.
    """
    stated = {x.ball_radius_mm for x in found.labels} - {None}
    radius_mm = ball_radius_mm or max((r for r in stated if r is not None), default=None)
    if radius_mm is None:
        raise WedgeError(f"{source} does not say how large the ball is: add --ball-radius-mm.")
    if found.arrays is not None:
        background, frames = found.arrays
        write_image(folder / "background.png", background)
        np.savez(folder / "frames.npz", frames=frames)
        names: tuple[str, ...] = ("background.png",)
    else:
        names = tuple(f"background-{i}.png" for i in range(len(found.backgrounds)))
        for path, name in zip(found.backgrounds, names, strict=True):
            write_image(folder / name, read_image(path))
        for path, label in zip(found.frames, found.labels, strict=True):
            write_image(folder / label.file, read_image(path))
    card = DatasetCard(
        name=folder.name if not source.name else re.sub(r"\W+", "-", source.stem).strip("-"),
        source=f"{found.kind}: {source.name}",
        licence="as the source's",
        mm_per_px=(mm_per_px, mm_per_px),
        ball_radius_mm=radius_mm,
        background=names,
    )
    write_dataset(folder, card, found.labels, mend_circles=mend_circles)


def _gs_sdk(source: Path) -> Found:
    """gs_sdk: ``catalog.csv`` names a folder a press with ``gelsight.png`` and ``label.npz``."""
    rows = list(csv.reader(io.StringIO(_text(source / CATALOG))))
    header = [cell.strip() for cell in rows[0]] if rows else []
    for column in ("experiment_reldir", "diameter(mm)"):
        if column not in header:
            raise WedgeError(f"{source / CATALOG} has no column {column}.")
    labels: list[BallLabel] = []
    frames: list[Path] = []
    for line, row in enumerate(rows[1:], start=2):
        if not any(row):
            continue
        cells = dict(zip(header, (cell.strip() for cell in row), strict=False))
        folder = cells.get("experiment_reldir", "").replace("\\", "/")  # written on Windows
        press = _inside(source, folder, f"{CATALOG}, line {line}")
        if not (press / "label.npz").is_file():
            continue  # their tool labels one after the other; the rest are not labelled yet
        diameter_mm = _number(cells.get("diameter(mm)", ""), f"{source / CATALOG}, line {line}")
        arrays = _arrays(press / "label.npz", ("center", "radius"))
        center, radius = arrays["center"].ravel(), arrays["radius"].ravel()
        if center.size != 2 or radius.size != 1:
            raise WedgeError(f"{press / 'label.npz'} must hold a center of two and one radius.")
        name = f"press-{len(labels):04d}.png"
        labels.append(_label(name, (*center, *radius), press / "label.npz", diameter_mm / 2))
        frames.append(press / "gelsight.png")
    _refuse_none(source, labels)
    return Found(
        kind="gs_sdk catalogue",
        backgrounds=(source / "background.png",),
        labels=tuple(labels),
        frames=tuple(frames),
    )


def _taxim_pack(path: Path) -> Found:
    """Taxim: ``f0``, ``imgs``, ``touch_center`` and ``touch_radius`` in one archive, BGR."""
    pack = _arrays(path, ("f0", "imgs", "touch_center", "touch_radius"))
    frames, background = pack["imgs"], pack["f0"]
    if frames.ndim != 4 or frames.shape[3] != 3 or background.shape != frames.shape[1:]:
        raise WedgeError(
            f"{path}: imgs must be [n, height, width, 3] and f0 one such frame, not "
            f"{list(frames.shape)} and {list(background.shape)}."
        )
    centers, radii = pack["touch_center"], pack["touch_radius"].ravel()
    if centers.shape != (len(frames), 2) or len(radii) != len(frames):
        raise WedgeError(f"{path}: {len(frames)} frames, but not as many centres and radii.")
    labels = [
        _label(f"frames.npz#{i}", (*center, radius), path, None)
        for i, (center, radius) in enumerate(zip(centers, radii, strict=True))
    ]
    _refuse_none(path, labels)
    rgb = [np.ascontiguousarray(part[..., ::-1]).astype(np.uint8) for part in (background, frames)]
    return Found(
        kind="Taxim data pack",
        backgrounds=(),
        labels=tuple(labels),
        frames=(),
        arrays=(rgb[0], rgb[1]),
    )


def _circle_texts(source: Path) -> Found | None:
    """Frames with ``NAME.txt`` beside them or in a folder of texts, or one text for all."""
    frames = {p.stem: p for p in sorted(source.iterdir()) if p.suffix.lower() in IMAGES}
    by_name = {path.name: path for path in frames.values()}
    circles: dict[str, tuple[float, ...]] = {}
    for path in sorted([*source.glob("*.txt"), *source.glob("*/*.txt")])[: MOST_PRESSES + 1]:
        for line in _text(path).splitlines():
            if (match := CIRCLE.match(line)) and path.stem in frames:
                circles[frames[path.stem].name] = tuple(float(x) for x in match.groups())
            elif (match := NAMED_CIRCLE.match(line)) and match[1] in by_name:
                circles[match[1]] = tuple(float(x) for x in match.groups()[1:])
    backgrounds = tuple(path for path in by_name.values() if is_background(path.name))
    if not circles:
        return None
    if not backgrounds:
        raise WedgeError(
            f"{source} has circles, but no picture of the blank gel: name it background.png."
        )
    labels = [
        _label(f"{Path(name).stem}.png", circle, source / name, None)
        for name, circle in circles.items()
    ]
    return Found(
        kind=TEXTS,
        backgrounds=backgrounds,
        labels=tuple(labels),
        frames=tuple(by_name[name] for name in circles),
    )


def _label(
    file: str, circle: Sequence[float], where: Path, ball_radius_mm: float | None
) -> BallLabel:
    x_px, y_px, radius_px = (float(value) for value in circle)
    if not (np.isfinite([x_px, y_px, radius_px]).all() and 0 < radius_px < 1e4):
        raise WedgeError(f"{where}: ({x_px:g}, {y_px:g}), radius {radius_px:g} is no circle.")
    return BallLabel(
        file=file,
        center_x_px=x_px,
        center_y_px=y_px,
        contact_radius_px=radius_px,
        ball_radius_mm=ball_radius_mm,
    )


def _arrays(path: Path, names: Sequence[str]) -> dict[str, np.ndarray]:
    """Named arrays of numbers from an archive: nothing that would run, nothing too large."""
    try:
        with zipfile.ZipFile(path) as archive:
            unpacked = sum(entry.file_size for entry in archive.infolist())
        if unpacked > LARGEST_ARCHIVE:
            raise WedgeError(f"{path} would unpack to {unpacked / 1e9:.0f} GB: that is no data.")
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in names}
    except KeyError as error:
        raise WedgeError(f"{path} is incomplete: {error.args[0]}.") from error
    except UNREADABLE_ARCHIVE as error:
        raise WedgeError(f"{path} cannot be read: {error}.") from error
    for name, array in arrays.items():
        if array.dtype.kind not in "uif":
            raise WedgeError(f"{path}: {name} must be numbers, not {array.dtype}.")
    return arrays


def _text(path: Path) -> str:
    try:
        if path.stat().st_size > LARGEST_TEXT:
            raise WedgeError(f"{path} is larger than 10 MB: that is no list of circles.")
        return path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise WedgeError(f"{path} cannot be read as text: {error}.") from error


def _inside(source: Path, name: str, where: str) -> Path:
    """A folder that a catalogue names, which must lie within the source."""
    path = (source / name).resolve()
    if not name or not path.is_relative_to(source.resolve()):
        raise WedgeError(f"{source / where}: {name!r} is not a folder inside {source.name}.")
    return path


def _number(text: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError as error:
        raise WedgeError(f"{where}: {text!r} is not a number.") from error
    if not 0 < value < 1e3:
        raise WedgeError(f"{where}: {text} mm is no ball's size.")
    return value


def _refuse_none(source: Path, labels: Sequence[BallLabel]) -> None:
    if not 0 < len(labels) <= MOST_PRESSES:
        raise WedgeError(f"{source} holds {len(labels)} labelled presses.")
