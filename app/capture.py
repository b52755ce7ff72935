# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge capture`: from a stream to a dataset folder of labelled ball presses."""

import math
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from sensor.errors import WedgeError

if TYPE_CHECKING:
    from recon.labels.capture import PressWatcher
    from recon.labels.circles import Circle
    from recon.labels.label_book import LabelBook
    from sensor.dataset import BallLabel, Dataset, DatasetCard

CALIPER_FOLDER = "caliper"
CALIPERS = 2
"""Pictures of the caliper: one along the finger, one across."""
Where = Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="WHERE")]


def main(
    where: Where,
    out: Path,
    like: str | None = None,
    presses: int = 40,
    ball_radius_mm: float | None = None,
    caliper_mm: float | None = None,
    background: Path | None = None,
) -> None:
    """Take ball presses from a sensor and write them as a dataset folder.

    Leave the gel alone first: a few still frames become the background. Then press the ball all
    over the pad. Each press is taken once it holds still, and refused with a reason where it is
    blurred, saturated, or no ball; a map shows where presses are missing. Every press is on disk
    with its circle as soon as it is taken; Ctrl-C ends early and loses nothing. Frames of a folder
    are judged one by one, without waiting for stillness.

    A sensor seen for the first time has no other dataset: its pad's corners are then found in the
    first frame, and with --caliper-mm the first two presses are a caliper's jaws that far apart,
    once along the finger and once across, from which the scale follows at the end.

    Example: wedge capture http://10.55.0.1:8080 --like presses/last-week --out presses/today

    Example: wedge capture http://10.55.0.1:8080 --ball-radius-mm 2.42 --caliper-mm 5 --out presses

    Args:
        where: http://HOST:PORT/PATH, usb:0, a video, a folder, or an MCAP file.
        out: The dataset folder to write; it must not exist, or be empty.
        like: A dataset of the same sensor: its corners, scale and ball are taken over, so that
            --caliper-mm is refused beside it.
        caliper_mm: Gap of the caliper's jaws; two pictures of it are taken first, named by it.
        presses: How many to take.
        ball_radius_mm: Radius of the ball, where it is not that of the other dataset.
        background: A picture of the blank gel, where the stream shows none.
    """
    from app._sources import open_live, open_where
    from recon.images import read_image, write_image
    from recon.stream import Newest
    from sensor.files import alone_in, refuse_kept_folder

    if presses < 1:
        raise WedgeError(f"--presses {presses} must be at least 1.")
    for name, value in (("ball-radius-mm", ball_radius_mm), ("caliper-mm", caliper_mm)):
        if value is not None and not 0 < value < 1e3:
            raise WedgeError(f"--{name} {value:g} must be above 0 and below 1000.")
    if like is None and ball_radius_mm is None:
        raise WedgeError(
            "say how large the ball is, --ball-radius-mm, or name a dataset --like it."
        )
    if like is not None and caliper_mm is not None:
        raise WedgeError(
            f"--like takes the scale over from {like}, and --caliper-mm measures it anew: leave "
            "one of them out."
        )
    refuse_kept_folder(out)
    other = _dataset(like)
    if other is not None and ball_radius_mm is None and len(other.ball_radii_mm) > 1:
        raise WedgeError(
            f"{like} has presses of balls of {' and '.join(f'{x:g}' for x in other.ball_radii_mm)} "
            "mm radius: say which is pressed now, --ball-radius-mm."
        )
    alone = Path(where).is_dir()
    # Of a sensor the newest frame, as judging one takes longer than the next needs to come.
    with open_where(where) if alone else Newest(open_live(where)) as source:
        watcher: PressWatcher | None = None
        book: LabelBook | None = None
        taken: list[str] = []
        calipers: list[tuple[str, float]] = []
        shown = _Shown(presses)
        with _ending_early(taken):
            for timed in source:
                try:
                    frame = timed.image()
                    if watcher is not None:
                        watcher.unwarp.check(frame)
                except WedgeError as error:
                    if watcher is None and background is None:  # the blank one
                        raise
                    shown(f"frame {timed.index} is passed over: {error}", len(taken), watcher)
                    continue
                if watcher is None:
                    blank = frame if background is None else read_image(background)
                    card = _card(other, out, blank, ball_radius_mm)
                    watcher = _watcher(other, card, blank, CALIPERS if caliper_mm else 0)
                    if background is not None or alone:
                        # A folder's first frame is its blank one, unless a picture of it was given.
                        watcher.set_background(blank)
                verdict = watcher.judge_alone(frame) if alone else watcher.look(frame)
                if verdict.circle is not None:
                    if book is None:
                        book = _begun(other, out, card, watcher)
                    name = f"press-{len(taken) + 1:03d}.png"
                    _keep(book, name, watcher, frame, verdict.circle)
                    taken.append(name)
                elif verdict.taken and caliper_mm is not None:
                    name = f"{caliper_mm:g}mm-{len(calipers) + 1}.png"
                    write_image(out / CALIPER_FOLDER / name, frame)
                    calipers.append((name, caliper_mm))
                shown(verdict.words, len(taken), watcher)
                if len(taken) == presses:
                    break
    if not taken or watcher is None:
        raise WedgeError(f"no press was taken from {where}: {shown.last}.")
    print(_map(watcher))
    if other is None:
        with alone_in(out):  # what others write meanwhile is neither lost nor made of other pixels
            _finish(out, calipers)
    print(f"{len(taken)} presses in {out}. Next: wedge label {out}")


