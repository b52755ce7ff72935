# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A dataset folder to ball presses that are ready to learn from."""

import hashlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float32

from recon.arrays import ContactMask, Difference, Frame, Unwarped
from recon.contact.disturbed import STRANGE, disturbed_mask, is_strange
from recon.coverage import Coverage
from recon.geometry.lens import Lens, read_lens
from recon.geometry.unwarp import Unwarp, is_within, prepare_unwarp
from recon.images import GRAY, is_gray, read_frame
from recon.markers.filling import fill_gradients
from recon.markers.tracking import MarkerTracker, marker_tracker
from recon.pixels import DEEPEST, RIM_PX, BallPress
from recon.same_light import divided, in_same_light, light_of
from sensor.dataset import CARD_FILE, LABELS_FILE, LENS_FILE, BallLabel, Dataset
from sensor.errors import WedgeError
from sensor.toml import located

LEAST_RADIUS_PX = 3.0
ENOUGH_PRESSES = 10
"""So many reach all over the pad (``recon.coverage``)."""
BLANK_SMOOTH_PX, MOST_BLANK_CHANGE = 2.0, 12
"""Grey levels of 255, noise smoothed, that 1 % of the pixels of two blank frames may differ by."""
LEAST_CHANGE = 2 / 255
"""A contact changes the colour of its pixels by this much of full scale, on average."""


@dataclass(frozen=True, kw_only=True)
class LeftOut:
    """A press that cannot be used, and why."""

    file: str
    reason: str


@dataclass(frozen=True, kw_only=True)
class PressSet:
    """The presses of a dataset, unwarped, with what was needed to get there."""

    background: Frame
    lens: Lens | None
    unwarp: Unwarp
    dots: MarkerTracker | None
    """Of a marker gel."""
    presses: tuple[BallPress, ...]
    left_out: tuple[LeftOut, ...]


@dataclass(frozen=True, kw_only=True)
class Seen:
    """What an unwarped frame shows, as estimators take it."""

    difference: Difference
    """To the blank gel, in that one's light; what dots hide is filled in from around them."""
    hidden: ContactMask | None
    """Where dots hid the colour, of a marker gel."""
    light: Float32[np.ndarray, "3"]
    """How many times as bright as the blank frame it was."""


@dataclass(frozen=True, kw_only=True)
class PressReader:
    """Reads presses of one dataset, one at a time: few of a large set need be in memory."""

    dataset: Dataset
    background: Frame
    lens: Lens | None
    unwarp: Unwarp
    blank: Unwarped
    """The background, unwarped."""
    dots: MarkerTracker | None
    """Of a marker gel."""

    def read(self, label: BallLabel) -> BallPress:
        """Read and unwarp one labelled frame; what dots hide is filled in from around them.

        Raises:
            WedgeError: the frame is missing, damaged, grey or of another size, or the label lies
                outside it. The sentence names the file.
        """
        frame = read_frame(self.dataset.folder, label.file)
        image = self.unwarped(label.file, frame)  # first: a small background is no label's fault
        _check_inside(self.dataset, label, self.unwarp.size_px)
        seen = self.seen(image)
        return BallPress(
            file=label.file,
            difference=seen.difference,
            center_px=label.center_px,
            contact_radius_px=label.contact_radius_px,
            ball_radius_mm=self.dataset.ball_radius_mm(label),
            mm_per_px=self.dataset.card.mm_per_px,
            hidden=seen.hidden,
            blank=self.blank,
            light=tuple(seen.light.tolist()),
            fingerprint=fingerprint(frame),
        )

    def seen(self, image: Unwarped) -> Seen:
        """What an unwarped frame of the dataset shows."""
        difference, hidden = image - self.blank, None
        light = light_of(difference, self.blank)
        difference = divided(difference, self.blank, light)
        if self.dots is not None:
            hidden = self.dots.hidden(self.dots.track(difference + self.blank))
            difference = fill_gradients(difference, hidden, "harmonic")
        return Seen(difference=difference, hidden=hidden, light=light)

    def difference(self, image: Unwarped) -> Difference:
        """An unwarped frame minus the blank one, in that one's light."""
        return in_same_light(image - self.blank, self.blank)

    def unwarped(self, file: str, frame: Frame) -> Unwarped:
        """A frame of the dataset in the gel plane.

        Raises:
            WedgeError: it is not as large as the background, or grey; the sentence names the file.
        """
        blank = self.dataset.card.background[0]
        refuse_other_size(self.dataset.folder / file, frame, blank, self.background)
        _refuse_gray(self.dataset.folder / file, frame)
        return self.unwarp(frame)


