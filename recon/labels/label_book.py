# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Labels of ball presses: found automatically, mended by hand, every change kept at once."""

import math
import unicodedata
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from recon.images import frame_count
from recon.picture_names import in_order, picture_names
from sensor.dataset import (
    CARD_FILE,
    LABELS_FILE,
    BallLabel,
    Dataset,
    DatasetCard,
    frame_name,
    read_dataset,
    write_labels,
)
from sensor.errors import WedgeError
from sensor.files import alone_in, write_atomic

NO_BALL_FILE = "no_ball.txt"
"""The frames in which somebody saw that no ball touches, one a line."""
CERTAIN = 1.0
"""Quality of a label that somebody looked at."""
LARGEST = 0.98
"""Of the ball's radius: a contact circle is smaller than its ball."""
Standing = tuple[BallLabel | None, bool]
"""What is known of a frame: its label, and whether somebody saw that no ball touches."""


class CardMovedError(WedgeError):
    """``dataset.toml`` has other corners, scale or ball than when a book of labels was opened."""


def places(card: DatasetCard) -> tuple[object, ...]:
    """What of a card decides where circles lie and how large they may be."""
    return card.corners_px, card.pad_size_mm, card.mm_per_px, card.ball_radius_mm


def is_looked_at(label: BallLabel) -> bool:
    """Whether somebody drew its circle or looked at it."""
    return label.quality is None or label.quality >= CERTAIN


def is_by_hand(label: BallLabel) -> bool:
    """The same, or somebody wrote down its ball."""
    return is_looked_at(label) or label.ball_radius_mm is not None


def pressed_frames(folder: Path, card: DatasetCard) -> list[str]:
    """Names of the frames that may show a press: images beside the card, and ``frames.npz#i``.

    Raises:
        WedgeError: ``frames.npz`` is damaged, or ``labels.csv`` cannot keep an image's name.
    """
    blank = {frame_name(name) for name in card.background}
    names = [name for name in picture_names(folder) if name not in blank]
    for name in names:
        refuse_name(folder / name)
    archive = folder / "frames.npz"
    if archive.is_file():
        names += [f"{archive.name}#{i}" for i in range(frame_count(archive))]
    return [name for name in names if name not in blank]


def refuse_name(path: Path) -> None:
    """Refuse an image whose name would not come back from a table, or means a frame inside.

    Raises:
        WedgeError: says what a name cannot hold.
    """
    name = path.name
    odd = any(unicodedata.category(character) in ("Cc", "Cs") for character in name)
    if odd or "#" in name or name != name.strip():
        raise WedgeError(
            f"{path.parent}: {LABELS_FILE} cannot keep the name {name!r}, with a space at an end, "
            "a #, a line break or an invalid character in it: rename the file."
        )


def within_balls(dataset: Dataset) -> Dataset:
    """A dataset less the found circles that its balls, mended since, no longer hold.

    Raises:
        WedgeError: a circle by hand is not smaller than its ball.
    """
    kept = [x for x in dataset.labels if is_by_hand(x) or dataset.is_within_ball(x)]
    dataset = replace(dataset, labels=tuple(kept))
    dataset.refuse_wide_circles()
    return dataset


def drop_wide_circles(folder: Path) -> None:
    """Take out of ``labels.csv`` the found circles that the balls no longer hold.

    Raises:
        WedgeError: a circle by hand is not smaller than its ball, or a file cannot be read or
            written.
    """
    with alone_in(folder):
        now = read_dataset(folder, labelled=False, within_balls=False)
        kept = within_balls(now)
        if kept.labels != now.labels:
            write_labels(folder / LABELS_FILE, kept.labels)


def largest_radius_px(dataset: Dataset, label: BallLabel | None) -> float:
    """How large a press's contact circle may be: its ball is larger."""
    ball_mm = dataset.ball_radius_mm(label)
    return LARGEST * ball_mm / math.sqrt(math.prod(dataset.card.mm_per_px))


@dataclass(frozen=True)
class Change:
    """What one edit replaced, and what it left."""

    file: str
    before: Standing
    after: Standing


