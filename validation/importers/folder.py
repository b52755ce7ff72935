# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What every importer does at its end: labels mended, lights measured, the folder written."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from recon.geometry.unwarp import is_within
from recon.labels.circles import refit_circle
from recon.pixels import BallPress
from recon.presses import LeftOut, read_presses, refuse_no_press
from sensor.dataset import (
    CARD_FILE,
    LABELS_FILE,
    BallLabel,
    Dataset,
    DatasetCard,
    read_dataset,
    write_card,
    write_labels,
)
from sensor.errors import WedgeError
from sensor.files import write_atomic
from validation.importers.lights import measure_lights_deg

PRESSES_FOR_LIGHTS = 12
"""Spread over the set; more do not move an azimuth by more than a degree or two."""


def write_dataset(
    folder: Path, card: DatasetCard, labels: Sequence[BallLabel], *, mend_circles: bool = False
) -> tuple[LeftOut, ...]:
    """Write card and labels beside the frames, which must be there already.

    Args:
        folder: of the dataset.
        card: lights are measured and added where there are labels.
        labels: as published.
        mend_circles: refit every circle to its ball's shading; what cannot be is left out.

    Returns:
        What was left out, and why.

    Raises:
        WedgeError: a frame is missing or damaged, a label does not fit it, or no circle can be
            refitted.
    """
    write_card(folder / CARD_FILE, card)
    write_labels(folder / LABELS_FILE, labels)
    left_out: tuple[LeftOut, ...] = ()
    if labels and mend_circles:
        drawn = {label.file: label for label in labels}
        dataset = read_dataset(folder)
        read = read_presses(dataset)
        labels = []
        gone: list[BallLabel] = []
        for press in read.presses:
            label = mended(press, drawn[press.file])
            inside = is_within(label.center_px, press.size_px)
            (labels if inside else gone).append(label)
        reason = "its circle, once refitted, is centred outside the frame"
        left_out = (*read.left_out, *(LeftOut(file=x.file, reason=reason) for x in gone))
        refuse_no_press(dataset, len(labels), left_out)
        write_labels(folder / LABELS_FILE, labels)
    write_card(folder / CARD_FILE, lit(read_dataset(folder)))
    return left_out


def lit(dataset: Dataset) -> DatasetCard:
    """The card of a dataset with the lights as its presses show them, where it has any.

    Raises:
        WedgeError: a frame is missing or damaged, or a label does not fit it.
    """
    if not dataset.labels:
        return dataset.card
    step = max(1, len(dataset.labels) // PRESSES_FOR_LIGHTS)
    presses = read_presses(replace(dataset, labels=dataset.labels[::step])).presses
    return replace(dataset.card, lights_deg=measure_lights_deg(presses))


def mended(press: BallPress, drawn: BallLabel) -> BallLabel:
    """The label of a press after its circle was refitted, its ball kept; pixels must be square."""
    circle = refit_circle(
        press.difference,
        press.center_px,
        press.contact_radius_px,
        press.ball_radius_mm / float(np.sqrt(np.prod(press.mm_per_px))),
    )
    return replace(
        drawn,
        center_x_px=round(circle.center_px[0], 2),
        center_y_px=round(circle.center_px[1], 2),
        contact_radius_px=round(circle.radius_px, 2),
        quality=round(circle.quality, 3),
    )


def plain_name(text: str, otherwise: str) -> str:
    """A text as the name of a dataset: letters, digits and hyphens; else another name."""
    return re.sub(r"\W+", "-", text).strip("-") or otherwise


def copy_frames(source: Path, folder: Path, names: Iterable[str]) -> None:
    """Copy images byte for byte, so that a JPEG is not encoded twice.

    Raises:
        WedgeError: an image is missing or cannot be read.
    """
    for name in names:
        try:
            content = (source / name).read_bytes()
        except OSError as error:
            raise WedgeError(f"{source / name} cannot be read: {error.strerror}.") from error
        write_atomic(folder / name, content)
