# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the balls of a set tell of its light and its gel, as ``default`` learns from them.

    python -m benchmarks.light_and_gel twin-standard known-depth known-depth-spheres

Per set: how far the gel beside a ball follows, its collar, in shares of the frame's shorter side,
and by how much more the gel leans at the frame's edge than in its middle, along x and y. Then
shares of the balls' squared change of colour that are left unexplained: by the rendered standard's
light as it is, by its best mix and by the best of all rendered sensors' mixes; and, on quarters of
the presses that were held out, by the standard's mix with the second model, and by the set's own
light model. Of presses whose depth is known also: contact radii in pixels, labelled, fitted with an
elastic collar, and by Hertz's theory.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from recon.estimators import lesson_of
from recon.estimators.default import prepared_colors
from recon.estimators.default_fit import LEANING, STANDARD, UNLIKE, collar_of, dents
from recon.estimators.lesson import fit_elastic
from recon.estimators.rendered import (
    GENTLEST,
    STEEPEST,
    left_by_mix,
    matched_light,
    mixed_colors,
    rendered_sensors,
    shares_of,
    unlike,
)
from recon.estimators.shading import Colors, Light, Taught, color_changes, fit_shading, whole_colors
from recon.pixels import BallPress
from recon.presses import read_presses
from sensor.arguments import ending_in_a_sentence
from sensor.dataset import Dataset, read_dataset
from validation.datasets import dataset_folder
from validation.depth import read_truth

SEED = 0
COLORS = [0, 1, 2]
PARTS = 4
"""Of the presses, each of which is held out once."""


def measured(dataset: Dataset) -> Iterator[str]:
    """Line after line of a set.

    Raises:
        WedgeError: it cannot be read.
    """
    presses = read_presses(dataset).presses
    pixels = lesson_of("default", presses, range(len(presses)), SEED)
    taught, light, gel = dents(pixels, COLORS)
    collar, (x, y) = collar_of(pixels), np.abs(gel[:, 1]) / LEANING
    yield f"{dataset.card.name}, {len(presses)} presses: collar {collar:.3f}, lean {x:.2f} {y:.2f}"
    sensors = rendered_sensors()
    mixed = np.array([matched_light(one.shading, taught, light).unexplained for one in sensors])
    standard = next(one for one in sensors if one.name == STANDARD)
    least, by_standard = mixed.min(), mixed[sensors.index(standard)]
    yield f"  {unlike(STANDARD, taught, light):.3f} left by the standard's light as it is"
    yield f"  {by_standard:.3f} by its best mix, {least:.3f} by that of the likest sensor"
    shares = zip(sensors, shares_of(sensors, mixed, collar), strict=True)
    yield "  rendered pixels: " + ", ".join(f"{one.name} {share:.2f}" for one, share in shares)
    yield f"  {min(1.0, least / UNLIKE) ** 2:.3f} of the labelled collars are learnt from"
    if len(presses) >= PARTS:
        second, own = left_of_others(taught, light)
        yield f"  {second:.3f} by mix and second model, presses held out"
        yield f"  {own:.3f} by its own light model, presses held out"
    for press in presses:
        if (known := read_truth(dataset.folder, press)) is not None:
            yield _radii(press, float(known.max()))


def left_of_others(taught: Taught, light: Light) -> tuple[float, float]:
    """What mix with second model, and the set's own model, leave of presses not fitted to."""
    shading = next(one.shading for one in rendered_sensors() if one.name == STANDARD)
    part = np.unique(taught.press, return_inverse=True)[1] % PARTS
    steepness = np.linalg.norm(taught.slopes, axis=1)
    tilted = (steepness > GENTLEST) & (steepness < STEEPEST)
    left, total = np.zeros(2), 0.0
    for number in range(PARTS):
        known = taught[np.flatnonzero(part != number)]
        asked = taught[np.flatnonzero((part == number) & tilted)]
        match = matched_light(shading, known, light)
        second = left_by_mix(shading, match, known, light)
        own = fit_shading(known, light)
        blank = whole_colors(light, asked.position)
        change = asked.color / blank
        mixed = mixed_colors(shading, match, asked, light) / blank
        told = [mixed + _by(second, asked), _by(own, asked)]
        left += [float(((change - one) ** 2).sum()) for one in told]
        total += float((change**2).sum())
    return left[0] / total, left[1] / total


def _by(shading: np.ndarray, asked: Taught) -> Colors:
    return color_changes(shading, asked.slopes, asked.position)


def _radii(press: BallPress, depth_mm: float) -> str:
    """Of a press of known depth: its contact's radius, in three ways."""
    seen = replace(press, difference=prepared_colors(press.difference)[..., :3])
    px_per_mm = press.contact_radius_px / press.contact_radius_mm
    fitted_px = fit_elastic(seen).radius_mm * px_per_mm
    hertz_px = np.sqrt(press.ball_radius_mm * depth_mm) * px_per_mm
    return (
        f"  {depth_mm:.2f} mm deep: radius {press.contact_radius_px:.1f} px labelled, "
        f"{fitted_px:.1f} fitted, {hertz_px:.1f} by Hertz"
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.light_and_gel", description=__doc__)
    parser.add_argument("datasets", nargs="+", help="such as twin-standard; see `wedge data list`")
    options = parser.parse_args()
    with ending_in_a_sentence(parser):
        for dataset in [read_dataset(dataset_folder(name)) for name in options.datasets]:
            for line in measured(dataset):
                print(line, flush=True)
        for one in rendered_sensors():
            print(f"rendered {one.name}, whose pixels ship: collar {one.collar[0]:.3f}")


if __name__ == "__main__":
    main()
