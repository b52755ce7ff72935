# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Labels of ball presses: found automatically, mended by hand, every change kept at once."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from recon.find_circle import find_circle
from recon.images import frame_count, read_frame
from recon.presses import PressReader
from sensor.dataset import BallLabel, Dataset, DatasetCard, write_labels
from sensor.errors import WedgeError
from sensor.files import write_atomic

IMAGES = (".png", ".jpg", ".jpeg")
LABELS_FILE = "labels.csv"
NO_BALL_FILE = "no_ball.txt"
"""The frames in which somebody saw that no ball touches, one a line."""
CERTAIN = 1.0
"""Quality of a label that somebody looked at."""
DOUBTFUL = 0.7
"""Below this quality somebody should look."""


def pressed_frames(folder: Path, card: DatasetCard) -> list[str]:
    """Names of the frames that may show a press: images beside the card, and ``frames.npz#i``.

    Raises:
        WedgeError: ``frames.npz`` is damaged.
    """
    names = sorted(
        path.name
        for path in folder.iterdir()
        if path.suffix.lower() in IMAGES and path.name not in card.background
    )
    archive = folder / "frames.npz"
    if archive.is_file():
        names += [f"{archive.name}#{i}" for i in range(frame_count(archive))]
        names = [name for name in names if name not in card.background]
    return names


def automatic_label(reader: PressReader, file: str) -> BallLabel | None:
    """The label of one frame as found, ``None`` where no ball shows.

    Raises:
        WedgeError: the frame is missing, damaged or of another size.
    """
    card = reader.dataset.card
    frame = read_frame(reader.dataset.folder, file)
    try:
        difference = reader.unwarp(frame) - reader.blank
    except WedgeError as error:
        raise WedgeError(
            f"{reader.dataset.folder / file}: {error} Is it another camera's? Take it out."
        ) from error
    circle = find_circle(difference, card.ball_radius_mm, card.mm_per_px)
    if circle is None:
        return None
    height, width = difference.shape[:2]
    x_px = min(max(circle.center_px[0], 0.0), width - 1.0)
    y_px = min(max(circle.center_px[1], 0.0), height - 1.0)
    return BallLabel(
        file=file,
        center_x_px=round(x_px, 2),
        center_y_px=round(y_px, 2),
        contact_radius_px=round(circle.radius_px, 2),
        quality=round(circle.quality, 3),
    )


@dataclass(frozen=True)
class Change:
    """What one edit replaced."""

    file: str
    before: BallLabel | None
    had_no_ball: bool


class LabelBook:
    """The labels of one dataset folder, written after every change; edits can be undone.

    That no ball touches in a frame is written too, lest a circle is found there again. A frame
    with a label has a ball, whatever else is written.
    """

    def __init__(self, dataset: Dataset) -> None:
        """Take over the labels as they are on disk.

        Raises:
            WedgeError: ``no_ball.txt`` cannot be read.
        """
        self.folder = dataset.folder
        self._labels = {label.file: label for label in dataset.labels}
        self._no_ball = _read_no_ball(dataset.folder / NO_BALL_FILE).difference(self._labels)
        self._history: list[Change] = []
        self._written = self._on_disk()

    @property
    def labels(self) -> tuple[BallLabel, ...]:
        """All labels, in the order of their frames' names."""
        return tuple(self._labels[file] for file in sorted(self._labels, key=_by_number))

    def label(self, file: str) -> BallLabel | None:
        """The label of a frame, ``None`` where it has none."""
        return self._labels.get(file)

    def has_no_ball(self, file: str) -> bool:
        """Whether somebody saw that no ball touches in a frame."""
        return file in self._no_ball

    def put(self, label: BallLabel) -> None:
        """Add or replace the label of a frame.

        Raises:
            WedgeError: the file was changed meanwhile, or cannot be written; nothing changed then.
        """
        self._apply(label.file, label, no_ball=False, remember=True)

    def remove(self, file: str) -> None:
        """Take a frame's label away and keep in mind that no ball touches there.

        Raises:
            WedgeError: the file was changed meanwhile, or cannot be written; nothing changed then.
        """
        self._apply(file, None, no_ball=True, remember=True)

    def undo(self) -> str | None:
        """Take the last edit back; the frame it was made on, ``None`` where there is none left.

        Raises:
            WedgeError: the file was changed meanwhile, or cannot be written; nothing changed then.
        """
        if not self._history:
            return None
        last = self._history[-1]
        self._apply(last.file, last.before, no_ball=last.had_no_ball, remember=False)
        self._history.pop()
        return last.file

    def _apply(self, file: str, label: BallLabel | None, *, no_ball: bool, remember: bool) -> None:
        path = self.folder / LABELS_FILE
        if self._on_disk() != self._written:
            raise WedgeError(
                f"{path} or {NO_BALL_FILE} was changed by another program meanwhile: start "
                "`wedge label` again."
            )
        change = Change(file, self._labels.get(file), file in self._no_ball)
        untouched = self._no_ball | {file} if no_ball else self._no_ball - {file}
        after = {key: value for key, value in self._labels.items() if key != file}
        if label is not None:
            after[file] = label
        self._write_no_ball(self._no_ball, untouched)
        try:
            write_labels(path, [after[key] for key in sorted(after, key=_by_number)])
        except BaseException:
            self._write_no_ball(untouched, self._no_ball)
            raise
        self._labels, self._no_ball = after, untouched
        self._written = self._on_disk()
        if remember:
            self._history.append(change)

    def _write_no_ball(self, before: frozenset[str], after: frozenset[str]) -> None:
        if after != before:
            lines = [f"{file}\n" for file in sorted(after, key=_by_number)]
            write_atomic(self.folder / NO_BALL_FILE, "".join(lines).encode())

    def _on_disk(self) -> list[bytes]:
        paths = [self.folder / name for name in (LABELS_FILE, NO_BALL_FILE)]
        return [path.read_bytes() if path.is_file() else b"" for path in paths]


def doubtful_first(files: Sequence[str], book: LabelBook) -> list[str]:
    """Frames in the order in which they deserve a look.

    Found circles by their quality, worst first; then frames in which no ball was found; then what
    somebody has looked at already.
    """

    def doubt(file: str) -> tuple[int, float, tuple[str, int]]:
        label = book.label(file)
        if label is None:
            seen = book.has_no_ball(file)
            return (2 if seen else 1), (CERTAIN if seen else 0.0), _by_number(file)
        quality = CERTAIN if label.quality is None else label.quality
        return (2 if quality >= CERTAIN else 0), quality, _by_number(file)

    return sorted(files, key=doubt)


def _read_no_ball(path: Path) -> frozenset[str]:
    """The frames that a file names, one a line; none where there is no file."""
    try:
        lines: Iterable[str] = path.read_text(encoding="utf-8").splitlines()
    except FileNotFoundError:
        lines = ()
    except (OSError, UnicodeDecodeError) as error:
        raise WedgeError(f"{path} cannot be read ({error}): mend it or take it away.") from error
    return frozenset(line for line in lines if line)


def _by_number(file: str) -> tuple[str, int]:
    """Sorts press2 before press10."""
    stem = file.rsplit(".", 1)[0] if "#" not in file else file
    digits = len(stem) - len(stem.rstrip("0123456789"))
    number = stem[len(stem) - digits :] if digits else ""
    return stem[: len(stem) - digits], int(number[:18] or -1)
