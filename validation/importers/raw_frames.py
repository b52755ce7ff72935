# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A folder of a sensor's own raw frames to a labelled dataset, with nothing asked but the ball.

Pictures are told by their names: ``background``, ``blank``, ``bg``, ``ref``, ``reference`` or
``empty``, with a number behind it or with ``-``, ``_`` or a space and anything, shows the blank gel
(``bg1.png``, ``background_real.png``, not ``bgball.png``), ``5mm-*`` (or ``caliper-5mm-*``) the
jaws of a caliper 5 mm apart, every other one a ball press. The pad's corners come from the blank
gel, its size from the caliper, the circles from the presses, the lens from a ``camera.toml`` beside
them.
"""

import re
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path

from recon.arrays import Frame
from recon.geometry.caliper import Scale
from recon.geometry.lens import read_lens, write_lens
from recon.geometry.pad import base_side, find_pad, gel_corners
from recon.geometry.unwarp import Corners, prepare_unwarp
from recon.images import read_image
from recon.labels.ball_size import refuse_wrong_ball
from recon.labels.find_circles import found_labels
from recon.labels.label_book import refuse_name
from recon.presses import LeftOut, PressReader, press_reader, refuse_other_size
from sensor.dataset import (
    CARD_FILE,
    IMAGES,
    LABELS_FILE,
    LENS_FILE,
    BallLabel,
    DatasetCard,
    read_dataset,
    write_card,
    write_labels,
)
from sensor.errors import WedgeError
from sensor.toml import Pair, located
from validation.importers.caliper import measured_scale, spread_over
from validation.importers.folder import copy_frames, plain_name, write_dataset

BACKGROUND = re.compile(
    r"^(background|blank|bg|ref|reference|empty)\d*([-_ ].*)?$", re.IGNORECASE | re.DOTALL
)
CALIPER = re.compile(r"(?:caliper[-_ ]?)?(\d+(?:\.\d+)?)mm(?=$|[-_ ])", re.IGNORECASE)
"""From the name's beginning: further on, a length is that of the ball."""
CAPTURED, OWN = "captured from a sensor", "your own"
"""Source and licence of what somebody took."""
WIDTH_PX = 320
"""Of the unwarped frames: as many as a small camera frame has."""


@dataclass(frozen=True, kw_only=True)
class Pictures:
    """The pictures of a folder by what they show."""

    background: tuple[str, ...]
    caliper: tuple[tuple[str, float], ...]
    """Name and gap in mm."""
    presses: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Prepared:
    """What was found out about a sensor from its frames."""

    card: DatasetCard
    presses: tuple[str, ...]
    """Names of the pictures that were searched."""
    left_out: tuple[LeftOut, ...]
    """Those of presses that were not: damaged, or of another size."""
    labels: tuple[BallLabel, ...]
    scale: Scale | None
    """From the caliper, in the pixels of the pad as first taken; ``None`` without one."""
    caliper: int
    """Pictures of it."""
    lens: bool
    """Whether one lay beside the frames, and was taken over."""
    left_aside: Corners | None
    """Of a pad that seems to show in frames that are said to show the gel plane."""


def is_background(name: str) -> bool:
    """Whether a picture's name says that it shows the blank gel."""
    return bool(BACKGROUND.match(Path(name).stem))


def sort_pictures(names: Sequence[str]) -> Pictures:
    """Tell pictures by their names, where some must show the blank gel and some a press.

    Raises:
        WedgeError: none shows the blank gel, or none a press.
    """
    pictures = told_by_name(names)
    if not pictures.background:
        raise WedgeError(
            "no picture is named as one of the blank gel: name it background.png or bg-0.jpg."
        )
    if not pictures.presses:
        raise WedgeError(f"there is no picture of a ball press{only_caliper(pictures)}.")
    return pictures


def only_caliper(pictures: Pictures) -> str:
    """That all pictures but the blank gel's count as a caliper's by their names, if they do."""
    if pictures.presses or not pictures.caliper:
        return ""
    count, (name, _) = len(pictures.caliper), pictures.caliper[0]
    named = f"all {count} are named" if count > 1 else "the only one is named"
    return f": {named} as a caliper's ({name}), by the length that the name begins with"


def told_by_name(names: Sequence[str]) -> Pictures:
    """The pictures among some files by what their names say that they show."""
    shown = (name for name in names if not name.startswith("."))  # as a Mac's ._press.png is not
    pictures = sorted(name for name in shown if Path(name).suffix.lower() in IMAGES)
    background = tuple(name for name in pictures if is_background(name))
    gaps = {name: CALIPER.match(Path(name).stem) for name in pictures}
    caliper = tuple((name, float(gap[1])) for name, gap in gaps.items() if gap)
    apart = {*background, *(name for name, _ in caliper)}
    presses = tuple(name for name in pictures if name not in apart)
    return Pictures(background=background, caliper=caliper, presses=presses)


