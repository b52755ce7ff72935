# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How each colour answers to slope: is its light on, in its place, and alone?"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from jaxtyping import Float64

from recon.lights import channel_indices, sits_like_wedge
from recon.pixels import BallPress, join
from validation.acceptance.limits import DEAD_GRAY_LEVELS, Parts
from validation.lighting import GRAY_LEVELS, axes_ratio, response_to_slope, seen_contact

CLEARLY_DEG = 30.0
"""Colours count as swapped where another order fits better by this, summed over them."""


@dataclass(frozen=True, kw_only=True)
class Response:
    """What slopes do to colours inside contacts, over all presses."""

    slopes: Float64[np.ndarray, "3 2"]
    """Change of R, G and B, in full scale, with the gradient along x and y."""
    contrast: Float64[np.ndarray, "3"]
    """Standard deviation inside contacts, in full scale."""

    def azimuth_deg(self, channel: str) -> float:
        """Where a colour's light comes from: the side that brightens faces it."""
        x, y = -self.slopes["RGB".index(channel)]
        return float(np.degrees(np.arctan2(y, x)))


def light_response(presses: Sequence[BallPress]) -> Response:
    """Measure it on some presses."""
    parts = [seen_contact(press) for press in presses]
    return Response(
        slopes=response_to_slope(join(parts)),
        contrast=np.mean([part.color.std(0) for part in parts if len(part)], axis=0, dtype=float),
    )


def light_values(
    response: Response,
    channels: str,
    lights_deg: Mapping[str, float] | None,
    sees_both: bool,
    designed_deg: Mapping[str, float] | None = None,
) -> dict[str, Parts]:
    """Contrast, place and cross-talk of a unit's lights.

    Args:
        response: of its colours.
        channels: those with a light.
        lights_deg: where the unit has them; ``None`` where nobody said.
        sees_both: whether the lights see both axes by design.
        designed_deg: where its design has them; ``None`` where that is not known.
    """
    contrast = {c: GRAY_LEVELS * float(response.contrast["RGB".index(c)]) for c in channels}
    values: dict[str, Parts] = {"contrast_gray_levels": contrast}
    if sees_both:
        rows = response.slopes[channel_indices(channels)]
        values["axes_ratio"] = {"": axes_ratio(rows)}
    alive = [c for c in channels if contrast[c] >= DEAD_GRAY_LEVELS]
    found_deg = {c: response.azimuth_deg(c) for c in alive}
    if lights_deg is not None and alive:
        values |= _places(found_deg, lights_deg)
    swapped = [swapped_colors(found_deg, x) for x in (lights_deg, designed_deg) if x is not None]
    if swapped and alive:
        values["swapped_lights"] = {"": float(max(map(len, swapped)))}
    return values


def swapped_colors(found_deg: Mapping[str, float], lights_deg: Mapping[str, float]) -> list[str]:
    """The colours that come from where others should, of those whose place is known."""
    known = {c: angle for c, angle in found_deg.items() if c in lights_deg}
    return [c for c, other in _belonging(known, lights_deg).items() if c != other]


def _belonging(found_deg: Mapping[str, float], lights_deg: Mapping[str, float]) -> dict[str, str]:
    """Each colour, and the one in whose place it is."""
    colors = tuple(found_deg)
    orders = {
        order: sum(
            abs(turn_deg(found_deg[c] - lights_deg[other]))
            for c, other in zip(colors, order, strict=True)
        )
        for order in permutations(colors)
    }
    best = min(orders, key=orders.__getitem__)
    if orders[colors] - orders[best] < CLEARLY_DEG:
        best = colors
    return dict(zip(colors, best, strict=True))


def _places(found_deg: Mapping[str, float], lights_deg: Mapping[str, float]) -> dict[str, Parts]:
    """How far all colours are turned, and each beside that, from where they belong."""
    colors, belongs = tuple(found_deg), _belonging(found_deg, lights_deg)
    # Of a Wedge the lights sit on the axes; of others nobody knows better than the calibration.
    ideal = (
        {c: 90.0 * round(angle / 90.0) for c, angle in lights_deg.items()}
        if sits_like_wedge(lights_deg)
        else lights_deg
    )
    turns = {c: turn_deg(found_deg[c] - lights_deg[belongs[c]]) for c in colors}
    off = {c: turn_deg(found_deg[c] - ideal[belongs[c]]) for c in colors}
    common = _mean_deg(off)
    aside = {c: min(abs(turn_deg(angle - common)), 90.0) for c, angle in off.items()}
    return {
        "lights_turned_deg": {"": abs(_mean_deg(turns))},
        "cross_talk_share": {c: float(np.sin(np.radians(angle))) for c, angle in aside.items()},
    }


def turn_deg(angle_deg: float) -> float:
    """An angle from -180 to 180."""
    return (angle_deg + 180.0) % 360.0 - 180.0


def _mean_deg(angles_deg: Mapping[str, float]) -> float:
    radians = np.radians(list(angles_deg.values()))
    return float(np.degrees(np.arctan2(np.sin(radians).sum(), np.cos(radians).sum())))
