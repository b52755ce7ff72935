# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge simulate`: a design's frames, path-traced, as a dataset with ground truth."""

import shlex
import sys
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from app._output import command_line
from app._progress import progress
from app._render_refusals import refuse_numbers, refuse_unbuildable
from app._seed import Seed
from app._workers import process_pool
from sensor.dataset import read_dataset
from sensor.design import Wedge
from sensor.design_file import load_design
from sensor.errors import WedgeError
from sensor.files import new_folder

if TYPE_CHECKING:
    from simulation.dataset import Recipe
    from simulation.indenters import Indenter

PRESSES = 40
HASH_DIGITS = 8
"""Of a file's hash: as many as the case's roof shows of a design's."""


def main(
    out: Path,
    design: str = "standard",
    scene: str = "balls",
    presses: int | None = None,
    samples: int = 256,
    width_px: int = 320,
    ball_radius_mm: float = 2.4,
    depth_mm: float | None = None,
    off_center: float = 0.0,
    paint: Literal["gray", "silver"] = "gray",
    markers: bool = False,
    view: Literal["gel", "raw"] = "gel",
    baffle: bool = True,
    truth: Literal["all", "shapes"] = "all",
    seed: Seed = 0,
) -> None:
    """Render what the camera of a sensor will see, before anybody builds it.

    Light is traced from the LEDs through film, acrylic and gel to the painted skin, which follows
    the shape of the pressed object; a camera model makes JPEG frames of it. OUT becomes a dataset
    folder like any other, named after its folder: `wedge table OUT` gives the expected gradient
    error. truth/ holds the depth of the skin.

    With libLLVM 16 or later on the machine, rendering is several times faster; with an NVIDIA GPU,
    faster still.

    Example: wedge simulate --design finger --scene balls --out build/finger-balls

    Args:
        out: The folder to write; new or empty.
        design: standard, finger, or a TOML file that changes some numbers of one of them.
        scene: balls (labelled presses of the calibration ball), shapes (each showcase object
            once), set (both), tools (18 plain objects, most with flat tops, each at two depths),
            one of them: ball_array, lego, screw_cap, m2_screw, tyre, cube_corner, prism, threads,
            disc_shallow, disc_deep, ...; or your own part as STL, PLY or OBJ, in mm. Its lowest
            side is pressed in, with its x along the frame's columns and its z away from the gel.
        presses: Ball presses, spread over the pad; 40 unless given.
        samples: Light paths per pixel, rounded up to rows and columns of them (32 to 35); twice as
            many take twice as long and leave less noise.
        width_px: Pixels along the pad.
        ball_radius_mm: Radius of the calibration ball.
        depth_mm: Press everything this deep below the gel in its middle, instead of each ball at a
            random depth and each other object at its own, your part at 0.5 mm. On a curved gel, an
            edge of a flat object may go in deeper, or its face not touch.
        off_center: Press each shape, tool or part four times, toward the pad's corners, by this
            share of the available distance (0 to 1), instead of once in its middle.
        paint: gray is matt; silver is semi-specular and can only be seen straight on.
        markers: Print a lattice of dots on the skin.
        view: gel shows the pad straight on; raw is the camera's own frame, over the mirror, which
            the corners in dataset.toml and the lens in camera.toml unwarp.
        baffle: Hide from raw frames what the camera sees past the mirror, as the printed case does.
        truth: all keeps the depth of every frame; shapes leaves out that of balls.
        seed: Seed for places, depths, light paths and camera noise.
    """
    wanted = load_design(design)
    refuse_unbuildable(wanted)
    refuse_numbers(width_px, samples)
    from simulation.dataset import WITH_BALLS, Recipe, presses_of, write_set
    from simulation.engine import best_engine

    planned = presses_of(
        wanted,
        _part(scene, depth_mm) if Path(scene).suffix else scene,
        count=PRESSES if presses is None else presses,
        seed=seed,
        width_px=width_px,
        ball_radius_mm=ball_radius_mm,
        depth_mm=depth_mm,
        off_center=off_center,
    )
    if presses is not None and scene not in WITH_BALLS:
        raise WedgeError(f"--presses counts balls, and the scene {scene} has none: leave it out.")
    recipe = Recipe(
        engine=best_engine(),
        design=wanted,
        width_px=width_px,
        samples=samples,
        seed=seed,
        paint=paint,
        markers=markers,
        raw=view == "raw",
        baffle=baffle,
    )
    with (
        new_folder(out) as folder,
        process_pool() as executor,
        progress(f"twin of {wanted.name}") as show,
    ):
        show(0.0, "the untouched gel")
        write_set(
            folder,
            recipe,
            planned,
            source=_source(wanted, design, scene),
            executor=executor,
            truth=truth,
            set_name=out.resolve().name,
            progress=show,
        )
    _tell(recipe, len(planned), out)


def _tell(recipe: "Recipe", presses: int, out: Path) -> None:
    """Say what was rendered, and what to do with it where it holds balls enough."""
    from recon.presses import LEAST_RADIUS_PX
    from simulation.render import drawn_samples

    labels = read_dataset(out).labels
    balls, others = len(labels), presses - len(labels)
    usable = sum(label.contact_radius_px >= LEAST_RADIUS_PX for label in labels)
    drawn = drawn_samples(recipe.samples)
    print(
        f"{balls} labelled press{'' if balls == 1 else 'es'}, "
        f"{others} {'shape with its' if others == 1 else 'shapes with their'} truth: {out}\n"
        f"{recipe.engine.variant}, {drawn} sample{'' if drawn == 1 else 's'} per pixel, "
        f"design {recipe.design.name}."
        + (f" Next: {command_line('table', out)}" if usable > 1 else "")
    )


def _part(path: str, depth_mm: float | None) -> "Indenter":
    """What a mesh presses in."""
    from recon.pose.mesh import read_mesh
    from simulation.meshes import PART_DEPTH_MM, part_of

    mesh = read_mesh(Path(path))
    corners_mm = mesh.vertices_mm[mesh.triangles]
    return part_of(corners_mm, PART_DEPTH_MM if depth_mm is None else depth_mm)


def _source(wanted: Wedge, design: str, scene: str) -> str:
    """The command that makes the set again; files go by their names and hashes.

    Args:
        wanted: the design.
        design: as it was typed.
        scene: as it was typed.
    """
    files = {}
    if design.endswith(".toml"):
        files["design"] = design, wanted.sha256
    if Path(scene).suffix:
        files["scene"] = scene, sha256(Path(scene).read_bytes()).hexdigest()
    by_name = {
        option + typed: option + Path(typed).name
        for name, (typed, _) in files.items()
        for option in ("", f"--{name}=")
    }
    words, kept = (word for word in sys.argv[1:] if word), []
    for word in words:
        if word == "--out":
            next(words, None)  # the folder
        elif not word.startswith("--out="):
            kept.append(by_name.get(word, word))
    made_of = [f", of the {name} {digest[:HASH_DIGITS]}" for name, (_, digest) in files.items()]
    is_typed = kept[:1] == ["simulate"]
    command = "wedge " + shlex.join(kept) if is_typed else f"design {wanted.name}"
    return command + "".join(made_of)