def import_raw_frames(
    source: Path,
    folder: Path,
    pool: Executor,
    *,
    ball_radius_mm: float,
    pad_size_mm: Pair,
    mm_per_px: float | None = None,
    check: Callable[[DatasetCard], None] = lambda card: None,
    progress: Callable[[float, str], None] = lambda share, step: None,
) -> Prepared:
    """Write the dataset: corners found, scale measured, circles found.

    Args:
        source: folder of frames.
        folder: to write to.
        pool: finds circles.
        ball_radius_mm: of the ball.
        pad_size_mm: of the pad along x and y, where no caliper's picture tells; else a first guess.
            A frame in which no pad shows is taken to be as long as it.
        mm_per_px: pitch of frames that show the gel plane; ``None`` where nobody said. A pad that
            seems to show in them is left aside.
        check: called with the card before circles are searched for, to refuse it.
        progress: called with the share that is done and what is being done.

    Raises:
        WedgeError: a picture of the blank gel or of a caliper is damaged, or that of every press;
            the caliper's do not determine a scale, no ball is found, the ball's radius cannot be
            right, the lens is another camera's, or ``mm_per_px`` is given for frames that tell
            their scale by a caliper.
    """
    pictures = _pictures(source)
    if mm_per_px is not None and pictures.caliper:
        raise WedgeError(
            f"{source / pictures.caliper[0][0]} is a picture of a caliper, which gives the scale: "
            "leave out --mm-per-px or the picture."
        )
    blank = read_image(source / pictures.background[0])
    pictures, left_out = _readable(source, pictures, blank)
    copy_frames(source, folder, [*pictures.background, *pictures.presses])
    name = plain_name(source.resolve().name, "frames")
    card = first_card(blank, name, pictures.background, ball_radius_mm, pad_size_mm)
    left_aside = None
    if mm_per_px is not None:
        left_aside, pitch = card.corners_px, (mm_per_px, mm_per_px)
        card = replace(card, corners_px=None, pad_size_mm=None, mm_per_px=pitch)
    lens = (source / LENS_FILE).is_file()
    if lens:
        _copy_lens(source, folder, blank)
    reader = _reader(folder, card)
    scale, assumed = None, "" if mm_per_px is not None else _assumed(pad_size_mm)
    if pictures.caliper:
        progress(0.05, "measuring the caliper")
        scale = _scale(source, pictures, pool, reader, pad_size_mm)
        card, assumed = rescaled(card, scale), ""
        reader = _reader(folder, card)
    check(card)
    labels = _circles(source, pictures.presses, pool, reader, assumed, progress)
    write_dataset(folder, card, labels)
    return Prepared(
        card=read_dataset(folder).card,
        presses=pictures.presses,
        left_out=left_out,
        labels=tuple(labels),
        scale=scale,
        caliper=len(pictures.caliper),
        lens=lens,
        left_aside=left_aside,
    )


def _pictures(source: Path) -> Pictures:
    """The pictures in a folder by what they show.

    Raises:
        WedgeError: the folder cannot be read, lacks pictures, or one has a name that no label can
            bear.
    """
    try:
        pictures = sort_pictures([path.name for path in source.iterdir() if path.is_file()])
    except WedgeError as error:
        raise WedgeError(f"{source}: {error}{_in_subfolder(source)}") from error
    except OSError as error:
        raise WedgeError(f"{source} cannot be read: {error.strerror}.") from error
    for name in pictures.presses:
        refuse_name(source / name)
    return pictures


def _readable(
    source: Path, pictures: Pictures, blank: Frame
) -> tuple[Pictures, tuple[LeftOut, ...]]:
    """The pictures without those of presses that cannot be used, and these with the reason.

    Raises:
        WedgeError: it is all of them; the sentence is the first one's.
    """
    faults: dict[str, WedgeError] = {}
    for name in pictures.presses:
        try:
            frame = read_image(source / name)
            refuse_other_size(source / name, frame, pictures.background[0], blank)
        except WedgeError as error:
            faults[name] = error
    presses = tuple(name for name in pictures.presses if name not in faults)
    if not presses:
        raise next(iter(faults.values()))
    reasons = {x: str(why).removeprefix(f"{source / x} ").rstrip(".") for x, why in faults.items()}
    left_out = tuple(LeftOut(file=name, reason=reason) for name, reason in reasons.items())
    return replace(pictures, presses=presses), left_out


