# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Pixels of rendered presses, from which the default estimator learns beside a sensor's balls.

    python -m benchmarks.rendered_pixels --out FILE --sensor NAME BALLS DEEP SETS ...

BALLS and DEEP are datasets of the sensor's labelled balls, the second of balls that go in deeper,
which teach the models of its light; SETS are those of ``benchmarks.rendered_presses``, of which
some pixels of every press are kept. With ``--beside``, they are added to those of the same sensors
in another such file. What made the file that comes with this package is in
``recon/weights/README.md``.
"""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
from jaxtyping import Float32
from safetensors.numpy import save

from recon.calibration import CHANNELS
from recon.estimators import lesson_of
from recon.estimators.default import Default, prepared_colors
from recon.estimators.default_fit import collar_of, dents
from recon.estimators.rendered import OF_PIXELS, STEEPEST, VERSION, rendered_arrays
from recon.estimators.shading import Light, fit_light, fit_shading, whole_colors
from recon.lights import channel_indices
from recon.pixels import Pixels, positions
from recon.presses import read_presses
from recon.rendered_presses import RenderedPress, depth_files, rendered_presses
from recon.unet.weights import sha256_of
from sensor.arguments import ending_in_a_sentence
from sensor.dataset import read_dataset
from sensor.errors import WedgeError
from sensor.files import check_outputs, write_atomic
from validation.datasets import dataset_folder

DENTED: Final = 0.01
"""Of the deepest point: skin deeper than this is taken as dented."""
BESIDE: Final = 0.2
"""Of a press's pixels: the share that lies where the skin is not dented."""
PIXELS: Final = 40_000
SEED: Final = 0

Arrays = dict[str, np.ndarray]


def sensor_arrays(balls: Path, deep: Path, rendered: Sequence[Path], count: int = PIXELS) -> Arrays:
    """What ``RenderedSensor`` holds of one sensor.

    Args:
        balls: a set of its labelled balls.
        deep: one of balls that go in deeper.
        rendered: sets of random objects pressed into it, with the skin's depth.
        count: of pixels, as many of every press.

    Raises:
        WedgeError: a set cannot be used.
    """
    shallower, deeper = _lesson(balls), _lesson(deep)
    caps = np.array([_mean_cap(shallower), _mean_cap(deeper)], np.float32)
    if caps[1] <= caps[0]:
        raise WedgeError(f"{deep}: its balls go in no deeper than those of {balls}.")
    told = {
        "shallow": _shading(shallower),
        "deep": _shading(deeper),
        "caps": caps,
        "collar": np.array([collar_of(shallower)], np.float32),
    }
    return told | _pressed(fit_light(shallower.position, shallower.blank), rendered, count)


def _lesson(balls: Path) -> Pixels:
    labelled = read_presses(read_dataset(balls)).presses
    return lesson_of(Default.name, labelled, range(len(labelled)), SEED)


def _shading(pixels: Pixels) -> Float32[np.ndarray, "t 3"]:
    taught, light, _ = dents(pixels, channel_indices(CHANNELS))
    gentle = np.linalg.norm(taught.slopes, axis=1) < STEEPEST
    return fit_shading(taught[np.flatnonzero(gentle)], light).astype(np.float32)


def _mean_cap(pixels: Pixels) -> float:
    return float(pixels.cap[np.unique(pixels.press, return_index=True)[1]].mean())


def _pressed(light: Light, rendered: Sequence[Path], count: int) -> Arrays:
    """Pixels of random objects, their colours in shares of the blank gel's."""
    each = count // max(1, sum(len(depth_files(folder)) for folder in rendered))
    random = np.random.default_rng(SEED)
    kept = [
        _kept_of(press, each, random) for folder in rendered for press in rendered_presses(folder)
    ]
    if not kept:
        raise WedgeError(f"{rendered[0]}: no rendered press has its depth in truth/.")
    seen, position, slopes = (np.concatenate(part) for part in zip(*kept, strict=True))
    shares = seen / np.tile(whole_colors(light, position), seen.shape[1] // 3)
    return {
        "change": shares[:, :3].astype(np.float16),
        "around": shares[:, 3:].astype(np.float16),
        "position": position.astype(np.float16),
        "slopes": slopes.astype(np.float16),
    }


def joined(arrays: Arrays, more: Arrays) -> Arrays:
    """The arrays of some sensors, and more: pixels are added, what is told of a light replaced."""
    added = {
        name: np.concatenate([arrays[name], values])
        if name in arrays and name.partition(".")[2] in OF_PIXELS
        else values
        for name, values in more.items()
    }
    return arrays | added


def _kept_of(
    press: RenderedPress, each: int, random: np.random.Generator
) -> tuple[np.ndarray, ...]:
    """Some pixels of a press: prepared colours, positions, the skin's slopes."""
    depth_mm = press.depth_mm
    seen = prepared_colors(press.difference).reshape(depth_mm.size, -1)
    along_y, along_x = np.gradient(depth_mm, *press.mm_per_px[::-1])
    dented = (depth_mm > DENTED * depth_mm.max()).ravel()
    some = _drawn(random, dented, round((1 - BESIDE) * each))
    some = np.concatenate([some, _drawn(random, ~dented, each - len(some))])
    place = positions(depth_mm.shape[::-1]).reshape(-1, 2)
    return seen[some], place[some], np.stack([along_x, along_y], -1).reshape(-1, 2)[some]


def _drawn(random: np.random.Generator, mask: np.ndarray, count: int) -> np.ndarray:
    places = np.flatnonzero(mask)
    return random.choice(places, min(count, len(places)), replace=False)


def main() -> None:
    """Write the file."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.rendered_pixels",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--sensor", nargs="+", action="append", required=True, metavar="NAME BALLS DEEP SETS"
    )
    parser.add_argument("--pixels", type=int, default=PIXELS, help="of each sensor")
    parser.add_argument("--out", type=Path, required=True, help="the safetensors file to write")
    parser.add_argument("--beside", type=Path, help="a file whose pixels are kept as well")
    options = parser.parse_args()
    if any(len(words) < 4 for words in options.sensor):
        parser.error("--sensor takes a name, two sets of balls, and one or more rendered sets")
    with ending_in_a_sentence(parser):
        check_outputs(options.out)
        arrays = rendered_arrays(options.beside) if options.beside else {}
        for name, balls, deep, *sets in options.sensor:
            folders = [Path(folder) for folder in sets]
            found = sensor_arrays(
                dataset_folder(balls), dataset_folder(deep), folders, options.pixels
            )
            arrays = joined(arrays, {f"{name}.{key}": found[key] for key in found})
            print(f"{name}: {len(arrays[f'{name}.slopes'])} pixels")
        made = json.dumps({"version": VERSION, "sha256": sha256_of(arrays)})
        # One entry only: safetensors writes several in an order of chance.
        write_atomic(options.out, save(arrays, {"rendered": made}))
    print(f"sha256 {sha256_of(arrays)}")


if __name__ == "__main__":
    main()
