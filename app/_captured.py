# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The dataset folder that `wedge capture` fills, and that others may mend meanwhile."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app._lights import with_designed_lights
from app._output import command_line
from app._progress import progress
from app._workers import process_pool
from sensor.dataset import (
    CARD_FILE,
    LABELS_FILE,
    LENS_FILE,
    Dataset,
    DatasetCard,
    frame_name,
    read_dataset,
    write_card,
    write_labels,
)
from sensor.errors import WedgeError
from sensor.files import alone_in
from sensor.toml import located

if TYPE_CHECKING:
    from recon.geometry.caliper import Scale
    from recon.geometry.unwarp import Unwarp
    from recon.labels.capture import PressWatcher
    from recon.labels.circles import Circle
    from recon.presses import PressReader
    from sensor.design import Wedge

CALIPER_FOLDER = "caliper"


class Captured:
    """Presses on disk, each with its circle as soon as it is taken.

    Where somebody moves the corners meanwhile, or mends the scale or the ball, presses are judged
    by those from then on. Circles found before lie in other pixels or are another ball's: they are
    dropped, as on the page of the corners, and found anew at the end. Circles that somebody drew in
    other pixels are neither dropped nor left beside those of the new ones: the capture then ends.
    """

    def __init__(
        self,
        out: Path,
        other: "Dataset | None",
        card: "DatasetCard",
        watcher: "PressWatcher",
        taken: list[str],
    ) -> None:
        """Write all but the presses, and the names of those into ``taken`` as they come."""
        from recon.geometry.lens import write_lens
        from recon.images import write_image
        from recon.labels.label_book import LabelBook
        from recon.presses import read_dataset_lens

        self.out, self.card, self.watcher, self.taken = out, card, watcher, taken
        self.lights_deg: Mapping[str, float] | None = None
        """As presses show them, once measured."""
        self._waiting: set[str] = set()
        """Presses whose circles are to be found at the end."""
        self._circles: dict[str, Circle] = {}
        """As found, by press."""
        lens = None if other is None else read_dataset_lens(other)
        if lens is not None:  # circles lie in pixels that it was taken out of
            write_lens(out / LENS_FILE, lens)
        assert watcher.background is not None
        write_image(out / "background.png", watcher.background)
        write_card(out / CARD_FILE, card)
        self._stamp, self._trouble = _stamp(out / CARD_FILE), ""
        self._book = LabelBook(read_dataset(out, labelled=False))

    @property
    def kept(self) -> str:
        """A sentence for whoever ends before all is done."""
        return (
            f"The presses are kept in {self.out}, at the scale stated in its {CARD_FILE}: "
            f"{command_line('label', self.out)} finds the missing circles."
        )

    def keep(self, frame: Any, circle: "Circle") -> str:
        """Write one press: the frame first, then its circle; why that must wait, where it must."""
        from recon.images import write_image
        from recon.labels.label_book import CardMovedError

        name = f"press-{len(self.taken) + 1:03d}.png"
        label = circle.label(name, self.watcher.unwarp.size_px)
        write_image(self.out / label.file, frame)
        self.taken.append(label.file)
        self._waiting.add(label.file)
        try:
            self._book.put_found([label])
        except CardMovedError:
            return ""  # ``follow`` says so before the next frame
        except WedgeError as error:
            return f"; its circle will be found at the end: {error}"
        self._waiting.remove(label.file)
        self._circles[label.file] = circle
        return ""

    def follow(self) -> str:
        """Judge by what the card says now; a sentence, once, where somebody has changed it.

        Raises:
            WedgeError: circles that somebody drew lie in pixels of the card before; all is kept.
        """
        stamp = _stamp(self.out / CARD_FILE)
        if stamp == self._stamp:
            return ""
        before = self._trouble
        try:
            dataset, unwarp = self._read()
        except WedgeError as error:  # tried again with the next frame: another file may be at fault
            self._trouble = f"presses are judged as before until this is corrected: {error}"
            return "" if self._trouble == before else self._trouble
        self._stamp, self._trouble = stamp, ""
        try:
            return self._follow(dataset, unwarp)
        except WedgeError as error:
            raise self._ended(error) from error

    def settle(self) -> None:
        """Find the circles that wait, by the card as it is now.

        Raises:
            WedgeError: the folder cannot be read or written, or as for ``follow``; all is kept.
        """
        from recon.labels.find_circles import labels_of
        from recon.labels.label_book import CardMovedError
        from recon.presses import press_reader

        while True:
            try:
                dataset, unwarp = self._read()
                self._follow(dataset, unwarp)
                self._book.catch_up()
                waiting = sorted(self._waiting)
                files = [x for x in waiting if self._book.standing(x) == (None, False)]
                if files:
                    reader = press_reader(dataset)
                    circles = _found(reader, files, "circles")
                    self._book.put_found(labels_of(reader, circles))
                    self._circles |= circles
                self._agree()
                return
            except CardMovedError:
                continue  # somebody has moved the corners once more
            except WedgeError as error:
                raise self._ended(error) from error

    def _agree(self) -> None:
        """Centre the circles that nobody has changed in one way."""
        from recon.labels.find_circles import agreed

        size_px, centered = self.watcher.unwarp.size_px, agreed(self._circles)
        moved = [
            centered[file].label(file, size_px)
            for file, circle in self._circles.items()
            if self._book.standing(file) == (circle.label(file, size_px), False)
        ]
        self._book.put_found(moved)

    def measure(
        self, calipers: Sequence[tuple[str, float]], design: "Wedge | None"
    ) -> "Scale | None":
        """Write the scale by pictures of a caliper, with circles found anew by it, and the lights.

        All of what is on disk by now. Others may go on mending it until all is computed; what they
        wrote meanwhile stays. Lights that the design has and no press shows are written as it has
        them.

        Raises:
            WedgeError: the pictures tell no scale, or no ball is found by it; all is kept then, at
                the size as it was.
        """
        from validation.importers.folder import lit

        while True:
            fault, scale = None, None
            try:
                before = after = read_dataset(self.out, labelled=False)
                if calipers:
                    try:
                        after, scale = _by_caliper(before, calipers)
                    except WedgeError as error:
                        fault = error
                lights = lit(after)
                card = with_designed_lights(lights, design)
                is_written = self._merge(before, replace(after, card=card))
            except WedgeError as error:
                raise self._ended(error) from error
            self.lights_deg = lights.lights_deg
            if is_written and fault is not None:
                raise self._ended(fault) from fault
            if is_written:
                return scale
            self.settle()

    def without_circle(self) -> list[str]:
        """The presses that have no circle now, but those of which somebody said it so.

        Raises:
            WedgeError: the folder cannot be read; all is kept.
        """
        from recon.labels.label_book import LabelBook

        try:
            book = LabelBook(read_dataset(self.out, labelled=False))
        except WedgeError as error:
            raise self._ended(error) from error
        return [file for file in self.taken if book.standing(file) == (None, False)]

    def _ended(self, error: WedgeError) -> WedgeError:
        return error if self.kept in str(error) else WedgeError(f"{error} {self.kept}")

    def _read(self) -> "tuple[Dataset, Unwarp]":
        """The folder as it is now, and how its frames are unwarped."""
        from recon.labels.find_circle import refuse_ball
        from recon.presses import dataset_unwarp, read_dataset_lens

        assert self.watcher.background is not None
        dataset = read_dataset(self.out, labelled=False)
        lens, card = read_dataset_lens(dataset), dataset.card
        unwarp = dataset_unwarp(dataset, self.watcher.background, lens)
        try:
            refuse_ball(unwarp.size_px, card.ball_radius_mm, card.mm_per_px)
        except WedgeError as error:
            raise located(self.out / CARD_FILE, error) from error
        return dataset, unwarp

    def _follow(self, dataset: "Dataset", unwarp: "Unwarp") -> str:
        from recon.labels.label_book import LabelBook, is_by_hand, places

        before, card = self.card, dataset.card
        if places(card) == places(before):
            self.card = card
            return ""
        self.watcher.look_through(unwarp, card.ball_radius_mm, card.mm_per_px)
        with alone_in(self.out):
            now = read_dataset(self.out, labelled=False)
            drawn = [label for label in now.labels if is_by_hand(label)]
            if len(drawn) < len(now.labels):
                write_labels(self.out / LABELS_FILE, drawn)
        self._book, self._circles = LabelBook(replace(dataset, labels=tuple(drawn))), {}
        self._waiting = set(self.taken).difference(frame_name(label.file) for label in drawn)
        self.card = card  # last: what Ctrl-C cuts off is done anew at the end
        if drawn and _pixels(card) != _pixels(before):
            raise WedgeError(
                f"{self.out / CARD_FILE} was changed, but {self.out / LABELS_FILE} holds circles "
                "that somebody drew or confirmed, or ball radii that somebody wrote, in pixels of "
                "the previous corners: check whether they still fit."
            )
        return (
            f"{CARD_FILE} was changed: presses are judged by it from now on, and circles found "
            "earlier are found again at the end"
        )

    def _merge(self, before: "Dataset", after: "Dataset") -> bool:
        """Write what was measured beside what others wrote meanwhile; not if they moved corners."""
        from recon.labels.label_book import places
        from recon.labels.rescaled import merged

        with alone_in(self.out):
            now = read_dataset(self.out, labelled=False)
            if places(now.card) != places(before.card):
                return False
            measured = {key: getattr(after.card, key) for key in ("mm_per_px", "pad_size_mm")}
            card = replace(now.card, **measured, lights_deg=after.card.lights_deg)
            write_card(self.out / CARD_FILE, card)
            if places(after.card) != places(before.card):
                try:
                    write_labels(self.out / LABELS_FILE, merged(before, after, now))
                except BaseException:
                    write_card(self.out / CARD_FILE, now.card)
                    raise
        return True


