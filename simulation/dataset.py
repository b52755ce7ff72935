# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Presses of a design, rendered and photographed into a dataset folder."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, as_completed
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Final, Literal

import numpy as np
from jaxtyping import Float32
from scipy import ndimage

from sensor.dataset import (
    CARD_FILE,
    LABELS_FILE,
    LENS_FILE,
    BallLabel,
    DatasetCard,
    write_card,
    write_labels,
)
from sensor.design import Wedge
from sensor.errors import WedgeError
from sensor.files import write_atomic
from simulation.camera import expose, photograph
from simulation.engine import Engine
from simulation.indenters import CALIBRATION_BALL_MM, Indenter, calibration_ball, shapes
from simulation.kept import Kept
from simulation.lens import lens_text
from simulation.presses import (
    Press,
    ball_presses,
    contact_circle_px,
    marker_ink,
    placed_presses,
    reach_under,
    skin_under,
    told_of,
)
from simulation.raw_view import corners_px, raw_frame, unwarped_skin
from simulation.render import Radiance, render, smoothed
from simulation.scene import Paint, Window
from simulation.skin import Map, View, gel_view
from simulation.tools import DEPTHS_MM, TOOLS, tools

Truth = Literal["all", "shapes"]
WITH_BALLS: Final = ("balls", "set")
"""Scenes that have presses of the calibration ball."""
Progress = Callable[[float, str], None]
BACKGROUNDS: Final = 4
BANDS: Final = 4
REACH_MM: Final = 4.0
"""How far beside a dent its shadows and reflections reach."""
LICENCE: Final = "CC-BY-4.0"


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """What every frame of a set shares."""

    engine: Engine
    design: Wedge
    width_px: int = 320
    samples: int = 256
    seed: int = 0
    paint: Paint = "gray"
    markers: bool = False
    cover_mm: float = 0.0
    """Thickness of a glove over the paint."""
    raw: bool = False
    """Frames as the camera has them, over the mirror, instead of the gel straight on; the set then
    has a ``camera.toml``."""
    baffle: bool = True
    """Hides from raw frames what the camera sees past the mirror, as the printed case does."""

    def __post_init__(self) -> None:
        """Check that what is asked for can be rendered.

        Raises:
            WedgeError: silver paint is to be seen over the mirror, or a baffle to be left out of
                frames straight on.
        """
        if not self.baffle and not self.raw:
            raise WedgeError(
                "only raw frames show what a baffle hides: take --view raw with --no-baffle."
            )
        if self.raw and self.paint == "silver":
            raise WedgeError(
                "the twin renders silver paint only straight on, and via the mirror it looks "
                "different: take --paint gray, or --view gel."
            )

    @property
    def view(self) -> View:
        """The pixels."""
        return gel_view(self.design, self.width_px)

    @property
    def ink(self) -> Map | None:
        """The markers, where there are any."""
        return marker_ink(self.view) if self.markers else None


@dataclass(frozen=True, kw_only=True)
class Dent:
    """What a press does to the skin, and the part of the picture that it changes."""

    window: Window
    """Farther than ``REACH_MM`` from the dent the light is that of the untouched gel."""
    depth_mm: Float32[np.ndarray, "h w"]
    truth_mm: Float32[np.ndarray, "h w"]
    """The depth that each pixel of the frame shows, once unwarped where it is raw."""
    circle_px: tuple[float, float, float] | None
    """Centre and radius of a round contact in these pixels."""


def dent_of(recipe: Recipe, press: Press) -> Dent:
    """The dent that a press leaves."""
    view = recipe.view
    skin = skin_under(recipe.design, view, press, cover_mm=recipe.cover_mm)
    seen = unwarped_skin(recipe.design, view, skin, lens_undone=True) if recipe.raw else skin
    with told_of(press):
        circle_px = contact_circle_px(seen) if press.indenter.round_mm > 0 else None
    return Dent(
        window=around(view, skin.depth_mm),
        depth_mm=skin.depth_mm.astype(np.float32),
        truth_mm=seen.depth_mm.astype(np.float32),
        circle_px=circle_px,
    )


def trace_press(recipe: Recipe, press: Press) -> Radiance:
    """Render the part of the picture that a press changes, on one of the executor's processors."""
    dent = dent_of(recipe, press)
    return trace_part(recipe, dent.depth_mm, dent.window, threads=1)


