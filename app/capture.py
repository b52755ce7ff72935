# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge capture`: from a stream to a dataset folder of labelled ball presses."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from sensor.errors import WedgeError

if TYPE_CHECKING:
    from recon.capture import PressWatcher
    from recon.circles import Circle
    from sensor.dataset import BallLabel, DatasetCard

Where = Annotated[tyro.conf.Positional[str], tyro.conf.arg(metavar="WHERE")]


def main(
    where: Where,
    out: Path,
    like: str,
    presses: int = 40,
    ball_radius_mm: float | None = None,
    background: Path | None = None,
) -> None:
    """Take ball presses from a sensor and write them as a dataset folder.

    Leave the gel alone first: a few still frames become the background. Then press the ball all
    over the pad. Each press is taken once it holds still, and refused with a reason where it is
    blurred, saturated, or no ball; a map shows where presses are missing. Every press is on disk
    with its circle as soon as it is taken; Ctrl-C ends early and loses nothing. Frames of a folder
    are judged one by one, without waiting for stillness.

    Example: wedge capture http://10.55.0.1:8080 --like presses/last-week --out presses/today

    Args:
        where: http://HOST:PORT/PATH, usb:0, a video, a folder, or an MCAP file.
        out: The dataset folder to write; it must not exist, or be empty.
        like: A dataset of the same sensor: its corners, scale and ball are taken over.
        presses: How many to take.
        ball_radius_mm: Radius of the ball, where it is not that of the other dataset.
        background: A picture of the blank gel, where the stream shows none.
    """
    from app._sources import open_live, open_where
    from recon.capture import PressWatcher
    from recon.images import read_image
    from recon.stream import Newest
    from sensor.dataset import read_dataset
    from sensor.files import refuse_kept_folder
    from validation.datasets import dataset_folder

    if presses < 1:
        raise WedgeError(f"--presses {presses} must be at least 1.")
    if ball_radius_mm is not None and not 0 < ball_radius_mm < 1e3:
        raise WedgeError(f"--ball-radius-mm {ball_radius_mm:g} must be above zero.")
    refuse_kept_folder(out)
    other = read_dataset(dataset_folder(like))
    card = _card(other.card, out, where, ball_radius_mm)
    alone = Path(where).is_dir()
    # Of a sensor the newest frame, as judging one takes longer than the next needs to come.
    with open_where(where) if alone else Newest(open_live(where)) as source:
        watcher: PressWatcher | None = None
        taken: list[BallLabel] = []
        shown = _Shown(presses)
        for timed in source:
            frame = timed.image()
            if watcher is None:
                watcher = PressWatcher(_unwarp(other, frame), card.ball_radius_mm, card.mm_per_px)
                if background is not None or alone:
                    # A folder's first frame is its blank one, unless a picture of it was given.
                    blank = frame if background is None else read_image(background)
                    watcher.set_background(blank)
            verdict = watcher.judge_alone(frame) if alone else watcher.look(frame)
            if verdict.circle is not None:
                taken.append(_keep(out, card, watcher, frame, verdict.circle, taken))
            shown(verdict.words, len(taken), watcher)
            if len(taken) == presses:
                break
    if not taken or watcher is None:
        raise WedgeError(f"no press was taken from {where}: {shown.last}.")
    print(_map(watcher))
    print(f"{len(taken)} presses in {out}. Next: wedge label {out}")


def _card(
    like: "DatasetCard", out: Path, where: str, ball_radius_mm: float | None
) -> "DatasetCard":
    from dataclasses import replace

    return replace(
        like,
        name=out.resolve().name,
        source="captured from a sensor",
        licence="your own",
        background=("background.png",),
        ball_radius_mm=like.ball_radius_mm if ball_radius_mm is None else ball_radius_mm,
    )


def _unwarp(other: Any, frame: Any) -> Any:
    from recon.presses import dataset_unwarp, read_dataset_lens

    return dataset_unwarp(other, frame, read_dataset_lens(other))


def _keep(
    out: Path,
    card: "DatasetCard",
    watcher: "PressWatcher",
    frame: Any,
    circle: "Circle",
    taken: list["BallLabel"],
) -> "BallLabel":
    """Write one press: the frame first, then the labels that name it."""
    from recon.images import write_image
    from sensor.dataset import BallLabel, write_card, write_labels

    if not taken:
        assert watcher.background is not None
        write_image(out / "background.png", watcher.background)
        write_card(out / "dataset.toml", card)
    name = f"press-{len(taken) + 1:03d}.png"
    width, height = watcher.unwarp.size_px
    label = BallLabel(
        file=name,
        center_x_px=round(min(max(circle.center_px[0], 0.0), width - 1.0), 2),
        center_y_px=round(min(max(circle.center_px[1], 0.0), height - 1.0), 2),
        contact_radius_px=round(circle.radius_px, 2),
        quality=round(circle.quality, 3),
    )
    write_image(out / name, frame)
    write_labels(out / "labels.csv", [*taken, label])
    return label


class _Shown:
    """One line on stderr for each thing that changes, with how far the capture is."""

    def __init__(self, presses: int) -> None:
        self.presses = presses
        self.last = "it gave no frame"

    def __call__(self, words: str, taken: int, watcher: "PressWatcher") -> None:
        import sys

        if words != self.last:
            share = watcher.coverage.share
            line = f"{taken:3d}/{self.presses}  pad {share:4.0%}  {words}"
            print(line, file=sys.stderr, flush=True)
        self.last = words


def _map(watcher: "PressWatcher") -> str:
    """The pad with the presses of each cell, base on the left."""
    rows = [" ".join(f"{count:3d}" for count in row) for row in watcher.coverage.counts]
    return "\n".join(["Presses over the pad, base on the left:", *rows])