class LabelBook:
    """The labels of one dataset folder, written after every change; edits by hand can be undone.

    That no ball touches in a frame is written too, lest a circle is found there again. A frame
    with a label has a ball, whatever else is written.

    Several may be open on one folder, in several processes and in every tab of a page: a change is
    of its frame alone, and what others wrote meanwhile is taken over before it. A frame that others
    changed is changed no further by who has not seen that, and ``undo`` takes back only what was
    done in books of the same history and still stands.
    """

    def __init__(self, dataset: Dataset, history: list[Change] | None = None) -> None:
        """Take over the labels of a dataset.

        Args:
            dataset: the folder.
            history: the edits that ``undo`` takes back, the latest last, where several books share
                them; by default the book's own.

        Raises:
            WedgeError: ``no_ball.txt`` cannot be read.
        """
        self.folder, self._card = dataset.folder, dataset.card
        self._labels, self._no_ball = _known(dataset)
        self._history: list[Change] = [] if history is None else history
        self._changed_by_others: set[str] = set()
        self._news: set[str] = set()

    @property
    def labels(self) -> tuple[BallLabel, ...]:
        """All labels, in the order of their frames' names."""
        return _in_order(self._labels)

    def label(self, file: str) -> BallLabel | None:
        """The label of a frame, ``None`` where it has none."""
        return self._labels.get(frame_name(file))

    @property
    def looked_at(self) -> int:
        """How many frames somebody has looked at: a circle is certain, or no ball touches."""
        certain = [x for x in self._labels.values() if (x.quality or 0) >= CERTAIN]
        return len(certain) + len(self._no_ball)

    def has_no_ball(self, file: str) -> bool:
        """Whether somebody saw that no ball touches in a frame."""
        return frame_name(file) in self._no_ball

    def standing(self, file: str) -> Standing:
        """All that is known of a frame."""
        return self.label(file), self.has_no_ball(file)

    @property
    def last_edited(self) -> str | None:
        """The frame of the edit that ``undo`` would take back, ``None`` where there is none."""
        return self._history[-1].file if self._history else None

    def catch_up(self) -> set[str]:
        """Take over what is on disk; the frames of which it says something else than was known.

        Raises:
            CardMovedError: the card now says that circles lie elsewhere.
            WedgeError: a file cannot be read.
        """
        dataset = read_dataset(self.folder, labelled=False)
        if places(dataset.card) != places(self._card):
            raise CardMovedError(
                f"{self.folder / CARD_FILE} was changed by another program meanwhile, "
                "which moves the circles: start this command again."
            )
        labels, no_ball = _known(dataset)
        changed = {
            name
            for name in {*labels, *self._labels, *no_ball, *self._no_ball}
            if labels.get(name) != self._labels.get(name)
            or (name in no_ball) != (name in self._no_ball)
        }
        self._labels, self._no_ball = labels, no_ball
        self._changed_by_others |= changed
        self._news |= changed
        return changed

    def news(self) -> set[str]:
        """The frames that others have changed, of what was taken over since this was last asked."""
        news, self._news = self._news, set()
        return news

    def put(self, label: BallLabel, *, held: bool = False) -> None:
        """Add or replace the label of a frame.

        Args:
            label: the new one.
            held: whether ``undo`` takes it back with the change before it, as of a key still held.

        Raises:
            WedgeError: somebody else has changed the frame's label or the card meanwhile, or a file
                cannot be read or written; nothing changed then.
        """
        self._edit(label.file, (label, False), held)

    def put_found(self, labels: Sequence[BallLabel]) -> None:
        """Add or replace labels that were found, in one write, which ``undo`` does not take back.

        Frames that somebody else has changed since the book was opened stay as they are.

        Raises:
            WedgeError: somebody else has changed the card meanwhile, or a file cannot be read or
                written; nothing changed then.
        """
        with alone_in(self.folder):
            self.catch_up()
            found = {
                name: label
                for label in labels
                if (name := frame_name(label.file)) not in self._changed_by_others
            }
            self._write(self._labels | found, self._no_ball.difference(found))

    def remove(self, file: str) -> None:
        """Take a frame's label away and keep in mind that no ball touches there.

        Raises:
            WedgeError: as for ``put``.
        """
        self._edit(file, (None, True))

    def undo(self) -> str | None:
        """Take the last edit back; the frame it was made on, ``None`` where there is none left.

        Raises:
            WedgeError: somebody else has changed the frame after that edit, which then stays for
                good, the one before it being the next to take back; or as for ``put``.
        """
        if not self._history:
            return None
        last = self._history[-1]
        with alone_in(self.folder):
            self.catch_up()
            if self.standing(last.file) != last.after:
                self._history.pop()
                raise WedgeError(
                    f"{last.file} was changed in another tab or program after your change, which "
                    "is not undone: it stays as it is now."
                )
            self._replace(last.file, last.before)
        self._history.pop()
        return last.file

    def _edit(self, file: str, after: Standing, held: bool = False) -> None:
        before = self.standing(file)
        with alone_in(self.folder):
            if frame_name(file) in self.catch_up():
                raise WedgeError(
                    f"{file} was changed in another tab or program meanwhile: check it as it is "
                    "now."
                )
            if after == before:
                return
            self._replace(file, after)
        if held and self._history and self._history[-1].after == before:
            before = self._history.pop().before
        self._history.append(Change(frame_name(file), before, after))

    def _replace(self, file: str, after: Standing) -> None:
        name, (label, has_no_ball) = frame_name(file), after
        labels = {key: value for key, value in self._labels.items() if key != name}
        if label is not None:
            labels[name] = label
        self._write(labels, self._no_ball | {name} if has_no_ball else self._no_ball - {name})

    def _write(self, after: Mapping[str, BallLabel], untouched: frozenset[str]) -> None:
        self._write_no_ball(self._no_ball, untouched)
        try:
            write_labels(self.folder / LABELS_FILE, _in_order(after))
        except BaseException:
            self._write_no_ball(untouched, self._no_ball)
            raise
        self._labels, self._no_ball = dict(after), untouched

    def _write_no_ball(self, before: frozenset[str], after: frozenset[str]) -> None:
        if after != before:
            lines = [f"{file}\n" for file in sorted(after, key=in_order)]
            write_atomic(self.folder / NO_BALL_FILE, "".join(lines).encode())


