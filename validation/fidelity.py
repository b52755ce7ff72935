# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Is the twin like a real sensor? The same numbers of both, and each one's network on the other.

Sensors with the Wedge's lights are turned so that red shines from y > 0, as the twin's does.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from recon.arrays import Unwarped
from recon.estimators import fit_estimator
from recon.pixels import BallPress, Pixels, join, label_pixels
from recon.presses import dataset_unwarp, read_background, read_dataset_lens, read_presses
from sensor.dataset import read_dataset
from sensor.toml import Pair
from validation.lighting import (
    GRAY_LEVELS,
    contrast,
    linear,
    response_to_slope,
    seen_contact,
    unevenness,
)
from validation.metrics import Errors, mean_errors, press_errors
from validation.splits import splits

SEED = 0
GRAIN_FROM = 2.0
"""Contact radii beyond which the gel is untouched."""


@dataclass(frozen=True, kw_only=True)
class Likeness:
    """What can be compared between sensors; ``None`` where a set cannot tell."""

    name: str
    presses: int
    keystone: float | None
    """Shorter over longer of the two opposite edges of the pad that differ most."""
    unevenness: float
    """Of the untouched gel's light."""
    near_far: Mapping[str, float] | None
    """Light on the third of the pad next to each colour's own side over that on the farthest."""
    levels_per_slope: Mapping[str, float] | None
    """Grey levels by which a colour changes per unit of slope toward its light, in contacts."""
    off_axis: Mapping[str, float] | None
    """The same across the light's direction, as a share of it: 0 for an ideal lobe."""
    contrast: float | None
    """Of contacts, in grey levels."""
    mean_abs_gradient: float | None
    """Of the same contacts."""
    grain: float | None
    """Standard deviation of untouched pixels, from what neighbours differ by, in grey levels."""


@dataclass(frozen=True, kw_only=True)
class Transfer:
    """A network that learnt on one sensor, judged on the contacts of another."""

    learnt: str
    judged: str
    errors: Errors


def likeness(folder: Path, corners_px: Sequence[Pair] | None = None) -> Likeness:
    """Measure a dataset.

    Args:
        folder: of the dataset.
        corners_px: the pad in the raw frame, where the frames show the gel plane already.

    Raises:
        WedgeError: the dataset cannot be read.
    """
    dataset = read_dataset(folder)
    card = dataset.card
    seen = card.corners_px or corners_px
    blank_frame = read_background(dataset)
    blank = dataset_unwarp(dataset, blank_frame, read_dataset_lens(dataset))(blank_frame)
    lights = card.lights_deg
    common = Likeness(
        name=card.name,
        presses=len(dataset.labels),
        keystone=None if seen is None else keystone(seen),
        unevenness=unevenness(blank),
        near_far=None if lights is None else near_far(blank, lights),
        levels_per_slope=None,
        off_axis=None,
        contrast=None,
        mean_abs_gradient=None,
        grain=None,
    )
    if not dataset.labels or lights is None:
        return common
    presses = read_presses(dataset).presses
    contact = join([seen_contact(press) for press in presses])
    along, across = _lobes(contact, lights)
    return replace(
        common,
        levels_per_slope=along,
        off_axis=across,
        contrast=contrast(contact.color[None], np.ones((1, len(contact)), bool)),
        mean_abs_gradient=float(np.abs(contact.gradient).mean()),
        grain=float(np.median([grain_of(press) for press in presses])),
    )


def grain_of(press: BallPress) -> float:
    """Standard deviation of the untouched gel's difference image, pixel to pixel, grey levels."""
    away = press.distance_mm > GRAIN_FROM * press.contact_radius_mm
    steps = np.diff(press.difference, axis=1)[away[:, 1:] & away[:, :-1]]
    return float(GRAY_LEVELS * steps.std() / np.sqrt(2))


def keystone(corners_px: Sequence[Pair]) -> float:
    """Shorter over longer opposite edge of a pad, for the pair that differs more."""
    corners = np.array(corners_px)
    edges = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    ratios = [min(edges[i], edges[i + 2]) / max(edges[i], edges[i + 2]) for i in (0, 1)]
    return float(min(ratios))


def near_far(blank: Unwarped, lights_deg: Mapping[str, float]) -> dict[str, float]:
    """Each colour's light on the third of the pad next to its side, over the farthest third."""
    rows, columns = np.indices(blank.shape[:2])
    x = 2 * (columns + 0.5) / blank.shape[1] - 1
    y = 2 * (rows + 0.5) / blank.shape[0] - 1
    light = linear(blank)
    ratios = {}
    for color, azimuth in lights_deg.items():
        toward = x * np.cos(np.radians(azimuth)) + y * np.sin(np.radians(azimuth))
        channel = light[..., "RGB".index(color)]
        ratios[color] = float(channel[toward > 1 / 3].mean() / channel[toward < -1 / 3].mean())
    return ratios


def transfer(learnt: Path, judged: Path) -> Transfer:
    """Fit the paper's network on one set and judge it on the contacts of another.

    On one and the same set, a fifth of the presses is held out to judge.

    Raises:
        WedgeError: a set cannot be used.
    """
    taught, asked = _turned(learnt), _turned(judged)
    if learnt == judged:
        (split,) = splits(len(taught), 1, SEED)
        taught, asked = [taught[i] for i in split.train], [asked[i] for i in split.test]
    fitted = fit_estimator("mlp", join(taught), "RGB", SEED)
    errors = [
        press_errors(
            str(index), fitted.slopes(part.color, part.position), part.gradient, part.contact
        )
        for index, part in enumerate(asked)
    ]
    return Transfer(
        learnt=read_dataset(learnt).card.name,
        judged=read_dataset(judged).card.name,
        errors=mean_errors(errors, SEED),
    )


def _turned(folder: Path) -> list[Pixels]:
    """Labelled pixels of every press, y mirrored where red shines from y < 0."""
    dataset = read_dataset(folder)
    lights = dataset.card.lights_deg or {}
    flip = np.float32(-1 if np.sin(np.radians(lights.get("R", 90.0))) < 0 else 1)
    turn = np.array([1, flip], np.float32)
    parts = [
        label_pixels(press, index, 0) for index, press in enumerate(read_presses(dataset).presses)
    ]
    return [
        replace(part, gradient=part.gradient * turn, position=part.position * turn)
        for part in parts
    ]


def _lobes(
    contact: Pixels, lights_deg: Mapping[str, float]
) -> tuple[dict[str, float], dict[str, float]]:
    """Change per slope toward each light, and across it relative to that."""
    response = response_to_slope(contact)
    along, across = {}, {}
    for color, azimuth in lights_deg.items():
        change = -response["RGB".index(color)]
        direction = np.array([np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth))])
        toward = float(change @ direction)
        along[color] = GRAY_LEVELS * toward
        across[color] = float(abs(change @ [-direction[1], direction[0]]) / abs(toward))
    return along, across
