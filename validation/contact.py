# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Contact masks against labelled balls and rendered shapes, and against blank gel."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from recon.arrays import ContactMask, Difference, Frame, Unwarped
from recon.contact.disturbed import disturbed_mask
from recon.markers.filling import fill_gradients
from recon.pixels import BallPress
from recon.presses import PressReader, press_reader
from sensor.dataset import Dataset
from validation.folds import Fold
from validation.reconstructed import reconstruct_press

READ_NOISE_LEVELS, SHOT_NOISE, FLICKER = (0.5, 2.0), 0.02, 0.002
COLOR_DRIFT, STAIN, STAINS_ACROSS = 0.012, 0.003, (16, 12)
"""Since the background was taken: of each colour's brightness, and of full scale in patches.

Frames of the MIT Wedge before a grip differ from the first, after the blur of a contact's search,
by 0.004 of full scale in the middle and 0.02 at most; a second and more after the grip, when the
gel is free again, by 0.011 and 0.03, in every colour. Noisy frames differ by 0.008 and 0.03."""
JPEG_QUALITY = (75, 98)
BLANKS_EVERY = 20


@dataclass(frozen=True, kw_only=True)
class Overlap:
    """How one mask fits."""

    name: str
    iou: float
    radius_ratio: float
    """Of a disc of the found area to one of the true area."""


def iou(one: ContactMask, two: ContactMask) -> float:
    """Intersection over union; 1 where both are empty."""
    union = int((one | two).sum())
    return float((one & two).sum() / union) if union else 1.0


def ball_overlaps(
    dataset: Dataset, presses: Sequence[BallPress], folds: Iterable[Fold]
) -> list[Overlap]:
    """Masks of presses that no estimator has learnt from, against their labelled discs.

    Args:
        dataset: where the presses come from.
        presses: its usable ones, in order.
        folds: estimators of all lights, and the presses that each is judged on.
    """
    found = []
    for fold in folds:
        for index in fold.test:
            press = presses[index]
            touch = reconstruct_press(press, fold.estimator, "none", dataset.card.lights_deg)
            found.append(disc_overlap(press, touch.contact))
    return found


def disc(press: BallPress) -> ContactMask:
    """The labelled contact of a press."""
    return press.distance_mm < press.contact_radius_mm


def blank_frames_in_contact(dataset: Dataset, count: int) -> int:
    """How many of so many ``blank_frames`` of a sensor are taken for a contact."""
    frames = blank_frames(press_reader(dataset), count)
    return sum(bool(disturbed_mask(difference).any()) for difference, _ in frames)


def blank_frames(
    reader: PressReader, count: int, seed: int = 0
) -> Iterator[tuple[Difference, ContactMask | None]]:
    """Noisy blank frames of a sensor as differences, and what dots hide in them.

    See ``blank_images`` for what they are compared with.
    """
    for image, blank in blank_images(reader.background, reader.unwarp, count, seed):
        difference, hidden = image - blank, None
        if reader.dots is not None:
            hidden = reader.dots.hidden(reader.dots.track(image))
            difference = fill_gradients(difference, hidden, "harmonic")
        yield difference, hidden


def blank_images(
    background: Frame, unwarp: Callable[[Frame], Unwarped], count: int, seed: int = 0
) -> Iterator[tuple[Unwarped, Unwarped]]:
    """Unwarped noisy blank frames, each with the blank gel that it is compared with.

    That is the mean of four such frames of the same JPEG quality, as a camera would give both,
    taken before colours drifted.
    """
    rng = np.random.default_rng(seed)
    for number in range(count):
        if number % BLANKS_EVERY == 0:
            quality = int(rng.integers(*JPEG_QUALITY))
            seen = [unwarp(noisy(background, quality, rng)) for _ in range(4)]
            blank = np.asarray(np.mean(seen, axis=0, dtype=np.float32))
        yield unwarp(noisy(drifted(background, rng), quality, rng)), blank


def drifted(blank: Frame, rng: np.random.Generator) -> Frame:
    """A blank frame as it looks later: colours a little brighter or darker, stains on the gel."""
    height, width, _ = blank.shape
    gain = 1 + COLOR_DRIFT * rng.standard_normal(3)
    coarse = rng.standard_normal((*STAINS_ACROSS[::-1], 3)).astype(np.float32)
    stain = cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)
    return np.clip(np.rint(blank * gain + 255 * STAIN * stain), 0, 255).astype(np.uint8)


def noisy(blank: Frame, quality: int, rng: np.random.Generator) -> Frame:
    """A blank frame as a camera would see it again: flicker, shot and read noise, JPEG."""
    level = blank.astype(np.float32) * (1 + FLICKER * rng.standard_normal())
    deviation = np.sqrt(rng.uniform(*READ_NOISE_LEVELS) ** 2 + SHOT_NOISE * level)
    seen = np.clip(np.rint(level + deviation * rng.standard_normal(level.shape)), 0, 255)
    _, code = cv2.imencode(".jpg", seen.astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, quality])
    return np.asarray(cv2.imdecode(code, cv2.IMREAD_COLOR))


def mean_iou(found: Sequence[Overlap]) -> float:
    """Over presses."""
    return float(np.mean([item.iou for item in found]))


def disc_overlap(press: BallPress, mask: ContactMask) -> Overlap:
    """How a press's mask fits its labelled disc."""
    truth = disc(press)
    return Overlap(
        name=press.file,
        iou=iou(mask, truth),
        radius_ratio=float(np.sqrt(mask.sum() / max(int(truth.sum()), 1))),
    )
