# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A design's field against the gradient error and the lit area that its twin predicts.

Each value is a set of ball presses, rendered into a folder named by everything that decides it; so
what an earlier sweep has rendered is used again, whole or in part.
"""

import difflib
import hashlib
import json
import shutil
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy
import PIL
import scipy

import sensor
import simulation
from recon.calibration import lit_channels
from recon.lights import Axis, unseen_axis
from recon.presses import LEAST_RADIUS_PX, read_presses
from sensor.dataset import CARD_FILE, LENS_FILE, read_dataset
from sensor.design import Wedge
from sensor.errors import WedgeError
from sensor.files import new_folder, sha256_of_files
from simulation.dataset import Recipe, dent_of, label_of, presses_of, write_set
from simulation.engine import Engine
from simulation.lens import lens_text
from simulation.presses import Press
from validation.error_table import Row
from validation.evaluation import hold_out
from validation.lighting import lit_area

LIT_SIDES = "lights.lit_sides"
"""Not a field of the design: the colours that stay lit, such as RG."""
SIDES = {"R": "red_side_leds", "G": "green_base_leds", "B": "blue_side_leds"}
SEEN_OVER_THE_MIRROR = ("mirror", "camera")
"""Parts that change the camera's own frame alone; sweeps over them render raw frames."""
NOT_SEEN = {
    "acrylic": ("tip_offset_mm",),  # moves the view over the mirror alone
    "camera": (
        "frames_per_second",
        "head_size_mm",
        "head_depth_mm",
        "barrel_diameter_mm",
        "barrel_length_mm",
    ),
    "gel": (),
    "lights": ("led_height_mm",),
    "mirror": ("thickness_mm",),
}
"""Of the parts that the twin looks at, the fields that it never does."""
OF_A_DOME = ("gel.semi_axis_across_mm", "gel.semi_axis_normal_mm", "gel.semi_axis_along_mm")
OF_BARE_LEDS = ("lights.led_length_mm", "lights.backing_thickness_mm")
"""Behind a diffuser their row is one lamp, on the acrylic whatever is behind."""
SEEN_BESIDES = ("wiring.led_pitch_mm",)
LIBRARIES = (numpy, scipy, cv2, PIL)
"""That the twin computes dents, noise and JPEGs with, besides Mitsuba."""
LEAST_PRESSES = 2
"""That a split needs: one to learn from, one to judge."""
Progress = Callable[[float, str], None]


@dataclass(frozen=True, kw_only=True)
class SweepSize:
    """How much is rendered for each value."""

    presses: int = 20
    samples: int = 64
    width_px: int = 160
    seed: int = 0


@dataclass(frozen=True, kw_only=True)
class SweepPoint:
    """What one value predicts."""

    value: str
    row: Row
    """Held-out gradient errors, contact pixels with 5 % of the others."""
    contact: Row
    """The same, contact pixels alone."""
    lit_area: float
    presses: tuple[int, int]
    """Learnt from, judged."""
    inferred: Axis | None
    """The axis whose slope no light shows; ``None`` where both are measured."""


def varied(design: Wedge, field: str, value: str) -> Wedge:
    """The design with one number changed.

    Args:
        design: the one to start from.
        field: part and name, such as ``mirror.angle_deg``; ``lights.lit_sides`` takes colours.
        value: as typed.

    Raises:
        WedgeError: there is no such field, the twin does not look at it, or the value cannot work.
    """
    if field == LIT_SIDES:
        if not value or set(value) - set(SIDES) or len(set(value)) < len(value):
            raise WedgeError(f"{LIT_SIDES} = {value!r} must be some of the letters R, G and B.")
        named = [SIDES[color] for color in value]
        if unlit := [name for name in named if not getattr(design.lights, name)]:
            raise WedgeError(
                f"{LIT_SIDES} = {value!r} cannot stay lit: the design has lights.{unlit[0]} = 0; "
                "leave that colour out."
            )
        dark: dict[str, Any] = {name: 0 for color, name in SIDES.items() if color not in value}
        return replace(design, lights=replace(design.lights, **dark))
    refuse_field(design, field)
    name, _, key = field.partition(".")
    part: Any = getattr(design, name)
    number = _parsed(field, value, getattr(part, key))
    changed: Wedge = replace(design, **{name: replace(part, **{key: number})})
    return changed