def trace_part(
    recipe: Recipe, depth_mm: Map, window: Window, threads: int | None = None
) -> Radiance:
    """A part of the picture, as traced; by all processors unless told how many."""
    return render(
        recipe.engine,
        recipe.design,
        recipe.view,
        depth_mm,
        samples=recipe.samples,
        seed=recipe.seed,
        window=window,
        paint=recipe.paint,
        ink=recipe.ink,
        threads=threads,
    )


def set_in(blank: Radiance, recipe: Recipe, dent: Dent, traced: Radiance) -> Radiance:
    """A traced window in the untouched gel as traced, both smoothed; they blend at its edge.

    Farther than ``REACH_MM`` from the dent, the untouched gel remains.
    """
    columns, rows = dent.window
    pitch = recipe.view.mm_per_px[0]
    whole = blank.copy()
    whole[rows, columns] = traced
    away_mm = pitch * ndimage.distance_transform_edt(dent.depth_mm == 0)
    share = np.clip(2 - 2 * away_mm / REACH_MM, 0, 1)[..., None].astype(np.float32)
    pressed = smoothed(whole, pitch, dent.depth_mm, recipe.ink)
    rest = smoothed(blank, pitch, np.zeros_like(dent.depth_mm), recipe.ink)
    return share * pressed + (1 - share) * rest


def bands(view: View) -> list[Window]:
    """The picture in horizontal bands, for rendering side by side."""
    width, height = view.size_px
    edges = np.linspace(0, height, BANDS + 1).round().astype(int).tolist()
    return [(slice(0, width), slice(low, high)) for low, high in pairwise(edges) if low < high]


def around(view: View, depth_mm: Map) -> Window:
    """The window that a dent changes."""
    reach = round(REACH_MM / view.mm_per_px[0])
    rows, columns = np.nonzero(depth_mm > 0)
    (width, height) = view.size_px
    return (
        slice(max(0, int(columns.min()) - reach), min(width, int(columns.max()) + reach + 1)),
        slice(max(0, int(rows.min()) - reach), min(height, int(rows.max()) + reach + 1)),
    )


def presses_of(
    design: Wedge,
    scene: str | Indenter,
    *,
    count: int,
    seed: int,
    width_px: int = Recipe.width_px,
    ball_radius_mm: float = CALIBRATION_BALL_MM,
    depth_mm: float | None = None,
    off_center: float = 0.0,
) -> list[Press]:
    """The presses of a scene.

    Args:
        design: the sensor.
        scene: "balls", "shapes", "set" (both), "tools", the name of one shape or tool, or a thing
            of one's own.
        count: of ball presses.
        seed: of their places and depths.
        width_px: of the frames, whose pixels each press has to reach.
        ball_radius_mm: of the calibration ball.
        depth_mm: of every press, instead of the ball's random and the shapes' own depths.
        off_center: of all but balls, as ``placed_presses`` has it.

    Raises:
        WedgeError: the scene is unknown, or a press cannot be.
    """
    showcase, plain = shapes(design.pad_size_mm), tools(design.pad_size_mm)
    known = {**showcase, **plain}
    if isinstance(scene, Indenter):
        known, scene = {scene.name: scene}, scene.name
    if scene not in ("balls", "shapes", "set", "tools", *known):
        raise WedgeError(
            f"there is no scene {scene!r}: take balls, shapes, set (both), tools, one of "
            f"{', '.join(showcase)}, one of {', '.join(TOOLS)} followed by"
            f" _{' or _'.join(DEPTHS_MM)}, or a mesh in mm (.stl, .ply, .obj)."
        )
    if off_center and scene == "balls":
        raise WedgeError(
            "--off-center moves shapes and tools; balls cover the pad anyway: leave it out."
        )
    presses: list[Press] = []
    if scene in WITH_BALLS:
        presses += ball_presses(design, calibration_ball(ball_radius_mm), count, seed)
    of_scene = {"shapes": showcase, "set": showcase, "tools": plain, "balls": ()}
    for name in of_scene.get(scene, (scene,)):
        presses += placed_presses(design, known[name], off_center)
    if depth_mm is not None:
        presses = [replace(press, depth_mm=depth_mm) for press in presses]
    view = gel_view(design, width_px)
    for press in presses:
        reach_under(design, view, press)  # refuses now what could not be pressed in minutes
    return presses