def _by_caliper(
    before: "Dataset", calipers: Sequence[tuple[str, float]]
) -> "tuple[Dataset, Scale]":
    """A dataset by the scale of a caliper's pictures, its circles found anew, and that scale."""
    from recon.presses import press_reader
    from validation.importers.caliper import measured_scale, spread_over
    from validation.importers.raw_frames import rescaled

    few = spread_over(before.labels)
    if not few:
        raise WedgeError(
            "no press has a circle any more, but the scale needs some: take more presses."
        )
    scale = measured_scale(before.folder / CALIPER_FOLDER, calipers, press_reader(before), few)
    return _found_anew(before, rescaled(before.card, scale)), scale


def _found_anew(before: "Dataset", card: "DatasetCard") -> "Dataset":
    """A dataset by another card than its labels were made with.

    Circles that somebody drew or looked at stay where they are on the gel.

    Raises:
        WedgeError: no ball is recognised by it.
    """
    from recon.labels.find_circles import agreed, labels_of
    from recon.labels.label_book import is_looked_at
    from recon.labels.rescaled import rescaled_label
    from recon.presses import press_reader

    after = replace(before, card=card)
    labels = [rescaled_label(x, before, after) for x in before.labels if is_looked_at(x)]
    files = [x.file for x in before.labels if not is_looked_at(x)]
    reader = press_reader(after)
    labels += labels_of(reader, agreed(_found(reader, files, "circles at the measured scale")))
    if not labels:
        pitches = " x ".join(f"{pitch:.4g}" for pitch in card.mm_per_px)
        raise WedgeError(
            f"no ball was recognised at the caliper's scale, {pitches} mm/px: check its gap."
        )
    return replace(after, labels=tuple(sorted(labels, key=lambda label: label.file)))


def _found(reader: "PressReader", files: list[str], title: str) -> "dict[str, Circle]":
    """The circles of some frames, of those in which a ball shows."""
    from recon.labels.find_circles import found_circles

    with progress(title) as show, process_pool() as pool:
        return found_circles(reader, files, pool, show)


def _pixels(card: "DatasetCard") -> tuple[object, ...]:
    """What of a card decides where the gel lies in the unwarped picture."""
    return card.corners_px, card.unwarped_size_px


def _stamp(path: Path) -> tuple[int, int, int] | None:
    """By which a file that was written anew is told from what it was; ``None`` where none is."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_ino, found.st_mtime_ns, found.st_size
