# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Pixels of things that no calibration presses, rendered, as the sensor at hand would see them.

Balls teach what balls look like: walls, edges, grooves and what they do to the light beside them
are missing. Odd things and made ones were pressed into rendered sensors
(``benchmarks.rendered_presses``), and some of their pixels come with this package. No two sensors
are lit alike. But what a tilt does to the colours of one is close to a mix of what it does to those
of another, a mix that changes linearly from place to place. A sensor's own balls tell that mix: the
rendered sensor's model of its light (``shading``) says which colours it would have had there. On
three real sensors the mix leaves 5 to 6 % of the squared change of colour unexplained. Most of that
slope and place explain: a model of what is left is added. Balls that go in deep are lit otherwise
than shallow ones; rendered sensors were pressed by both, and what depth does is not taken for mix.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from jaxtyping import Float32, Float64, Int64

from recon.estimators.shading import (
    Colors,
    Light,
    Shading,
    Taught,
    changes_by,
    color_changes,
    fit_shading,
    shading_terms,
    whole_colors,
)
from recon.estimators.surroundings import ASPECTS
from recon.tensor_files import read_tensors
from recon.unet.weights import sha256_of
from sensor.errors import WedgeError

FILE = Path(__file__).parents[1] / "weights" / "rendered.safetensors"
VERSION = "6"
"""Of the arrays and of what is looked at around a pixel."""
GENTLEST, STEEPEST = 0.02, 1.0
"""Slopes of the balls' pixels from which the mix and the rendered lights are told."""
DEEPNESS = tuple(np.arange(0, 2.01, 0.125).tolist())
"""Factors that are tried on how light changes with depth: a sensor's may change less or more."""
BETWEEN = -0.5, 1.5
"""From shallow balls (0) to deep ones (1): what light does is not told beyond."""
RIDGE = 1e-3
"""Ridge of the mix, as a share of each term's own square."""
MOST = 0.98
"""Quantile of the balls' slopes: what the mix leaves is not extrapolated to steeper ones."""
LIKENESS = 6
"""Rendered sensors count by this negative power of what they leave unexplained."""
COLLAR_SPREAD = 0.2
"""Of the logarithm of the collar's length: rendered sensors count by a Gaussian of it as well."""
OF_PIXELS = ("change", "around", "position", "slopes")
OF_SHADING = ("shallow", "deep", "caps")
WANTED = (*OF_PIXELS, *OF_SHADING, "collar")

Mix = Float64[np.ndarray, "9 c"]
"""From three colours' changes, each times 1, x and y, to those of the sensor at hand."""


@dataclass(frozen=True, kw_only=True)
class Shadings:
    """How a rendered sensor's colours answer tilt, by how deep a ball goes in."""

    shallow: Shading
    deep: Shading
    caps: Float32[np.ndarray, "2"]
    """Of the balls that told the two, below the rims of their contacts, in shares of the frame's
    shorter side."""


@dataclass(frozen=True, kw_only=True)
class RenderedSensor:
    """Pixels of one rendered sensor; colours change by shares of its blank gel's."""

    name: str
    change: Float32[np.ndarray, "n 3"]
    around: Float32[np.ndarray, "n a"]
    """What lies around, in shares of the blank gel at the pixel itself."""
    position: Float32[np.ndarray, "n 2"]
    slopes: Float32[np.ndarray, "n 2"]
    """Of the dent, mm/mm."""
    shading: Shadings
    collar: Float32[np.ndarray, "1"]
    """How far its gel follows beside a ball, in shares of the frame's shorter side."""


@dataclass(frozen=True, kw_only=True)
class SeenPixels:
    """Rendered pixels as the sensor at hand would see them."""

    color: Float32[np.ndarray, "n c"]
    around: Float32[np.ndarray, "n a"]
    position: Float32[np.ndarray, "n 2"]
    slopes: Float32[np.ndarray, "n 2"]


