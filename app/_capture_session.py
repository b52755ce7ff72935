# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What `wedge capture` makes of the frames that it is given, one after the other."""

import sys
from collections.abc import Set
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app._captured import CALIPER_FOLDER, Captured
from sensor.errors import WedgeError

if TYPE_CHECKING:
    from recon.arrays import Frame
    from recon.labels.capture import PressWatcher, Verdict
    from recon.stream import TimedFrame
    from sensor.dataset import Dataset, DatasetCard
    from sensor.toml import Pair

CALIPERS = 2
"""Pictures of the caliper: one along the finger, one across."""


class CaptureSession:
    """A capture on its way: the blank gel first, then a caliper where one is used, then presses.

    Args:
        out: the dataset folder to fill.
        presses: how many are wanted.
        other: a dataset of the same sensor, where there is one.
        ball_radius_mm: of the ball; the other dataset's where it is ``None``.
        pad_size_mm: of a sensor seen for the first time.
        pad_by: the option that gave it; ``None`` where none did.
        caliper_mm: gap of the caliper's jaws, where it is used.
        background: a picture of the blank gel; else the first frame shows it.
    """

    def __init__(
        self,
        out: Path,
        *,
        presses: int,
        other: "Dataset | None",
        ball_radius_mm: float | None,
        pad_size_mm: "Pair",
        pad_by: str | None,
        caliper_mm: float | None,
        background: Path | None,
    ) -> None:
        self.out, self.presses, self.other = out, presses, other
        self.ball_radius_mm, self.pad_size_mm = ball_radius_mm, pad_size_mm
        self.pad_by = pad_by
        self.caliper_mm, self.background = caliper_mm, background
        self.watcher: PressWatcher | None = None
        """From the blank frame on."""
        self.captured: Captured | None = None
        """From the first press on."""
        self.taken: list[str] = []
        """Names of the presses."""
        self.calipers: list[tuple[str, float]] = []
        """Pictures of the caliper, each with its gap."""
        self.said = "it gave no frame"
        """Last."""

    def look(self, timed: "TimedFrame") -> None:
        """Judge a frame of a sensor, which is taken once the gel holds still.

        Raises:
            WedgeError: the blank frame cannot be used, or what was taken cannot be kept.
        """
        named = f"frame {timed.index}"
        frame = self._image(timed, named)
        if frame is None:
            return
        watcher = self._watched(frame, alone=False, calipers=CALIPERS)
        verdict = watcher.look(frame)
        self.say(verdict.words + self._keep(frame, verdict))

    def look_at_picture(self, timed: "TimedFrame", *, of_caliper: Set[str]) -> None:
        """Judge a picture of a folder, without waiting for stillness.

        Args:
            timed: the picture.
            of_caliper: names of those that show a caliper; they come first.

        Raises:
            WedgeError: as for ``look``.
        """
        frame = self._image(timed, timed.file)
        if frame is None:
            return
        watcher = self._watched(frame, alone=True, calipers=len(of_caliper) or CALIPERS)
        if of_caliper and self.calipers and timed.file not in of_caliper:
            watcher.calipers_left = 0  # theirs came first: what was refused is over
        verdict = watcher.judge_alone(frame)
        self.say(f"{timed.file}: {verdict.words}{self._keep(frame, verdict)}")

    def say(self, words: str) -> None:
        """A line on stderr for each thing that changes, with how far the capture is."""
        if words != self.said:
            pad = ""
            if self.watcher is not None:
                coverage = self.watcher.coverage
                pad = f"pad {coverage.share:4.0%} {coverage}"
            count = f"{len(self.taken):3d}/{self.presses}"
            print(f"{count}  {pad}  {words}", file=sys.stderr, flush=True)
        self.said = words

    def _image(self, timed: "TimedFrame", named: str) -> "Frame | None":
        """The picture; none where it is passed over."""
        try:
            frame = timed.image()
            if self.watcher is not None:
                self.watcher.unwarp.check_colored(frame)
        except WedgeError as error:
            if self.watcher is None and self.background is None:  # the blank one
                raise
            self.say(f"{named} is skipped: {error}")
            return None
        return frame

    def _watched(self, frame: "Frame", *, alone: bool, calipers: int) -> "PressWatcher":
        """Who judges the frame, by the dataset's card as it is now."""
        from recon.images import read_image

        if self.watcher is None:
            blank = frame if self.background is None else read_image(self.background)
            if blank.shape != frame.shape:
                (height, width), (frame_height, frame_width) = blank.shape[:2], frame.shape[:2]
                raise WedgeError(
                    f"{self.background}, the background, is {width}x{height} pixels and the first "
                    f"frame {frame_width}x{frame_height}: give a picture from the same camera."
                )
            self.card = _card(self.other, self.out, blank, self.ball_radius_mm, self.pad_size_mm)
            if self.other is None:
                words = assumed(self.card, self.pad_by, by_caliper=self.caliper_mm is not None)
                print(words, file=sys.stderr, flush=True)
            first = 0 if self.caliper_mm is None else calipers
            self.watcher = _watcher(self.other, self.card, blank, first)
            if self.background is not None or alone:
                self.watcher.set_background(blank)
        if self.captured is not None and (changed := self.captured.follow()):
            self.say(changed)
        return self.watcher

    def _keep(self, frame: "Frame", verdict: "Verdict") -> str:
        """Write what was taken; what else is to be said of it."""
        from recon.images import write_image

        if verdict.circle is not None:
            if self.captured is None:
                assert self.watcher is not None
                self.captured = Captured(self.out, self.other, self.card, self.watcher, self.taken)
            return self.captured.keep(frame, verdict.circle)
        if verdict.taken and self.caliper_mm is not None:
            name = f"{self.caliper_mm:g}mm-{len(self.calipers) + 1}.png"
            write_image(self.out / CALIPER_FOLDER / name, frame)
            self.calipers.append((name, self.caliper_mm))
        return ""