def refuse_other_size(path: Path, frame: Frame, blank: str, background: Frame) -> None:
    """Refuse a frame that is not as large as the blank one.

    Raises:
        WedgeError: it is not; the sentence names both files.
    """
    if frame.shape != background.shape:
        raise WedgeError(
            f"{path} is {_size(frame)} pixels, but {blank} is {_size(background)}: remove what "
            "another camera took."
        )


def _refuse_gray(path: Path, frame: Frame) -> None:
    if is_gray(frame):
        raise WedgeError(f"{path}: {GRAY}")


def fingerprint(frame: Frame) -> str:
    """By which a frame is known again: the SHA-256 of shape and pixels, its first 16 digits."""
    return hashlib.sha256(repr(frame.shape).encode() + frame.tobytes()).hexdigest()[:16]


def press_reader(dataset: Dataset) -> PressReader:
    """Prepare the background and the unwarp of a dataset.

    Raises:
        WedgeError: a background is missing, damaged, grey or of another size, or the corners or
            the lens do not fit it.
    """
    background = read_background(dataset)
    lens = read_dataset_lens(dataset)
    unwarp = dataset_unwarp(dataset, background, lens)
    blank = unwarp(background)
    return PressReader(
        dataset=dataset,
        background=background,
        lens=lens,
        unwarp=unwarp,
        blank=blank,
        dots=marker_tracker(blank),
    )


def read_presses(dataset: Dataset, progress: Callable[[float], None] = lambda _: None) -> PressSet:
    """Read and unwarp every labelled frame of a dataset.

    Raises:
        WedgeError: a frame is missing, damaged, grey or of another size; a label lies outside the
            frame; no press can be used. The sentence names the file.
    """
    reader = press_reader(dataset)
    presses: list[BallPress] = []
    left_out: list[LeftOut] = []
    for done, found in enumerate(sifted(reader), start=1):
        if isinstance(found, LeftOut):
            left_out.append(found)
        else:
            presses.append(found)
        progress(done / len(dataset.labels))
    refuse_no_press(dataset, len(presses), left_out)
    return PressSet(
        background=reader.background,
        lens=reader.lens,
        unwarp=reader.unwarp,
        dots=reader.dots,
        presses=tuple(presses),
        left_out=tuple(left_out),
    )


def sifted(reader: PressReader) -> Iterator[BallPress | LeftOut]:
    """Each labelled press of a dataset in turn, or why it is left out.

    Of two that are the same picture the second is left out: one could teach and the other judge.
    """
    first: dict[str, str] = {}
    for label in reader.dataset.labels:
        press = reader.read(label)
        reason = unusable(press)
        if reason is None and press.fingerprint in first:
            reason = f"it is the same picture as {first[press.fingerprint]}"
        elif reason is None:
            first[press.fingerprint] = press.file
        yield press if reason is None else LeftOut(file=press.file, reason=reason)


def unusable(press: BallPress) -> str | None:
    """Why a press cannot be used; ``None`` where it can."""
    if press.contact_radius_px < LEAST_RADIUS_PX:
        return f"the contact circle is smaller than {LEAST_RADIUS_PX:g} pixels"
    inside = press.distance_mm < press.contact_radius_mm * (1 - RIM_PX / press.contact_radius_px)
    if inside.all():
        return "the contact circle encloses the frame, so that no rim shows how deep it is"
    if np.abs(press.difference[inside]).max(-1).mean() < LEAST_CHANGE:
        return "no contact is visible inside the labelled circle"
    if is_strange(disturbed_mask(press.difference)):
        return STRANGE
    return None


