# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Random objects pressed into the twin of a design, traced: things that no calibration presses.

    python -m benchmarks.rendered_presses standard build/standard

The objects are those of ``recon.training.random_presses``, one or a few in a square at a place
drawn from the pad, or with ``--parts`` those of ``simulation.random_parts``, with ``--dies`` those
of ``simulation.random_dies``, one at a place. OUT becomes a dataset folder without a label, with
the skin's depth of every frame in truth/ and where the object holds it in held/. The default
estimator learns from some of its pixels (``benchmarks.rendered_pixels``), the contact's network
from all (``recon.training.contact_further``).
"""

import argparse
import multiprocessing
import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from recon.training.random_presses import NOTHING_PX, random_objects
from sensor.arguments import ending_in_a_sentence
from sensor.design import Wedge
from sensor.design_file import load_design
from sensor.files import new_folder
from simulation.dataset import Recipe, write_set
from simulation.engine import best_engine
from simulation.indenters import Indenter, Profile
from simulation.presses import DEEPEST, Press, rest_slope, skin_under
from simulation.random_dies import random_die
from simulation.random_parts import KINDS, random_part
from simulation.skin import View, collar_mm, gel_view, rest_height_mm

WIDTH_PX: Final = 320
SIDES_PX: Final = (96, 160)
"""Of the squares that objects of one press lie in."""
COLLARS: Final = (0.7, 1.4)
"""Of the gel's own, for which depths are drawn."""
WIDEST_PART_MM: Final = 12.0
PART_SHARE: Final = 0.9
"""Of the pad's shorter side, at most."""
LEAST_ROOM_MM: Final = 0.3
"""Parts as wide as the pad are moved by as much."""


def random_presses(design: Wedge, sides_px: Sequence[int], count: int, seed: int) -> list[Press]:
    """Presses of random objects at random places, each by its own seed."""
    view = gel_view(design, WIDTH_PX)
    return [_press(design, view, sides_px, index, seed) for index in range(count)]