def _card(
    other: "Dataset | None", out: Path, blank: Any, ball_radius_mm: float | None, pad_mm: "Pair"
) -> "DatasetCard":
    """The other dataset's card under a new name, or one made from the blank frame."""
    from validation.importers.raw_frames import CAPTURED, OWN, first_card

    name, background = out.resolve().name, ("background.png",)
    if other is None:
        assert ball_radius_mm is not None
        return first_card(blank, name, background, ball_radius_mm, pad_mm)
    return replace(
        other.card,
        name=name,
        source=CAPTURED,
        licence=OWN,
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
                f"{other_width}x{other_height}: use the same camera at the same resolution."
            )
        unwarp = dataset_unwarp(other, blank, read_dataset_lens(other))
    lights_deg = None if other is None else card.lights_deg
    return PressWatcher(unwarp, card.ball_radius_mm, card.mm_per_px, calipers, lights_deg)


def assumed(card: "DatasetCard", pad_by: str | None, *, by_caliper: bool = False) -> str:
    """What a sensor seen for the first time is taken to measure, as long as nothing tells.

    Args:
        card: of the sensor.
        pad_by: the option that gave the pad's size; ``None`` where none did.
        by_caliper: whether pictures of a caliper will tell.
    """
    otherwise = "set it with --design or --pad-size-mm, or measure it with --caliper-mm."
    if pad_by is not None:
        otherwise = f"as {pad_by} says; --caliper-mm would measure it."
    if by_caliper:
        otherwise = "the caliper's pictures will measure it."
    if card.pad_size_mm is not None:
        length, width = card.pad_size_mm
        return f"The pad is taken to be {length:g} x {width:g} mm: {otherwise}"
    return (
        "No corners of a pad were found in the first frame: it is taken to be as long as the "
        f"pad, so the scale is {card.mm_per_px[0]:.5f} mm/px: {otherwise}"
    )
