# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The scale of a folder's frames from its pictures of a caliper, whose names tell the gap."""

from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import TypeVar

from recon.geometry.caliper import (
    Gap,
    Response,
    Scale,
    find_gap,
    scale_in_proportion,
    scale_of,
    shading_response,
    slopes_of,
)
from recon.images import read_image
from recon.lights import unseen_axis
from recon.presses import PressReader
from sensor.dataset import BallLabel
from sensor.errors import WedgeError
from sensor.toml import located
from validation.importers.lights import measure_lights_deg

Item = TypeVar("Item")

RESPONSE_PRESSES = 8
"""Whose shading tells a fall from a rise on the caliper's pictures."""


def spread_over(presses: Sequence[Item]) -> Sequence[Item]:
    """At least ``RESPONSE_PRESSES`` of a list, evenly, where it has as many."""
    return presses[:: max(1, len(presses) // RESPONSE_PRESSES)]


def measured_scale(
    source: Path,
    caliper: Sequence[tuple[str, float]],
    reader: PressReader,
    labels: Sequence[BallLabel],
    each: Callable[[Callable[[str], Gap | None], Iterable[str]], Iterable[Gap | None]] = map,
) -> Scale:
    """The scale from the caliper's pictures, slopes told apart by some presses' shading.

    Where no light of these presses shows slopes along one axis, its pitch follows the other's in
    the proportion that the reader's card has.

    Args:
        source: folder of the caliper's pictures.
        caliper: their names, and the gaps that these tell.
        reader: of the presses.
        labels: of the presses.
        each: looks at each picture; ``map``, or that of a pool.

    Raises:
        WedgeError: a picture is missing, names another gap, or they do not determine a scale.
    """
    widths_mm = {gap_mm for _, gap_mm in caliper}
    if len(widths_mm) > 1:
        raise WedgeError(
            f"{source}: the caliper's pictures name gaps of "
            f"{' and '.join(f'{x:g} mm' for x in sorted(widths_mm))}: keep those with one gap."
        )
    presses = [reader.read(label) for label in labels]
    lights_deg = measure_lights_deg(presses)
    unseen = unseen_axis(lights_deg, "".join(lights_deg))
    response = shading_response(presses)
    if unseen is not None:
        response[:, "xy".index(unseen)] = 0
    names = [name for name, _ in caliper]
    found = dict(zip(names, each(partial(_gap_in, source, reader, response), names), strict=True))
    gaps, gap_mm = [gap for gap in found.values() if gap is not None], widths_mm.pop()
    try:
        if unseen is not None:
            return scale_in_proportion(gaps, gap_mm, reader.dataset.card.mm_per_px, unseen)
        return scale_of(gaps, gap_mm)
    except WedgeError as error:
        missed = [name for name, gap in found.items() if gap is None]
        seen = f" (no jaws were recognised in {', '.join(missed)})" if gaps and missed else ""
        raise WedgeError(f"{source}{seen}: {error}") from error


def _gap_in(source: Path, reader: PressReader, response: Response, name: str) -> Gap | None:
    """The gap in one of the caliper's pictures."""
    try:
        difference = reader.unwarp(read_image(source / name)) - reader.blank
    except WedgeError as error:
        raise located(source / name, error) from error
    return find_gap(slopes_of(difference, response))