def _keep_lens(other: "Dataset", out: Path) -> None:
    """Circles lie in pixels that the other's lens was taken out of: it belongs to these as well."""
    from recon.geometry.lens import write_lens
    from recon.presses import read_dataset_lens
    from sensor.dataset import LENS_FILE

    lens = read_dataset_lens(other)
    if lens is not None:
        write_lens(out / LENS_FILE, lens)


@contextmanager
def _ending_early(taken: list[str]) -> Iterator[None]:
    """Let Ctrl-C end the capture as the last press does, where there is one."""
    try:
        yield
    except KeyboardInterrupt:
        if not taken:
            raise


def _dataset(like: str | None) -> "Dataset | None":
    from sensor.dataset import read_dataset
    from validation.datasets import dataset_folder

    return None if like is None else read_dataset(dataset_folder(like))


def _card(
    other: "Dataset | None", out: Path, blank: Any, ball_radius_mm: float | None
) -> "DatasetCard":
    """The other dataset's card under a new name, or one made from the blank frame."""
    from sensor.design import STANDARD
    from validation.importers.raw_frames import first_card

    name, background = out.resolve().name, ("background.png",)
    if other is None:
        assert ball_radius_mm is not None
        return first_card(blank, name, background, ball_radius_mm, STANDARD.pad_size_mm)
    return replace(
        other.card,
        name=name,
        source="captured from a sensor",
        licence="your own",
        background=background,
        ball_radius_mm=ball_radius_mm or other.ball_radii_mm[0],
    )


def _watcher(
    other: "Dataset | None", card: "DatasetCard", blank: Any, calipers: int
) -> "PressWatcher":
    from recon.geometry.unwarp import prepare_unwarp
    from recon.images import read_frame
    from recon.labels.capture import PressWatcher
    from recon.presses import dataset_unwarp, read_dataset_lens

    if other is None:
        height, width = blank.shape[:2]
        unwarp = prepare_unwarp((width, height), card.corners_px, card.unwarped_size_px)
    else:
        first = read_frame(other.folder, other.card.background[0])
        if first.shape != blank.shape:
            (height, width), (other_height, other_width) = blank.shape[:2], first.shape[:2]
            raise WedgeError(
                f"the frames are {width}x{height} pixels, those of {other.card.name} are "
                f"{other_width}x{other_height}: another camera, or another resolution."
            )
        unwarp = dataset_unwarp(other, blank, read_dataset_lens(other))
    return PressWatcher(unwarp, card.ball_radius_mm, card.mm_per_px, calipers)