def refuse_field(design: Wedge, field: str) -> None:
    """Refuse what is no field, or none that the twin looks at, whatever its value.

    Raises:
        WedgeError: says which, and the field whose name is nearest.
    """
    if field == LIT_SIDES:
        return
    parts = {part.name: getattr(design, part.name) for part in fields(design)}
    known = [
        f"{name}.{item.name}"
        for name, part in parts.items()
        if is_dataclass(part)
        for item in fields(part)
    ]
    if field not in known:
        near = difflib.get_close_matches(field, [*known, LIT_SIDES], n=1)
        hint = (
            f"did you mean {near[0]}?"
            if near
            else f"name a part and its field, such as mirror.angle_deg, or {LIT_SIDES}."
        )
        raise WedgeError(f"there is no field {field!r} to vary: {hint}")
    if unseen := _unseen(design, field):
        raise WedgeError(f"the twin {unseen} {field}: all values would give the same result.")


def _unseen(design: Wedge, field: str) -> str:
    """How the twin of this design passes over a field; nothing where it is seen."""
    name, _, key = field.partition(".")
    if (name not in NOT_SEEN or key in NOT_SEEN[name]) and field not in SEEN_BESIDES:
        return "does not use"
    if field in OF_A_DOME and not design.gel.curved:
        return "of a flat gel (gel.curved = false) does not use"
    if field in OF_BARE_LEDS and design.lights.diffuser:
        return "of LEDs behind a diffuser (lights.diffuser = true) does not use"
    return ""


def sweep(
    designs: Sequence[tuple[str, Wedge]],
    *,
    field: str,
    folder: Path,
    size: SweepSize,
    engine: Engine,
    executor: Executor,
    progress: Progress = lambda _share, _what: None,
) -> list[SweepPoint]:
    """Render and judge each design.

    Args:
        designs: values as typed, with the designs that they give.
        field: that the values are of.
        folder: for the rendered sets, which later sweeps use again.
        size: of each set.
        engine: that renders; one for all, so that numbers can be compared.
        executor: renders the presses; the numbers do not depend on which.
        progress: called after every press.

    Raises:
        WedgeError: a value's presses cannot be, or too few of them could be judged, which is told
            before anything is rendered; a set cannot be rendered, written or judged.
    """
    planned = []
    for value, design in designs:
        recipe = Recipe(
            engine=engine,
            design=design,
            width_px=size.width_px,
            samples=size.samples,
            seed=size.seed,
            raw=field.partition(".")[0] in SEEN_OVER_THE_MIRROR,
        )
        try:
            planned.append((value, recipe, planned_presses(recipe, size)))
        except WedgeError as error:
            raise WedgeError(f"{field} = {value}: {error}") from error
    points = []
    for index, (value, recipe, presses) in enumerate(planned):

        def show(share: float, what: str, start: int = index, at: str = value) -> None:
            progress((start + share) / len(planned), f"{field} = {at}: {what}")

        rendered = _rendered(folder, recipe, presses, executor, show)
        points.append(_judged(rendered, value, size.seed))
    return points


