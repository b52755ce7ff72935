# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The corners of a dataset's pad, mended by hand: every change is on disk at once."""

from collections.abc import Callable
from dataclasses import dataclass, replace

from recon.arrays import Frame
from recon.geometry.lens import Lens
from recon.geometry.pad import base_side, find_pad, gel_corners
from recon.geometry.unwarp import Corners, Unwarp, prepare_unwarp
from recon.labels.label_book import LabelBook, is_by_hand, places
from recon.lights import azimuth_deg
from sensor.dataset import (
    CARD_FILE,
    LABELS_FILE,
    BallLabel,
    Dataset,
    DatasetCard,
    corners,
    read_dataset,
    write_card,
    write_labels,
)
from sensor.errors import WedgeError
from sensor.files import alone_in
from sensor.toml import Pair

INSET = 0.1
"""Of the frame: where the corners begin when none are found."""


@dataclass(frozen=True)
class Move:
    """What one change replaced and what it left, and the circles that it dropped."""

    before: DatasetCard
    after: DatasetCard
    dropped: tuple[BallLabel, ...]


class CornerBook:
    """Corners in the gel frame's order; each change is written, and can be taken back.

    Several may be open on one folder, in several processes and in every tab of a page, and
    somebody may edit the card by hand: a change is of the corners alone, and of where the lights
    sit once the picture is turned or mirrored; what others wrote meanwhile stays. Corners that
    others changed are changed no further by who has not seen that, and ``undo`` takes back only
    what was done in books of the same history and still stands.

    Labels lie in pixels of the unwarped frame, which the corners decide. Those found automatically
    are dropped at the first change, before it is written, to be found again, and come back with
    their corners; labels that somebody has looked at, or given a ball of its own, are never
    touched: then the corners stay.
    """

    def __init__(
        self,
        dataset: Dataset,
        blank: Frame,
        lens: Lens | None = None,
        history: list[Move] | None = None,
    ) -> None:
        """Take over the corners of the card, or else those found in the blank frame.

        Args:
            dataset: the folder.
            blank: its raw frame of the untouched gel.
            lens: the camera's, where it is known.
            history: the moves that ``undo`` takes back, the latest last, where several books share
                them; by default the book's own.
        """
        self.folder, self.lens = dataset.folder, lens
        self.frame_size_px = (blank.shape[1], blank.shape[0])
        self.blank = blank
        self._history: list[Move] = [] if history is None else history
        self._take_over(dataset.card)

    def catch_up(self) -> Dataset:
        """Take over the card as it is on disk; the folder as it is now.

        Raises:
            WedgeError: the folder's card or labels cannot be read.
        """
        dataset = read_dataset(self.folder, labelled=False)
        self._take_over(dataset.card)
        return dataset

    def _take_over(self, card: DatasetCard) -> None:
        self._on_disk = card
        if card.corners_px is None:
            width, height = self.frame_size_px
            x, y = card.mm_per_px
            size = card.pad_size_mm or (width * x, height * y)
            card = replace(card, corners_px=self.found(), pad_size_mm=size)
        self.card = card

    @property
    def corners_px(self) -> Corners:
        """Top left, top right, bottom right, bottom left of the pad in the raw frame."""
        assert self.card.corners_px is not None
        return self.card.corners_px

    @property
    def unwarp(self) -> Unwarp:
        """The map that the corners make, through the lens where it is known."""
        size = self.card.unwarped_size_px
        return prepare_unwarp(self.frame_size_px, self.corners_px, size, self.lens)

    def found(self) -> Corners:
        """The corners as the blank frame shows them, else a frame within the frame."""
        clockwise = find_pad(self.blank)
        if clockwise is not None:
            return gel_corners(clockwise, base_side(clockwise))
        width, height = self.frame_size_px
        left, right = INSET * width, (1 - INSET) * width
        top, bottom = INSET * height, (1 - INSET) * height
        return (left, top), (right, top), (right, bottom), (left, bottom)

    def nearest(self, place: Pair) -> int:
        """Which corner lies nearest to a place in the raw frame."""
        away = [(x - place[0]) ** 2 + (y - place[1]) ** 2 for x, y in self.corners_px]
        return away.index(min(away))

    def moved(self, index: int, place: Pair) -> Corners:
        """The corners with one of them elsewhere, kept inside the frame."""
        width, height = self.frame_size_px
        inside = (
            round(min(max(place[0], -0.5), width - 0.5), 2),
            round(min(max(place[1], -0.5), height - 0.5), 2),
        )
        a, b, c, d = (inside if i == index else corner for i, corner in enumerate(self.corners_px))
        return a, b, c, d

    def put(
        self,
        changed: Corners,
        sits_deg: Callable[[float], float] = lambda angle: angle,
        *,
        held: bool = False,
    ) -> int:
        """Write other corners; how many circles were dropped, as they lie in pixels of the old.

        Args:
            changed: the corners.
            sits_deg: where a light sits then, by where it sat.
            held: whether ``undo`` takes it back with the change before it, as of a key still held.

        Raises:
            WedgeError: they are not a convex pad's, labels made by hand depend on the old ones,
                somebody else has moved the corners meanwhile, or the card cannot be written;
                nothing changed then.
        """
        corners([list(corner) for corner in changed])
        known_px = self._on_disk.corners_px
        with alone_in(self.folder):
            dataset = self.catch_up()
            before, lights = dataset.card, self.card.lights_deg
            sit = lights and {color: azimuth_deg(sits_deg(at)) for color, at in lights.items()}
            after = replace(self.card, corners_px=changed, lights_deg=sit)
            if before.corners_px != known_px:
                raise WedgeError(
                    f"the corners in {self.folder / CARD_FILE} were changed in another tab or "
                    "program meanwhile: check them as they are now."
                )
            if after == before:
                return 0
            self._write(dataset, after)
            dropped = dataset.labels
            if held and not dropped and self._history and self._history[-1].after == before:
                last = self._history.pop()
                before, dropped = last.before, last.dropped
            self._history.append(Move(before, after, dropped))
        return len(dataset.labels)

    def turn(self) -> int:
        """Let the next side of the picture be the base's."""
        a, b, c, d = self.corners_px
        return self.put((b, c, d, a), lambda angle: angle - 90)

    def mirror(self) -> int:
        """Turn the unwarped picture over, its left side staying left."""
        a, b, c, d = self.corners_px
        return self.put((d, c, b, a), lambda angle: -angle)

    def undo(self) -> bool:
        """Take the last change back; false where there is none.

        Raises:
            WedgeError: somebody else has moved the corners after that change, which then stays for
                good, the one before it being the next to take back; or as for ``put``.
        """
        if not self._history:
            return False
        last = self._history[-1]
        with alone_in(self.folder):
            dataset = self.catch_up()
            now, size_mm = dataset.card, dataset.card.pad_size_mm
            is_theirs = now.corners_px != last.after.corners_px
            if last.before.corners_px is None:  # then the size goes too
                is_theirs, size_mm = is_theirs or size_mm != last.after.pad_size_mm, None
            if is_theirs:
                self._history.pop()
                raise WedgeError(
                    f"the pad in {self.folder / CARD_FILE} was changed in another tab or program "
                    "after your change, which is not undone: it stays as it is now."
                )
            lights = now.lights_deg
            if lights == last.after.lights_deg:
                lights = last.before.lights_deg
            back = replace(
                now, corners_px=last.before.corners_px, pad_size_mm=size_mm, lights_deg=lights
            )
            book = LabelBook(replace(dataset, labels=()))
            circles = [x for x in last.dropped if not book.has_no_ball(x.file)]
            self._write(dataset, back)
            if circles and places(back) == places(last.before):
                write_labels(self.folder / LABELS_FILE, circles)
        self._history.pop()
        return True

    def _write(self, dataset: Dataset, card: DatasetCard) -> None:
        # As they are now: somebody may have looked at one in another page meanwhile.
        if any(is_by_hand(label) for label in dataset.labels):
            raise WedgeError(
                f"{self.folder / LABELS_FILE} holds circles that somebody drew or confirmed, in "
                "pixels of these corners, or ball radii that somebody wrote: move it elsewhere "
                "first, then correct the corners."
            )
        if dataset.labels:
            write_labels(self.folder / LABELS_FILE, [])
        try:
            write_card(self.folder / CARD_FILE, card)
        except BaseException:
            if dataset.labels:
                write_labels(self.folder / LABELS_FILE, dataset.labels)
            raise
        self._take_over(card)