def _press(design: Wedge, view: View, sides_px: Sequence[int], index: int, seed: int) -> Press:
    rng = np.random.default_rng([seed, index])
    side_px = int(rng.choice(sides_px))
    pitch_mm = view.mm_per_px[0]
    collar_px = collar_mm(design.gel) / pitch_mm * rng.uniform(*COLLARS)
    reach_px = random_objects(rng, side_px, side_px, collar_px)
    corner_px = [rng.integers(0, max(1, size - side_px)) for size in view.size_px]
    x_mm, y_mm = (
        float(along_mm[at + side_px // 2])
        for along_mm, at in zip((view.x_mm, view.y_mm), corner_px, strict=True)
    )
    deepest_px = reach_px.max()
    depth_mm = min(float(deepest_px) * pitch_mm, DEEPEST * design.gel.thickness_at_mm(x_mm, y_mm))
    heights_mm = (deepest_px - reach_px) * pitch_mm
    heights_mm[reach_px < NOTHING_PX / 2] = np.inf
    underside = partial(
        _underside,
        heights_mm=heights_mm,
        pitch_mm=pitch_mm,
        design=design,
        center_mm=(x_mm, y_mm),
    )
    indenter = Indenter(
        name="random", profile=underside, size_mm=(side_px * pitch_mm,) * 2, depth_mm=depth_mm
    )
    return Press(
        name=f"press_{index:03d}", indenter=indenter, center_mm=(x_mm, y_mm), depth_mm=depth_mm
    )


def part_presses(design: Wedge, count: int, seed: int) -> list[Press]:
    """Presses of random parts, of each kind as many, straight down on the skin where they lie."""
    return [_part_press(design, index, seed) for index in range(count)]


def die_presses(design: Wedge, count: int, seed: int) -> list[Press]:
    """Presses of random dies, straight down on the skin where they lie."""
    return [_die_press(design, index, seed) for index in range(count)]


def _part_press(design: Wedge, index: int, seed: int) -> Press:
    rng = np.random.default_rng([seed, index])
    part = random_part(rng, tuple(KINDS)[index % len(KINDS)], _widest_mm(design))
    return _pressed(design, part, f"press_{index:03d}", rng)


def _die_press(design: Wedge, index: int, seed: int) -> Press:
    rng = np.random.default_rng([seed, index])
    return _pressed(design, random_die(rng, _widest_mm(design)), f"press_{index:03d}", rng)


def _widest_mm(design: Wedge) -> float:
    return min(WIDEST_PART_MM, PART_SHARE * min(design.pad_size_mm))


def _pressed(design: Wedge, part: Indenter, name: str, rng: np.random.Generator) -> Press:
    """A part pressed in as deep as it says, where the pad has room for it."""
    room_mm = [max(LEAST_ROOM_MM, (pad - part.size_mm[0]) / 2) for pad in design.pad_size_mm]
    x_mm, y_mm = (float(rng.uniform(-room, room)) for room in room_mm)
    lean = rest_slope(design.gel, x_mm, y_mm)
    depth_mm = min(part.depth_mm, DEEPEST * design.gel.thickness_at_mm(x_mm, y_mm))
    leant = replace(
        part, profile=partial(_leant, profile=part.profile, lean=lean), depth_mm=depth_mm
    )
    return Press(name=name, indenter=leant, center_mm=(x_mm, y_mm), depth_mm=depth_mm)


def _leant(
    x_mm: np.ndarray, y_mm: np.ndarray, *, profile: Profile, lean: tuple[float, float]
) -> np.ndarray:
    return profile(x_mm, y_mm) + lean[0] * x_mm + lean[1] * y_mm


def _underside(
    x_mm: np.ndarray,
    y_mm: np.ndarray,
    *,
    heights_mm: np.ndarray,
    pitch_mm: float,
    design: Wedge,
    center_mm: tuple[float, float],
) -> np.ndarray:
    """Heights of the objects, bent as the untouched gel is, so that all of them touch it."""
    side_px = len(heights_mm)
    column, row = (np.round(along / pitch_mm).astype(int) + side_px // 2 for along in (x_mm, y_mm))
    inside = np.logical_and.reduce([(at >= 0) & (at < side_px) for at in (column, row)])
    found_mm = np.full(x_mm.shape, np.inf)
    found_mm[inside] = heights_mm[row[inside], column[inside]]
    bent_mm = rest_height_mm(design.gel, x_mm + center_mm[0], y_mm + center_mm[1])
    return found_mm + bent_mm - rest_height_mm(design.gel, *(np.array(at) for at in center_mm))


def main() -> None:
    """Render a set."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.rendered_presses", description=__doc__
    )
    parser.add_argument("design", help="standard, finger or a TOML file")
    parser.add_argument("out", type=Path, help="the folder to make; new or empty")
    parser.add_argument("--presses", type=int, default=130)
    parser.add_argument(
        "--sides-px", type=int, nargs="+", default=SIDES_PX, help="of the squares of odd things"
    )
    kinds = parser.add_mutually_exclusive_group()
    kinds.add_argument("--parts", action="store_true", help="made things, not odd ones")
    kinds.add_argument("--dies", action="store_true", help="flat faces within steep walls")
    parser.add_argument("--samples", type=int, default=128, help="light paths a pixel")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    with ending_in_a_sentence(parser):
        design = load_design(options.design)
        recipe = Recipe(
            engine=best_engine(),
            design=design,
            width_px=WIDTH_PX,
            samples=options.samples,
            seed=options.seed,
        )
        os.environ.setdefault("OMP_NUM_THREADS", "1")
        spawn = multiprocessing.get_context("spawn")
        with new_folder(options.out) as folder, ProcessPoolExecutor(2, spawn) as executor:
            if options.parts:
                presses = part_presses(design, options.presses, options.seed)
            elif options.dies:
                presses = die_presses(design, options.presses, options.seed)
            else:
                presses = random_presses(design, options.sides_px, options.presses, options.seed)
            write_set(
                folder,
                recipe,
                presses,
                source=f"random presses on the {design.name} design",
                executor=executor,
                progress=lambda share, what: print(f"{share:4.0%} {what}", flush=True),
            )
            (folder / "held").mkdir()
            for press in presses:
                held = skin_under(design, recipe.view, press).contact
                np.save(folder / "held" / f"{press.name}.npy", held)


if __name__ == "__main__":
    main()