def planned_presses(recipe: Recipe, size: SweepSize) -> list[Press]:
    """The presses of a set, of which enough for a split show a contact that can be used.

    Raises:
        WedgeError: a press cannot be, or too few contacts are wide enough.
    """
    presses = presses_of(
        recipe.design, "balls", count=size.presses, seed=size.seed, width_px=size.width_px
    )
    radii_px = [
        label_of(press.name, circle_px).contact_radius_px
        for press in presses
        if (circle_px := dent_of(recipe, press).circle_px)
    ]
    usable = sum(radius_px >= LEAST_RADIUS_PX for radius_px in radii_px)
    if usable < LEAST_PRESSES:
        raise WedgeError(
            f"only {usable} of {len(presses)} contacts would have a radius of {LEAST_RADIUS_PX:g} "
            f"pixels or more (the widest: {max(radii_px):.2f}), too few to train and to test: raise"
            f" --width-px above {recipe.width_px}, or take more presses."
        )
    return presses


def key_of(recipe: Recipe, presses: int) -> str:
    """Hash of everything that decides a rendered set, libraries and our code included."""
    floors = (Path(floor.__path__[0]) for floor in (sensor, simulation))
    code = {f"{path.parent.name}/{path.name}": path for at in floors for path in at.glob("*.py")}
    decides = {
        "design": recipe.design.sha256,
        "variant": recipe.engine.variant,
        "mitsuba": recipe.engine.mitsuba,
        "libraries": [library.__version__ for library in LIBRARIES],
        "width_px": recipe.width_px,
        "samples": recipe.samples,
        "seed": recipe.seed,
        "raw": recipe.raw,
        "presses": presses,
        "code": sha256_of_files(code),
    }
    return hashlib.sha256(json.dumps(decides, sort_keys=True).encode()).hexdigest()[:16]


def _parsed(field: str, text: str, current: object) -> object:
    try:
        if isinstance(current, bool):
            return {"true": True, "false": False}[text.lower()]
        if isinstance(current, int):
            return int(text)
        return float(text) if isinstance(current, float) else text
    except (KeyError, ValueError) as error:
        wanted = {bool: "true or false", int: "a whole number"}
        kind = next((words for kind, words in wanted.items() if isinstance(current, kind)), "")
        raise WedgeError(f"{field} = {text!r} must be {kind or 'a number'}.") from error


def _rendered(
    folder: Path,
    recipe: Recipe,
    presses: Sequence[Press],
    executor: Executor,
    progress: Progress,
) -> Path:
    key = key_of(recipe, len(presses))
    made, keep = folder / "sets" / key, folder / "parts" / key
    if _is_whole(made, recipe):
        return made
    shutil.rmtree(made, ignore_errors=True)  # it has lost a file since: rendered again
    with new_folder(made, alike=CARD_FILE) as draft:
        write_set(
            draft,
            recipe,
            presses,
            source=f"wedge sweep, {len(presses)} presses at {recipe.samples} samples",
            executor=executor,
            truth="shapes",
            keep=keep,
            progress=progress,
        )
    shutil.rmtree(keep, ignore_errors=True)
    return made


def _is_whole(folder: Path, recipe: Recipe) -> bool:
    """Whether a set is there with all its frames, and with its lens where it has one."""
    try:
        dataset = read_dataset(folder)
    except WedgeError:
        return False
    files = [*dataset.card.background, *(label.file for label in dataset.labels)]
    if recipe.raw and lens_text(recipe.design):
        files.append(LENS_FILE)  # without which corners would be undone by another lens
    return all((folder / file).is_file() for file in files)


def _judged(folder: Path, value: str, seed: int) -> SweepPoint:
    dataset = read_dataset(folder)
    presses = read_presses(dataset)
    table = hold_out(dataset, presses, "mlp", seed=seed)
    channels, _ = lit_channels(dataset)
    row, contact = (
        next(row for row in table.rows if row.pixels == pixels)
        for pixels in ("contact+5%", "contact")
    )
    return SweepPoint(
        value=value,
        row=row,
        contact=contact,
        lit_area=lit_area(presses.unwarp(presses.background), channels),
        presses=(table.train, table.test),
        inferred=unseen_axis(dataset.card.lights_deg, channels),
    )