def rendered_pixels(
    taught: Taught, light: Light, collar: float, count: int, seed: int
) -> tuple[SeenPixels, float]:
    """That many pixels of rendered presses, or fewer where no rendered sensor is lit alike.

    And what the likest sensor leaves unexplained of the balls' squared change of colour.

    Args:
        taught: pixels of the sensor's own balls.
        light: of its blank gel.
        collar: how far its gel follows beside them, in shares of the frame's shorter side, or NaN.
        count: of pixels, times the share of the balls' colours that the likest sensor explains.
        seed: draws them.

    Raises:
        WedgeError: the pixels that come with this package are missing or damaged.
    """
    sensors = rendered_sensors()
    matched = [matched_light(sensor.shading, taught, light) for sensor in sensors]
    unexplained = np.array([match.unexplained for match in matched])
    least = float(unexplained.min())
    count = round(count * max(0.0, 1 - least))
    random = np.random.default_rng(seed)
    from_each = random.multinomial(count, shares_of(sensors, unexplained, collar))
    steepness = np.linalg.norm(taught.slopes, axis=1)
    steepest = float(np.quantile(steepness[steepness > 0], MOST)) if count else 0.0
    seen = []
    for sensor, match, some in zip(sensors, matched, from_each.tolist(), strict=True):
        chosen = drawn_evenly(random, len(sensor.slopes), some)
        nothing = np.zeros((len(sensor.shading.shallow), match.mix.shape[1]))
        left = left_by_mix(sensor.shading, match, taught, light) if some else nothing
        seen.append(_seen(sensor, chosen, match.mix, left, steepest, light))
    joined = {name: np.concatenate([vars(part)[name] for part in seen]) for name in vars(seen[0])}
    return SeenPixels(**joined), least


def shares_of(
    sensors: Sequence[RenderedSensor], unexplained: Float64[np.ndarray, " s"], collar: float
) -> Float64[np.ndarray, " s"]:
    """How much each rendered sensor counts, by its light and, where a collar is known, by its gel.

    Args:
        sensors: to choose from.
        unexplained: what the mix of each leaves of the balls' squared change of colour.
        collar: in shares of the frame's shorter side, or NaN.
    """
    weight = np.maximum(unexplained, 1e-3) ** -LIKENESS
    if np.isfinite(collar):
        apart = np.log([float(sensor.collar[0]) / collar for sensor in sensors]) / COLLAR_SPREAD
        weight *= np.exp((np.min(apart**2) - apart**2) / 2)
    return np.asarray(weight / weight.sum())


@dataclass(frozen=True, kw_only=True)
class Match:
    """How a rendered sensor's colours become those of the sensor at hand."""

    mix: Mix
    deepness: float
    """How much its light changes with the balls' depth; the rendered sensor's by 1."""
    unexplained: float
    """Of the balls' squared change of colour; 1 where no pixel tells."""


def matched_light(shading: Shadings, taught: Taught, light: Light) -> Match:
    """How a rendered sensor's colours mix to a sensor's own, as its balls tell.

    At one slope the floor of a deep dent has other colours than that of a shallow one: lights graze
    it, walls shade and brighten it. Taken for a mix, that would change the colours of everything.
    """
    some, wanted = _tilted(taught, light)
    level, deeper = (_placed(change, some.position) for change in _changes(shading, some))
    total = float((wanted**2).sum())

    def found(deepness: float) -> Match:
        terms = level + deepness * deeper
        square = terms.T @ terms
        ridge = np.diag(RIDGE * np.diag(square) + 1e-9)
        mix = np.linalg.solve(square + ridge, terms.T @ wanted)
        left = float(((wanted - terms @ mix) ** 2).sum())
        unexplained = left / total if total > 0 else 1.0
        return Match(mix=mix, deepness=deepness, unexplained=unexplained)

    return min((found(deepness) for deepness in DEEPNESS), key=lambda match: match.unexplained)


def unlike(name: str, taught: Taught, light: Light) -> float:
    """What a rendered sensor's light, as it is, leaves unexplained of all three colours' changes.

    A share of the balls' squared change of colour: 0 where a sensor is lit as that one is.

    Raises:
        WedgeError: the pixels that come with this package are missing or damaged.
    """
    shading = next(sensor.shading for sensor in rendered_sensors() if sensor.name == name)
    some, wanted = _tilted(taught, light)
    level, deeper = _changes(shading, some)
    total = float((wanted**2).sum())
    return float(((wanted - level - deeper) ** 2).sum()) / total if total > 0 else 1.0


def _tilted(taught: Taught, light: Light) -> tuple[Taught, Float64[np.ndarray, "m c"]]:
    """The balls' tilted pixels, and how their colours changed in shares of the blank gel's."""
    steepness = np.linalg.norm(taught.slopes, axis=1)
    some = taught[np.flatnonzero((steepness > GENTLEST) & (steepness < STEEPEST))]
    return some, (some.color / whole_colors(light, some.position)).astype(float)


def left_by_mix(
    shading: Shadings, match: Match, taught: Taught, light: Light
) -> Float64[np.ndarray, "t c"]:
    """What the mix leaves of the balls' changes of colour, by slope and place."""
    left = np.asarray(taught.color - mixed_colors(shading, match, taught, light), np.float32)
    return fit_shading(replace(taught, color=left), light)


