# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge label`: circles found automatically, then a page to mend the doubtful ones."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from app._progress import progress
from app._workers import process_pool
from sensor.dataset import CARD_FILE, LABELS_FILE, read_dataset
from sensor.errors import WedgeError
from sensor.extras import how_to_install
from sensor.files import check_outputs
from sensor.toml import located

if TYPE_CHECKING:
    from recon.labels.circles import Circle
    from recon.labels.label_book import LabelBook
    from recon.presses import PressReader

SAVED_TOGETHER = 50
"""Circles found: to write the whole file for each would take a time that grows as their square."""


def main(
    dataset: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="DATASET")],
    again: bool = False,
    no_page: bool = False,
    corners: bool = False,
    port: int = 8010,
) -> None:
    """Find the circle of every ball press, then open a page to correct the doubtful ones.

    Each frame without a label gets the circle that best explains its shading, with a quality from
    0 to 1 and a contact radius that excludes gel that is only dragged along. Circles of high
    quality need no check; the page shows the doubtful ones first. Every change there is written to
    labels.csv at once.

    With --corners, the page shows a raw frame with the pad's four corners to drag and, next to it,
    the unwarped picture that they make. Every change is written to dataset.toml at once. It drops
    the circles found so far, which lie in pixels of the unwarped picture: find them again with
    `wedge label`.

    Example: wedge label presses/2026-11-21

    Example: wedge label presses/2026-11-21 --corners

    Args:
        dataset: A dataset folder of your own: dataset.toml, a background and the frames.
        again: Find the circles of labelled frames again too, except those corrected by hand, and
            also search frames that somebody marked as having no ball.
        no_page: Stop after the automatic circles, without opening the page (local to this computer;
            Ctrl-C ends it).
        corners: Open the page for the pad's corners instead.
        port: Port of the page.
    """
    from recon.labels.find_circle import refuse_ball
    from recon.labels.label_book import (
        LabelBook,
        drop_wide_circles,
        is_looked_at,
        pressed_frames,
        within_balls,
    )
    from recon.labels.press_doubts import is_doubtful
    from recon.presses import press_reader

    if corners and no_page:
        raise WedgeError("--corners opens a page, and --no-page opens none: leave one of them out.")
    if not 1 <= port <= 65535:
        raise WedgeError(f"--port {port} must lie between 1 and 65535.")
    _refuse_no_folder(dataset)
    source = read_dataset(dataset, labelled=False, within_balls=not again)
    source = within_balls(source)
    reader = press_reader(source)
    files = pressed_frames(dataset, source.card)
    if not files:
        raise WedgeError(
            f"{dataset} holds no frames except its background: take ball presses first."
        )
    if corners:
        _serve_corners(reader, [*source.card.background, *files], port)
        return
    book = LabelBook(source)

    def is_wanted(file: str) -> bool:
        label = book.label(file)
        if label is None:
            return again or not book.has_no_ball(file)
        return again and not is_looked_at(label)

    wanted = [file for file in files if is_wanted(file)]
    if wanted:
        check_outputs(dataset / LABELS_FILE)
        card = source.card
        try:
            refuse_ball(reader.unwarp.size_px, card.ball_radius_mm, card.mm_per_px)
        except WedgeError as error:
            raise located(dataset / CARD_FILE, error) from error
    if again:  # only now, as a mistaken radius would have dropped them all
        drop_wide_circles(dataset)
    if wanted:
        _find(reader, book, wanted)
    doubtful = [x.file for x in book.labels if is_doubtful(x)]
    missing = [x for x in files if book.label(x) is None and not book.has_no_ball(x)]
    found = sum(book.label(file) is not None for file in files)
    print(f"Frames with a circle: {found} of {len(files)}; doubtful: {len(doubtful)}.")
    if missing:
        print(f"No ball was found in {_some(missing)}.")
    for sentence in _odd_rows(reader, book):
        print(sentence)
    if not no_page:
        _serve(reader, port)


def _odd_rows(reader: "PressReader", book: "LabelBook") -> "Iterator[str]":
    """A sentence on the rows that name no frame, and on those of which the circle lies outside."""
    from recon.labels.odd_rows import has_frame, is_outside

    table = reader.dataset.folder / LABELS_FILE
    width, height = reader.unwarp.size_px
    if lost := [x.file for x in book.labels if not has_frame(reader.dataset.folder, x.file)]:
        yield f"{table} labels frames that do not exist, {_some(lost)}: remove those rows."
    if outside := [x.file for x in book.labels if is_outside(x, (width, height))]:
        yield (
            f"{table} has circles whose centres lie outside the {width}x{height} frame, of "
            f"{_some(outside)}: correct those rows, or remove them and run this again."
        )


def _some(files: list[str]) -> str:
    """The first of some names."""
    return f"{', '.join(files[:5])}{' ...' if len(files) > 5 else ''}"


def _refuse_no_folder(dataset: Path) -> None:
    """Refuse the name of a known set, whose folder in the cache is nobody's own, and what is not.

    Raises:
        WedgeError: says what to do instead.
    """
    if dataset.exists():
        return
    from validation.datasets import known_datasets

    name = str(dataset)
    if name in known_datasets():
        raise WedgeError(
            f"{name} is a known dataset in the cache, which stays as it was imported: copy it "
            f'first, cp -r "$(wedge data path {name})" my-{name}, and label the copy.'
        )
    raise WedgeError(f"{name} does not exist: name a dataset folder of your own.")


def _find(reader: "PressReader", book: "LabelBook", files: list[str]) -> None:
    """Find the circles of some frames in parallel; what is found is kept, whatever ends it."""
    from recon.labels.find_circles import agreed, found_circle, labels_of

    circles: dict[str, Circle] = {}
    unsaved: dict[str, Circle] = {}
    with progress("circles") as show, process_pool() as pool:
        found = pool.map(partial(found_circle, reader), files, chunksize=2)
        try:
            for done, (file, circle) in enumerate(zip(files, found, strict=True), start=1):
                if circle is not None:
                    circles[file] = unsaved[file] = circle
                if len(unsaved) >= SAVED_TOGETHER:
                    book.put_found(labels_of(reader, unsaved))
                    unsaved = {}
                show(done / len(files), file)
        finally:
            if circles:
                book.put_found(labels_of(reader, agreed(circles)))


def _serve(reader: "PressReader", port: int) -> None:
    with _extra():
        from app.pages.label import serve
    serve(reader, port)


def _serve_corners(reader: "PressReader", files: list[str], port: int) -> None:
    with _extra():
        from app.pages.corners import serve
    serve(reader, files, port)


@contextmanager
def _extra() -> Iterator[None]:
    """Say which extra brings what the pages need."""
    try:
        yield
    except ImportError as error:
        raise WedgeError(
            f"the page needs {error.name}: {how_to_install('live')}, or add --no-page."
        ) from error