def refuse_no_press(dataset: Dataset, usable: int, left_out: Sequence[LeftOut]) -> None:
    """Refuse a dataset without a press that can be used.

    Raises:
        WedgeError: says how many were labelled and why the first is of no use.
    """
    if not usable:
        why = f"; the first: {left_out[0].file}: {left_out[0].reason}" if left_out else ""
        raise WedgeError(
            f"{dataset.folder / LABELS_FILE} names no press that can be used"
            f" ({len(dataset.labels)} labelled{why}): press the ball and label the frames."
        )


def left_out_places(presses: PressSet) -> str | None:
    """A sentence where the presses leave part of the pad out; ``None`` where they do not."""
    coverage = Coverage(presses.unwarp.size_px, presses.presses[0].mm_per_px)
    for press in presses.presses:
        coverage.add(press.center_px)
    return coverage.left_out


def few_presses(presses: PressSet) -> str | None:
    """A sentence where there are too few presses to trust; ``None`` where there are enough."""
    count = len(presses.presses)
    if count >= ENOUGH_PRESSES:
        return None
    return (
        f"{count} press{'es' * (count > 1)}: too few to trust; press at least {ENOUGH_PRESSES} "
        "all over the pad."
    )


def deep_presses(presses: PressSet) -> str | None:
    """A sentence where most balls go in too deep to tell how gel follows; ``None`` elsewhere."""
    count = len(presses.presses)
    deep = sum(
        press.contact_radius_mm > DEEPEST * press.ball_radius_mm for press in presses.presses
    )
    if 2 * deep <= count:
        return None
    return (
        f"{deep} of {count} presses are so deep that the disc is more than {DEEPEST:g} times as "
        "wide as the ball: a calibration on them reads other shapes less well; press more gently."
    )


def read_background(dataset: Dataset) -> Frame:
    """The blank gel: the mean of the dataset's background frames.

    Raises:
        WedgeError: a background is missing, damaged, grey, of another size than the first, or shows
            something else than the others.
    """
    frames = [read_frame(dataset.folder, name) for name in dataset.card.background]
    for name, frame in zip(dataset.card.background, frames, strict=True):
        _refuse_gray(dataset.folder / name, frame)
        if frame.shape != frames[0].shape:
            raise WedgeError(
                f"{dataset.folder / name} is {_size(frame)} pixels, but "
                f"{dataset.card.background[0]} is {_size(frames[0])}."
            )
    first = cv2.GaussianBlur(frames[0], (0, 0), BLANK_SMOOTH_PX)
    for name, frame in zip(dataset.card.background[1:], frames[1:], strict=True):
        change = cv2.absdiff(cv2.GaussianBlur(frame, (0, 0), BLANK_SMOOTH_PX), first).max(-1)
        if np.percentile(change, 99) > MOST_BLANK_CHANGE:
            raise WedgeError(
                f"{dataset.folder / name} and {dataset.card.background[0]} disagree by "
                f"{np.percentile(change, 99):.0f} of 255 grey levels: one shows a press, or the "
                "camera or its light has changed; keep the pictures of the blank gel that agree."
            )
    return np.stack(frames).mean(axis=0).round().astype(np.uint8)


def read_dataset_lens(dataset: Dataset) -> Lens | None:
    """The camera calibration beside the dataset, where there is one."""
    path = dataset.folder / LENS_FILE
    return read_lens(path) if path.is_file() else None


def dataset_unwarp(dataset: Dataset, background: Frame, lens: Lens | None) -> Unwarp:
    """The map from the dataset's frames to the gel plane.

    Raises:
        WedgeError: a corner lies outside the frame, or the lens is another camera's.
    """
    height, width = background.shape[:2]
    card = dataset.card
    try:
        return prepare_unwarp((width, height), card.corners_px, card.unwarped_size_px, lens)
    except WedgeError as error:
        raise located(dataset.folder / CARD_FILE, error) from error


def _check_inside(dataset: Dataset, label: BallLabel, size_px: tuple[int, int]) -> None:
    width, height = size_px
    x_px, y_px = label.center_px
    if not is_within((x_px, y_px), size_px):
        raise WedgeError(
            f"{dataset.folder / LABELS_FILE}: the centre of {label.file} ({x_px:g}, {y_px:g}) "
            f"lies outside the {width}x{height} frame."
        )


def _size(frame: Frame) -> str:
    return f"{frame.shape[1]}x{frame.shape[0]}"