def write_set(
    folder: Path,
    recipe: Recipe,
    presses: Sequence[Press],
    *,
    source: str,
    executor: Executor,
    truth: Truth = "all",
    keep: Path | None = None,
    set_name: str | None = None,
    progress: Progress = lambda _share, _what: None,
) -> None:
    """Render presses into an empty folder.

    Args:
        folder: exists and is empty.
        recipe: design, size, samples and seed.
        presses: balls are labelled, other shapes are frames with a truth.
        source: one line for the card: how the set came about.
        executor: renders the frames; the set does not depend on which.
        truth: depth maps of all frames, or of the shapes alone, whose form is not closed.
        keep: a folder for traced parts; what an interrupted run left there is not traced again.
        set_name: by default the twin's and the design's.
        progress: called after every frame.

    Raises:
        WedgeError: a press cannot be, or a file cannot be written.
    """
    kept = Kept(keep)
    rest = np.zeros(recipe.view.size_px[::-1])
    parts = {
        f"background_{index}": partial(trace_part, recipe, rest, window, threads=1)
        for index, window in enumerate(bands(recipe.view))
    }
    shots = {press.name: partial(trace_press, recipe, press) for press in presses}
    started = {
        name: kept.started(executor, name, task) for name, task in {**parts, **shots}.items()
    }
    names = {started[name]: (index, name) for index, name in enumerate(shots)}
    labels = []
    try:
        blank = np.concatenate([kept.result(name, started[name]) for name in parts])
        untouched = smoothed(blank, recipe.view.mm_per_px[0], rest, recipe.ink)
        camera = expose(untouched)
        bare = seen_by_camera(recipe, untouched, rest)
        for index in range(BACKGROUNDS):
            content = photograph(bare, camera, _noise_seed(recipe, -1 - index))
            (folder / f"background_{index}.jpg").write_bytes(content)
        for done, future in enumerate(as_completed(names), start=1):
            index, name = names[future]
            dent = dent_of(recipe, presses[index])
            radiance = set_in(blank, recipe, dent, kept.result(name, future))
            frame = seen_by_camera(recipe, radiance, dent.depth_mm)
            content = photograph(frame, camera, _noise_seed(recipe, index))
            (folder / f"{name}.jpg").write_bytes(content)
            if truth == "all" or dent.circle_px is None:
                (folder / "truth").mkdir(exist_ok=True)
                np.save(folder / "truth" / f"{name}.npy", dent.truth_mm)
            if dent.circle_px is not None:
                labels.append(label_of(f"{name}.jpg", dent.circle_px))
            progress(done / len(names), name)
    except BaseException:
        for future in started.values():
            future.cancel()
        raise
    lens = lens_text(recipe.design) if recipe.raw else None
    if lens:
        write_atomic(folder / LENS_FILE, lens.encode())
    write_labels(folder / LABELS_FILE, sorted(labels, key=lambda label: label.file))
    name = set_name or f"twin-{recipe.design.name}"
    write_card(folder / CARD_FILE, _card(recipe, presses, name, source))


def _card(recipe: Recipe, presses: Sequence[Press], name: str, source: str) -> DatasetCard:
    balls = [press.indenter.round_mm for press in presses if press.indenter.round_mm]
    return DatasetCard(
        name=name,
        source=source,
        licence=LICENCE,
        mm_per_px=recipe.view.mm_per_px,
        ball_radius_mm=balls[0] if balls else CALIBRATION_BALL_MM,
        background=tuple(f"background_{index}.jpg" for index in range(BACKGROUNDS)),
        corners_px=corners_px(recipe.design, recipe.view.size_mm) if recipe.raw else None,
        pad_size_mm=recipe.view.size_mm if recipe.raw else None,
        lights_deg={str(k): v for k, v in recipe.design.lights.azimuths_deg.items()},
    )


def seen_by_camera(recipe: Recipe, radiance: Radiance, depth_mm: Map) -> Radiance:
    """The radiance as the recipe's frames show it."""
    if not recipe.raw:
        return radiance
    return raw_frame(recipe.design, recipe.view, radiance, depth_mm, baffle=recipe.baffle)


def label_of(file: str, circle_px: tuple[float, float, float]) -> BallLabel:
    """The label of a round contact in a frame, from the circle's centre and radius."""
    x_px, y_px, radius_px = (round(value, 3) for value in circle_px)
    return BallLabel(file=file, center_x_px=x_px, center_y_px=y_px, contact_radius_px=radius_px)


def _noise_seed(recipe: Recipe, index: int) -> int:
    """A seed for each frame's own noise."""
    return int(np.random.SeedSequence([recipe.seed, index + BACKGROUNDS]).generate_state(1)[0])