def doubtful_first(files: Sequence[str], book: LabelBook) -> list[str]:
    """Frames in the order in which they deserve a look.

    Found circles by their quality, worst first; then frames in which no ball was found; then what
    somebody has looked at already.
    """

    def doubt(file: str) -> tuple[int, float]:
        label = book.label(file)
        if label is None:
            seen = book.has_no_ball(file)
            return (2 if seen else 1), (CERTAIN if seen else 0.0)
        quality = CERTAIN if label.quality is None else label.quality
        return (2 if quality >= CERTAIN else 0), quality

    return sorted(files, key=lambda file: (*doubt(file), in_order(file)))


def _known(dataset: Dataset) -> tuple[dict[str, BallLabel], frozenset[str]]:
    """By frames' names, the labels of a dataset, and the frames without one that no ball touches.

    Raises:
        WedgeError: ``no_ball.txt`` cannot be read.
    """
    labels = {frame_name(label.file): label for label in dataset.labels}
    return labels, _read_no_ball(dataset.folder / NO_BALL_FILE).difference(labels)


def _read_no_ball(path: Path) -> frozenset[str]:
    """The frames that a file names, one a line; none where there is no file."""
    try:
        lines: Iterable[str] = path.read_text(encoding="utf-8-sig").split("\n")
    except FileNotFoundError:
        lines = ()
    except (OSError, UnicodeDecodeError) as error:
        raise WedgeError(f"{path} cannot be read ({error}): correct it or remove it.") from error
    return frozenset(frame_name(line.strip()) for line in lines if line.strip())


def _in_order(labels: Mapping[str, BallLabel]) -> tuple[BallLabel, ...]:
    """By the names of their frames."""
    return tuple(labels[name] for name in sorted(labels, key=in_order))