def mixed_colors(
    shading: Shadings, match: Match, taught: Taught, light: Light
) -> Float64[np.ndarray, "n c"]:
    """The changes of colour that the mix tells of the balls' slopes, places and depths."""
    level, deeper = _changes(shading, taught)
    change = _placed(level + match.deepness * deeper, taught.position) @ match.mix
    return change * whole_colors(light, taught.position)


@lru_cache
def rendered_sensors() -> Sequence[RenderedSensor]:
    """Those that come with this package.

    Raises:
        WedgeError: the file is missing, damaged, or of another version.
    """
    return read_rendered(FILE)


def read_rendered(path: Path) -> Sequence[RenderedSensor]:
    """Rendered sensors of a file, checked before use.

    Raises:
        WedgeError: it is missing, damaged, or of another version.
    """
    arrays = rendered_arrays(path)
    names = sorted({name.partition(".")[0] for name in arrays})
    return tuple(
        _restored(name, {key: arrays[f"{name}.{key}"].astype(np.float32) for key in WANTED})
        for name in names
    )


def _restored(name: str, arrays: dict[str, np.ndarray]) -> RenderedSensor:
    shading = Shadings(**{key: arrays.pop(key) for key in OF_SHADING})
    return RenderedSensor(name=name, shading=shading, **arrays)


def rendered_arrays(path: Path) -> dict[str, np.ndarray]:
    """What a file holds, each array by its sensor's name, a dot and its own.

    Raises:
        WedgeError: it is missing, damaged, or of another version.
    """
    said, arrays = read_tensors(path, "", "install it again")
    try:
        made = json.loads(said.get("rendered", "{}"))
    except (json.JSONDecodeError, RecursionError) as error:
        raise WedgeError(f"{path} cannot be read: {error}; install it again.") from error
    version = made.get("version", "unknown") if isinstance(made, dict) else "unknown"
    if version != VERSION:
        raise WedgeError(
            f"{path} is of version {version}, version {VERSION} is needed: install it again."
        )
    if made.get("sha256") != sha256_of(arrays):
        raise WedgeError(f"{path} is damaged, its hash does not match: install it again.")
    return arrays


def _seen(
    sensor: RenderedSensor,
    some: np.ndarray,
    mix: Mix,
    left: Float64[np.ndarray, "t c"],
    steepest: float,
    light: Light,
) -> SeenPixels:
    """Some pixels of a rendered sensor, in the colours of the sensor at hand."""
    position, slopes = sensor.position[some], sensor.slopes[some]
    whole = whole_colors(light, position)
    steepness = np.maximum(np.linalg.norm(slopes, axis=1, keepdims=True), steepest)
    unmixed = color_changes(left, slopes * (steepest / steepness), position) * whole

    def mixed(change: Float32[np.ndarray, "m 3"]) -> Float32[np.ndarray, "m c"]:
        return np.asarray(_placed(change, position) @ mix * whole, np.float32)

    around = sensor.around[some]
    return SeenPixels(
        color=mixed(sensor.change[some]) + unmixed,
        around=np.concatenate(
            [mixed(around[:, 3 * aspect : 3 * aspect + 3]) for aspect in range(ASPECTS)], 1
        ),
        position=position,
        slopes=slopes,
    )


def drawn_evenly(random: np.random.Generator, things: int, count: int) -> Int64[np.ndarray, " c"]:
    """That many of some things: none a second time before all were drawn once."""
    rounds, rest = divmod(count, things)
    return np.concatenate([np.tile(np.arange(things), rounds), random.permutation(things)[:rest]])


def _changes(shading: Shadings, taught: Taught) -> tuple[Colors, Colors]:
    """Of the colours under shallow balls, and what the balls' depth adds to them."""
    terms = shading_terms(taught.slopes, taught.position)
    shallow, deep = (changes_by(answer, terms) for answer in (shading.shallow, shading.deep))
    least, most = shading.caps
    deeper = np.clip((taught.cap - least) / (most - least), *BETWEEN)
    return shallow, (deep - shallow) * deeper[:, None]


def _placed(change: np.ndarray, position: np.ndarray) -> Float64[np.ndarray, "n 9"]:
    """Each colour's change times 1, x and y."""
    places = np.concatenate([np.ones((len(position), 1)), position], 1)
    return (change[:, :, None] * places[:, None, :]).reshape(len(change), 3 * change.shape[1])