def _scale(
    source: Path, pictures: Pictures, pool: Executor, reader: PressReader, pad_size_mm: Pair
) -> Scale:
    """The scale from the caliper's pictures, by the shading of a few presses.

    Raises:
        WedgeError: no ball is found in them, or the caliper's do not determine a scale.
    """
    few = spread_over(pictures.presses)
    some = found_labels(reader, few, pool)
    if not some:
        length, width = pad_size_mm
        raise WedgeError(
            f"{source}: no ball was recognised in {', '.join(few[:3])}: check that the ball's "
            f"radius is {reader.dataset.card.ball_radius_mm:g} mm and the pad about {length:g} x "
            f"{width:g} mm, as is assumed until the caliper is measured."
        )
    return measured_scale(source, pictures.caliper, reader, some, pool.map)


def _circles(
    source: Path,
    presses: Sequence[str],
    pool: Executor,
    reader: PressReader,
    assumed: str,
    progress: Callable[[float, str], None],
) -> list[BallLabel]:
    """The circles in the pictures that show one.

    Args:
        source: the folder that errors name.
        presses: names of the pictures.
        pool: finds them.
        reader: of the dataset in which the pictures are.
        assumed: behind an error that a wrong scale may cause: where the scale is from.
        progress: called with the share that is done and what is being done.

    Raises:
        WedgeError: no ball is found, or its radius cannot be right.
    """
    card = reader.dataset.card
    labels = found_labels(
        reader, presses, pool, lambda share: progress(0.2 + 0.8 * share, "finding circles")
    )
    if not labels:
        pitches = " x ".join(f"{pitch:.4g}" for pitch in card.mm_per_px)
        raise WedgeError(
            f"{source}: no ball of radius {card.ball_radius_mm:g} mm was recognised in any of its "
            f"pictures, at {pitches} mm/px.{assumed}"
        )
    try:
        refuse_wrong_ball(labels, card)
    except WedgeError as error:
        raise WedgeError(f"{error}{assumed}") from error
    return labels


def _in_subfolder(source: Path) -> str:
    """That pictures lie below a folder in which some are missing, where they do."""
    for path in sorted(source.glob("[!.]*/[!.]*")):
        if path.suffix.lower() in IMAGES:
            return f" Pictures in {path.parent} are not looked at: move them to the others."
    return ""


def _assumed(pad_size_mm: Pair) -> str:
    """That a scale, at which something was not found, was nobody's word."""
    length, width = pad_size_mm
    return (
        f" The pad is only taken to be {length:g} x {width:g} mm, as nothing measured it: set it "
        "with `wedge calibrate --design` or `wedge data import --pad-size-mm`."
    )


def first_card(
    blank: Frame,
    name: str,
    background: tuple[str, ...],
    ball_radius_mm: float,
    pad_size_mm: Pair,
) -> DatasetCard:
    """The card with the corners and a first scale; where no pad shows, of the whole frame."""
    clockwise = find_pad(blank)
    pitch = pad_size_mm[0] / (WIDTH_PX if clockwise else blank.shape[1])
    return DatasetCard(
        name=name,
        source=CAPTURED,
        licence=OWN,
        mm_per_px=(pitch, pitch),
        ball_radius_mm=ball_radius_mm,
        background=background,
        corners_px=None if clockwise is None else gel_corners(clockwise, base_side(clockwise)),
        pad_size_mm=None if clockwise is None else pad_size_mm,
    )


def rescaled(card: DatasetCard, scale: Scale) -> DatasetCard:
    """The card with the scale that was measured, in square pixels where it is unwarped."""
    size = card.unwarped_size_px
    if size is None:
        return replace(card, mm_per_px=scale.mm_per_px)
    length, width = (round(n * mm, 2) for n, mm in zip(size, scale.mm_per_px, strict=True))
    pitch = round(length / WIDTH_PX, 5)
    return replace(card, pad_size_mm=(length, width), mm_per_px=(pitch, pitch))


def _copy_lens(source: Path, folder: Path, blank: Frame) -> None:
    """Take the lens over, from which on it is removed from every frame of the dataset.

    Raises:
        WedgeError: it is damaged, or was measured on frames of another size.
    """
    lens = read_lens(source / LENS_FILE)
    height, width = blank.shape[:2]
    try:
        prepare_unwarp((width, height), lens=lens)
    except WedgeError as error:
        raise located(source / LENS_FILE, error) from error
    write_lens(folder / LENS_FILE, lens)


def _reader(folder: Path, card: DatasetCard) -> PressReader:
    write_card(folder / CARD_FILE, card)
    write_labels(folder / LABELS_FILE, [])
    return press_reader(read_dataset(folder))
