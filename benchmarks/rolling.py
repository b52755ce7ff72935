# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A textured bead on the standard twin's gel, path-traced, reconstructed and followed.

    python -m benchmarks.rolling build/roll
    python -m benchmarks.rolling build/across --way across
    python -m benchmarks.rolling build/along --way along

It turns once round at the pad's middle about the gel's y axis, as one that is rolled between the
sensor and a plate does; or it is carried over the pad, across or along the finger, and does not
turn. Frames that an interrupted run left in the folder are not traced again; the unit is that of
the rendered twin, whose ball presses are in the repository.
"""

import argparse
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.touches import Thing, bead, lowest_surface
from recon.calibration import unit_of_set
from recon.images import read_image
from recon.pipeline import Reconstructor
from recon.pose.rest import rest_at
from recon.pose.rigid import Transform, angle_deg, inverse, rigid
from recon.pose.tracker import REGISTRATIONS, Tracker
from sensor.arguments import ending_in_a_sentence
from sensor.dataset import read_dataset
from sensor.design import STANDARD
from sensor.files import write_atomic
from simulation.camera import expose, photograph
from simulation.dataset import Dent, Recipe, around, bands, set_in, trace_part
from simulation.engine import best_engine
from simulation.presses import PAINT_MM
from simulation.render import Radiance, smoothed
from simulation.skin import pressed
from validation.datasets import dataset_folder

RADIUS_MM, PRESS_MM, TEXTURE_MM = 4.0, 0.8, 0.04
STEP_DEG, TURN_DEG = 2.5, 360.0
STEP_MM = 0.75
FARTHEST_MM = {"across": 4.5, "along": 7.5}
"""Either side of the middle: nearer to the frame's border than that, it cuts the contact off."""
SAMPLES, SEED = 64, 0
BLANK = "background.jpg"


def poses(way: str) -> list[Transform]:
    """``T_gel_bead`` at every step of a way, of a bead that is pressed in the pad's middle."""
    return rolled() if way == "round" else carried(way)


def carried(way: str) -> list[Transform]:
    """Over the pad, pressed in as deep everywhere."""
    far_mm = FARTHEST_MM[way]
    steps_mm = np.arange(-far_mm, far_mm + STEP_MM / 2, STEP_MM)
    x_mm, y_mm = (steps_mm * (way == name) for name in ("along", "across"))
    fallen_mm, _ = rest_at(STANDARD.gel, x_mm, y_mm)
    return [rigid(np.eye(3), shift) for shift in np.stack([x_mm, y_mm, -fallen_mm], -1)]


def rolled() -> list[Transform]:
    """Round at the pad's middle; the first is the identity."""
    center = np.array([0, 0, RADIUS_MM - PRESS_MM])
    angles = np.radians(np.arange(0, TURN_DEG + STEP_DEG / 2, STEP_DEG))
    turns = Rotation.from_rotvec(angles[:, None] * [0, 1, 0]).as_matrix()
    return [rigid(turn, center - turn @ center) for turn in turns]


def render(folder: Path, way: str) -> Iterator[str]:
    """Trace the blank gel and every step into a folder of JPEG frames; the names as they come.

    Raises:
        WedgeError: Mitsuba is not installed.
    """
    recipe = Recipe(engine=best_engine(), design=STANDARD, samples=SAMPLES, seed=SEED)
    view = recipe.view
    rest = np.zeros(view.size_px[::-1], np.float32)
    blank: Radiance = np.concatenate([trace_part(recipe, rest, window) for window in bands(view)])
    untouched = smoothed(blank, view.mm_per_px[0], rest, None)
    camera = expose(untouched)
    write_atomic(folder / BLANK, photograph(untouched, camera, SEED))
    thing: Thing = bead(RADIUS_MM, PRESS_MM, TEXTURE_MM)
    lattice = np.stack(view.grid_mm, -1)
    rest_mm, _ = rest_at(STANDARD.gel, *view.grid_mm)
    for index, pose in enumerate(poses(way)):
        path = folder / f"step_{index:03d}.jpg"
        if not path.is_file():
            surface_mm, _ = lowest_surface(thing, pose, lattice)
            skin = pressed(view, STANDARD.gel, -surface_mm - rest_mm, PAINT_MM)
            depth = skin.depth_mm.astype(np.float32)
            dent = Dent(window=around(view, depth), depth_mm=depth, truth_mm=depth, circle_px=None)
            traced = trace_part(recipe, depth, dent.window)
            write_atomic(
                path, photograph(set_in(blank, recipe, dent, traced), camera, SEED + 1 + index)
            )
        yield path.name


def followed(folder: Path, way: str) -> Mapping[str, Sequence[float]]:
    """Degrees by which each tracker is off at every step; NaN where lost.

    All lay touches on the standard's gel but one, which takes it for flat. The unit is calibrated
    by the default estimator on the twin's ball presses.

    Raises:
        WedgeError: a frame is missing, or a tracker's library is not installed.
    """
    unit = unit_of_set(read_dataset(dataset_folder("twin-standard")), "default")
    reconstruct = Reconstructor(unit, read_image(folder / BLANK))
    first, *_ = steps = poses(way)
    running = {name: Tracker(name, None, first, STANDARD.gel) for name in REGISTRATIONS}
    running["joint, gel taken for flat"] = Tracker("joint", None, first)
    errors: dict[str, list[float]] = {name: [] for name in running}
    for index, pose in enumerate(steps):
        touch = reconstruct(read_image(folder / f"step_{index:03d}.jpg"))
        for name, track in running.items():
            found = track(touch).T_sensor_object
            errors[name].append(np.nan if found is None else angle_deg(inverse(pose) @ found))
    return errors


def main() -> None:
    """Trace the frames, follow them and print how far off poses are."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.rolling", description=__doc__)
    parser.add_argument("folder", type=Path, help="for the frames")
    parser.add_argument("--way", choices=("round", *FARTHEST_MM), default="round")
    options = parser.parse_args()
    with ending_in_a_sentence(parser):
        for name in render(options.folder, options.way):
            print(name, end="\r", flush=True)
        found = followed(options.folder, options.way)
    for name, errors in found.items():
        before = errors[round(7 / 8 * (len(errors) - 1))]
        print(
            f"{name}: {before:.2f} deg off after 7/8 of the way, {errors[-1]:.2f} at its end, "
            f"{np.nanmax(errors):.2f} at most, lost in {np.isnan(errors).sum()} of {len(errors)}"
        )


if __name__ == "__main__":
    main()
