# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge capture`: from a stream to a dataset folder of labelled ball presses."""

import sys
from collections.abc import Callable, Iterator, Set
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from app._capture_session import CaptureSession, assumed
from app._captured import Captured
from app._lights import lights_remark
from app._output import command_line
from app._pad import assumed_pad_mm, proportion_remark
from app._sources import is_dataset, open_live, open_where
from sensor.dataset import CARD_FILE, Dataset, read_dataset
from sensor.design_file import load_design
from sensor.errors import WedgeError
from sensor.files import check_outputs, refuse_kept_folder

if TYPE_CHECKING:
    from recon.labels.capture import PressWatcher
    from recon.stream import FrameSource, Newest, TimedFrame
    from sensor.design import Wedge

REMARK_S = 0.3
"""Without a frame for so long, a stream may have something to say."""
Where = Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="WHERE")]


def main(
    where: Where,
    out: Path,
    like: str | None = None,
    presses: int = 40,
    ball_radius_mm: float | None = None,
    design: str | None = None,
    pad_size_mm: tuple[float, float] | None = None,
    caliper_mm: float | None = None,
    background: Path | None = None,
) -> None:
    """Take ball presses from a sensor and write them as a dataset folder.

    Leave the gel alone first: a few still frames become the background. Then press the ball all
    over the pad. A press is taken once it holds still, and refused with a reason if it is blurred,
    saturated or no ball; a map shows where presses are missing. Each press is on disk with its
    circle as soon as it is taken; Ctrl-C ends early and loses nothing.

    For a sensor seen for the first time, the pad's corners are found in the first frame, and the
    pad is taken to be the standard design's unless --design or --pad-size-mm gives another. With
    --caliper-mm, the first two presses are a caliper's jaws that far apart, once along the finger
    and once across; the scale is computed from them at the end.

    The pictures of a folder are judged one by one, without waiting for stillness. Names such as
    background.png and 5mm-1.png tell which show the blank gel and a caliper. The caliper's pictures
    are skipped without --caliper-mm; with it, all of them are used.

    Example: wedge capture http://10.55.0.1:8080 --like presses/last-week --out presses/today

    Example: wedge capture http://10.55.0.1:8080 --ball-radius-mm 2.42 --caliper-mm 5 --out presses

    Args:
        where: http://HOST:PORT/PATH, usb:0, a video, a folder, or an MCAP file.
        out: The dataset folder to write; new or empty.
        like: A dataset of the same sensor: its corners, scale and ball are reused; options that set
            the scale, such as --caliper-mm, cannot be combined with it.
        design: The design the sensor was built from, which gives the size of its pad and its
            lights: standard, finger or a .toml file.
        pad_size_mm: Size of the pad along x and y, if the sensor has no such design.
        caliper_mm: Gap between the caliper's jaws; its pictures are taken first and named after it.
        presses: Number of presses to take.
        ball_radius_mm: Radius of the ball; needed without --like, or if the ball is another one.
        background: A picture of the blank gel, if the stream shows none.
    """
    from recon.stream import Newest, shown_address
    from validation.intervals import counted

    if presses < 1:
        raise WedgeError(f"--presses {presses} must be at least 1.")
    of_pad = "--design" if design else "--pad-size-mm" if pad_size_mm else None
    _refuse_options(like, ball_radius_mm, caliper_mm, of_pad)
    built_from = None if design is None else load_design(design)
    pad_mm = assumed_pad_mm(built_from, pad_size_mm)
    refuse_kept_folder(out)
    check_outputs(out / CARD_FILE)
    other = _dataset(like, ball_radius_mm)
    session = CaptureSession(
        out,
        presses=presses,
        other=other,
        ball_radius_mm=ball_radius_mm,
        pad_size_mm=pad_mm,
        pad_by=of_pad,
        caliper_mm=caliper_mm,
        background=background,
    )
    source: FrameSource | Newest
    look: Callable[[TimedFrame], None]
    # Of a sensor the newest frame, as judging one takes longer than the next needs to come.
    if Path(where).is_dir():
        source, of_caliper = _pictures(where, background is None, caliper_mm)
        look = partial(session.look_at_picture, of_caliper=of_caliper)
    else:
        source, look = Newest(open_live(where)), session.look
    with source, _ending_early(session.taken):
        for timed in _followed(source, session.say) if isinstance(source, Newest) else source:
            look(timed)
            if len(session.taken) == presses:
                break
    if session.captured is None or session.watcher is None:
        named = shown_address(where) if "://" in where else where
        raise WedgeError(f"no press was taken from {named}: {session.said}.")
    print(_map(session.watcher))
    _finish(session.captured, other is None, session.calipers, built_from, of_pad)
    print(f"{counted(len(session.taken))} in {out}. Next: {command_line('label', out)}")


