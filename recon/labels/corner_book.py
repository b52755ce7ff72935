# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The corners of a dataset's pad, mended by hand: every change is on disk at once."""

from dataclasses import replace

from recon.arrays import Frame
from recon.geometry.lens import Lens
from recon.geometry.pad import base_side, find_pad, gel_corners
from recon.geometry.unwarp import Corners, Unwarp, prepare_unwarp
from recon.labels.label_book import CERTAIN, LABELS_FILE
from sensor.dataset import (
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

CARD_FILE = "dataset.toml"
INSET = 0.1
"""Of the frame: where the corners begin when none are found."""


class CornerBook:
    """Corners in the gel frame's order; each change is written, and can be taken back.

    Labels lie in pixels of the unwarped frame, which the corners decide. Those found automatically
    are dropped at the first change, before it is written, to be found again; labels that somebody
    has looked at, or given a ball of its own, are never touched: then the corners stay.
    """

    def __init__(self, dataset: Dataset, blank: Frame, lens: Lens | None = None) -> None:
        """Take over the corners of the card, or else those found in the blank frame."""
        self.folder, self.card, self.lens = dataset.folder, dataset.card, lens
        self.frame_size_px = (blank.shape[1], blank.shape[0])
        self.blank = blank
        if self.card.corners_px is None:
            width, height = self.frame_size_px
            x, y = self.card.mm_per_px
            size = self.card.pad_size_mm or (width * x, height * y)
            self.card = replace(self.card, corners_px=self.found(), pad_size_mm=size)
        self._history: list[DatasetCard] = []
        self._written = self._on_disk()

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

    def put(self, changed: Corners) -> None:
        """Write other corners.

        Raises:
            WedgeError: they are not a convex pad's, labels made by hand depend on the old ones, or
                the card was changed meanwhile or cannot be written; nothing changed then.
        """
        corners([list(corner) for corner in changed])
        self._write(replace(self.card, corners_px=changed), remember=True)

    def turn(self) -> None:
        """Let the next side of the picture be the base's."""
        a, b, c, d = self.corners_px
        self.put((b, c, d, a))

    def mirror(self) -> None:
        """Turn the unwarped picture over, its left side staying left."""
        a, b, c, d = self.corners_px
        self.put((d, c, b, a))

    def undo(self) -> bool:
        """Take the last change back; false where there is none.

        Raises:
            WedgeError: as for ``put``.
        """
        if not self._history:
            return False
        self._write(self._history[-1], remember=False)
        self._history.pop()
        return True

    def _write(self, card: DatasetCard, *, remember: bool) -> None:
        with alone_in(self.folder):
            if self._on_disk() != self._written:
                raise WedgeError(
                    f"{self.folder} was changed by another program meanwhile: begin again."
                )
            # As they are now: somebody may have looked at one in another page meanwhile.
            labels = read_dataset(self.folder, labelled=False).labels
            if any(_is_by_hand(label) for label in labels):
                raise WedgeError(
                    f"{self.folder / LABELS_FILE} holds circles that somebody drew or looked at, "
                    "in pixels of these corners, or balls of their own: move it elsewhere first, "
                    "then mend the corners."
                )
            if labels:
                write_labels(self.folder / LABELS_FILE, [])
            write_card(self.folder / CARD_FILE, card)
            if remember:
                self._history.append(self.card)
            self.card, self._written = card, self._on_disk()

    def _on_disk(self) -> bytes:
        return (self.folder / CARD_FILE).read_bytes()


def _is_by_hand(label: BallLabel) -> bool:
    """Whether somebody drew its circle, looked at it, or wrote down its ball."""
    looked_at = label.quality is None or label.quality >= CERTAIN
    return looked_at or label.ball_radius_mm is not None