def _finish(out: Path, calipers: list[tuple[str, float]]) -> None:
    """Measure the lights, and the scale by the caliper; circles are then found anew.

    All of what is on disk by now: somebody may have mended it while presses were taken.
    """
    from recon.presses import press_reader
    from sensor.dataset import read_dataset
    from validation.importers.folder import add_lights, write_dataset
    from validation.importers.raw_frames import measured_scale, rescaled

    dataset = read_dataset(out)
    card = dataset.card
    if not calipers:
        add_lights(dataset)
        if card.pad_size_mm is not None:
            length, width = card.pad_size_mm
            print(f"The pad is taken to be {length:g} x {width:g} mm: --caliper-mm measures it.")
        else:
            print(
                "No mirror's pad shows in the first frame: the frame is taken to be as long as the "
                f"design's pad, so {card.mm_per_px[0]:.5f} mm/px: --caliper-mm measures it."
            )
        return
    few = dataset.labels[:: max(1, -(-len(dataset.labels) // 8))]
    kept = f"The presses are kept in {out}, at the design's size."
    try:
        if not few:
            raise WedgeError("no press has a circle any more, and some are needed for the scale.")
        scale = measured_scale(out / CALIPER_FOLDER, calipers, press_reader(dataset), few)
        measured = rescaled(card, scale)
        found = _found_anew(dataset, measured)
    except KeyboardInterrupt:
        print(kept, file=sys.stderr)
        raise
    except WedgeError as error:
        add_lights(dataset)
        raise WedgeError(f"{error} {kept}") from error
    write_dataset(out, measured, found)
    x, y = (s / mm for s, mm in zip(scale.sigma_mm_per_px, scale.mm_per_px, strict=True))
    print(
        f"Scale from {scale.gaps} pictures of the caliper, to {x:.1%} along x and {y:.1%} along y."
    )


def _found_anew(before: "Dataset", card: "DatasetCard") -> list["BallLabel"]:
    """The labels of a dataset by another card than they were made with.

    Circles that somebody drew or looked at stay where they are on the gel.

    Raises:
        WedgeError: no ball is recognised by it.
    """
    from functools import partial

    from app._progress import progress
    from app._workers import process_pool
    from recon.labels.label_book import CERTAIN, automatic_label
    from recon.presses import press_reader

    dataset = replace(before, card=card)
    found = [_carried(x, before, dataset) for x in before.labels if x.quality in (None, CERTAIN)]
    with progress("circles at the measured scale") as show, process_pool() as pool:
        files = [x.file for x in before.labels if x.quality not in (None, CERTAIN)]
        finder = partial(automatic_label, press_reader(dataset))
        for done, label in enumerate(pool.map(finder, files), start=1):
            found += [] if label is None else [label]
            show(done / len(files))
    if not found:
        pitches = " x ".join(f"{pitch:.4g}" for pitch in card.mm_per_px)
        raise WedgeError(f"no ball was recognised at the caliper's scale, {pitches} mm/px.")
    return sorted(found, key=lambda label: label.file)


def _carried(label: "BallLabel", before: "Dataset", after: "Dataset") -> "BallLabel":
    """A circle in the pixels of another card, whose unwarped pictures have another size."""
    from recon.labels.label_book import largest_radius_px

    sizes = before.card.unwarped_size_px, after.card.unwarped_size_px
    old, new = ((1, 1) if size is None else size for size in sizes)
    x, y = (n / m for m, n in zip(old, new, strict=True))
    radius_px = label.contact_radius_px * math.sqrt(x * y)
    return replace(
        label,  # the middle of the first pixel is 0
        center_x_px=round((label.center_x_px + 0.5) * x - 0.5, 2),
        center_y_px=round((label.center_y_px + 0.5) * y - 0.5, 2),
        contact_radius_px=round(min(radius_px, largest_radius_px(after, label.file)), 2),
    )


def _begun(
    other: "Dataset | None", out: Path, card: "DatasetCard", watcher: "PressWatcher"
) -> "LabelBook":
    """Write all but the presses; their labels are others' to mend from here on as well."""
    from recon.images import write_image
    from recon.labels.label_book import LabelBook
    from sensor.dataset import read_dataset, write_card

    assert watcher.background is not None
    if other is not None:
        _keep_lens(other, out)
    write_image(out / "background.png", watcher.background)
    write_card(out / "dataset.toml", card)
    return LabelBook(read_dataset(out, labelled=False))


def _keep(
    book: "LabelBook", name: str, watcher: "PressWatcher", frame: Any, circle: "Circle"
) -> None:
    """Write one press: the frame first, then the labels that name it."""
    from recon.images import write_image
    from sensor.dataset import BallLabel

    width, height = watcher.unwarp.size_px
    label = BallLabel(
        file=name,
        center_x_px=round(min(max(circle.center_px[0], 0.0), width - 1.0), 2),
        center_y_px=round(min(max(circle.center_px[1], 0.0), height - 1.0), 2),
        contact_radius_px=round(circle.radius_px, 2),
        quality=round(circle.quality, 3),
    )
    write_image(book.folder / name, frame)
    book.put_found([label])


class _Shown:
    """One line on stderr for each thing that changes, with how far the capture is."""

    def __init__(self, presses: int) -> None:
        self.presses = presses
        self.last = "it gave no frame"

    def __call__(self, words: str, taken: int, watcher: "PressWatcher | None") -> None:
        if words != self.last:
            pad = "" if watcher is None else f"pad {watcher.coverage.share:4.0%} {watcher.coverage}"
            print(f"{taken:3d}/{self.presses}  {pad}  {words}", file=sys.stderr, flush=True)
        self.last = words


def _map(watcher: "PressWatcher") -> str:
    """The pad with the presses of each cell, base on the left."""
    rows = [" ".join(f"{count:3d}" for count in row) for row in watcher.coverage.counts]
    return "\n".join(["Presses over the pad, base on the left:", *rows])