def _refuse_options(
    like: str | None, ball_radius_mm: float | None, caliper_mm: float | None, of_pad: str | None
) -> None:
    """Refuse lengths that nothing has, and options that say twice or not at all what is known."""
    for name, value in (("ball-radius-mm", ball_radius_mm), ("caliper-mm", caliper_mm)):
        if value is not None and not 0 < value < 1e3:
            raise WedgeError(f"--{name} {value:g} must be above 0 and below 1000.")
    if like is None and ball_radius_mm is None:
        raise WedgeError(
            "the ball's size is missing: give --ball-radius-mm, or name a dataset with --like."
        )
    if like is not None and caliper_mm is not None:
        raise WedgeError(
            f"--like reuses the scale of {like}, and --caliper-mm measures it again: leave one of "
            "them out."
        )
    if like is not None and of_pad is not None:
        raise WedgeError(f"--like reuses the pad's size of {like}: leave {of_pad} out.")


def _pictures(
    folder: str, first_blank: bool, caliper_mm: float | None
) -> "tuple[FrameSource, Set[str]]":
    """A folder's pictures, first one of the blank gel where that is wanted, then a caliper's.

    A dataset's frames stay in their order, in which its blank ones are first. Elsewhere the first
    picture shows the blank gel where no name says so, and a caliper's are left out where its gap
    is not given; both are told.

    Returns:
        the pictures, and which of them show a caliper by their names.

    Raises:
        WedgeError: there is none of a press, or a name says another gap than is given.
    """
    from recon.stream import FolderSource
    from validation.importers.raw_frames import only_caliper, told_by_name

    source = open_where(folder)
    if is_dataset(folder) or not isinstance(source, FolderSource):
        return source, frozenset()
    told = told_by_name(source.names)
    if not told.presses:
        raise WedgeError(f"{folder} holds no picture of a ball press{only_caliper(told)}.")
    presses = [name for name in source.names if name in told.presses]
    blank = list(told.background[:1] or presses[:1]) if first_blank else []
    if blank and not told.background:
        print(
            f"No picture is named as the blank gel (such as background.png): {blank[0]} is taken "
            "to show it.",
            file=sys.stderr,
        )
    for name, gap_mm in told.caliper:
        if caliper_mm is None:
            print(f"{name} is skipped: its name says that it shows a caliper", file=sys.stderr)
        elif gap_mm != caliper_mm:
            raise WedgeError(
                f"the name of {Path(folder) / name} gives a caliper gap of {gap_mm:g} mm, but "
                f"--caliper-mm is {caliper_mm:g}: correct the wrong one, or leave the picture out."
            )
    calipers = [] if caliper_mm is None else [name for name, _ in told.caliper]
    rest = [name for name in presses if name not in blank]
    return FolderSource(Path(folder), [*blank, *calipers, *rest]), frozenset(calipers)


def _followed(newest: "Newest", say: Callable[[str], None]) -> "Iterator[TimedFrame]":
    """The newest frame again and again; what happens to the stream is said once."""
    said = ""
    while True:
        timed = newest.take(timeout_s=REMARK_S)
        remark = newest.remark
        if remark and remark != said:
            say(remark)
        said = remark
        if timed is not None:
            yield timed
        elif newest.ended:
            return


@contextmanager
def _ending_early(taken: list[str]) -> Iterator[None]:
    """Let Ctrl-C end the capture as the last press does, where there is one."""
    try:
        yield
    except KeyboardInterrupt:
        if not taken:
            raise


def _dataset(like: str | None, ball_radius_mm: float | None) -> "Dataset | None":
    """The dataset of the same sensor, where one is named; it must say which ball is pressed."""
    from validation.datasets import dataset_folder

    if like is None:
        return None
    other = read_dataset(dataset_folder(like))
    if ball_radius_mm is None and len(other.ball_radii_mm) > 1:
        raise WedgeError(
            f"{like} has presses of balls of {' and '.join(f'{x:g}' for x in other.ball_radii_mm)} "
            "mm radius: give the one that is pressed now with --ball-radius-mm."
        )
    return other


def _finish(
    captured: "Captured",
    is_new: bool,
    calipers: list[tuple[str, float]],
    design: "Wedge | None",
    pad_by: str | None,
) -> None:
    """Find circles that wait, and of a sensor seen for the first time the lights and the scale."""
    try:
        captured.settle()
        scale = captured.measure(calipers, design) if is_new else None
        unknown = captured.without_circle()
    except KeyboardInterrupt:
        print(captured.kept, file=sys.stderr)
        raise
    if unknown:
        print(
            f"With the current corners, scale and ball, no ball was found in {', '.join(unknown)}."
        )
    if remark := lights_remark(captured.lights_deg, design):
        print(remark)
    card = captured.card
    if scale is not None:
        sigmas = zip("xy", scale.sigma_mm_per_px, scale.mm_per_px, strict=True)
        known = [f"{s / mm:.1%} along {axis}" for axis, s, mm in sigmas if axis != scale.unseen]
        print(
            f"Scale from {scale.gaps} pictures of the caliper, accurate to {' and '.join(known)}."
        )
        if remark := proportion_remark(scale.unseen):
            print(remark)
    elif is_new:
        print(assumed(card, pad_by))


def _map(watcher: "PressWatcher") -> str:
    """The pad with the presses of each cell, base on the left."""
    rows = [" ".join(f"{count:3d}" for count in row) for row in watcher.coverage.counts]
    return "\n".join(["Presses over the pad, base on the left:", *rows])
