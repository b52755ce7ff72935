# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Whether the doubt of an inferred slope is where its error is, and as large.

    python -m benchmarks.doubt --sensor BALLS SET --json doubt.json

Balls in closed form, random surfaces as random sensors measure them, and the twins' shapes as
estimators read them that all balls taught; with --sensor also the presses of a set that
``benchmarks.rendered_presses`` made for the sensor of those balls. All but the balls are judged
where the gel may have moved. Figures are of all pixels of a row together; beside them stands what
they come to on each ball, surface, shape or press alone.
"""

import argparse
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import cycle
from pathlib import Path

import numpy as np
from jaxtyping import Float

from recon.depth import infer_gradient
from recon.estimators import GradientEstimator, gradient_field
from recon.integration.pressed import Support
from recon.missing_axis.columns import weigh_columns
from recon.missing_axis.inference import Completed, infer_missing_axis
from recon.pipeline import disturbed_in
from recon.presses import read_presses
from recon.rendered_presses import RenderedPress, rendered_presses
from recon.training.contact_surfaces import surface_gradient
from recon.training.few_lights import measure
from recon.training.random_balls import SQUARE, random_ball
from recon.training.random_surfaces import RECIPES
from sensor.arguments import ending_in_a_sentence
from sensor.dataset import read_dataset
from sensor.errors import WedgeError
from sensor.files import check_outputs, write_json
from validation.datasets import dataset_folder
from validation.folds import fit_presses

TWINS = ("twin-standard", "twin-finger")
SHAPES_BY = (("default", "RB"), ("default", "R"), ("mlp", "R"))
OBJECTS_BY = (("default", "RB"), ("default", "R"), ("mlp", "RB"), ("mlp", "R"))
"""Estimators and lights, the next for the next press."""
SEED, SLOPE_NOISE = 0, 0.04
BALLS, SURFACES = 60, 48
BALL_FRAME_PX, SURFACE_PX = (160, 120), (96, 128)
PAPER_SHARE = 0.3  # of the surfaces, as in training
LEAST_PX = 200
"""Of gel that may have moved: of less there is nothing to tell."""

Range = tuple[float, float]
"""Least and most."""
Judged = tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]
"""Absolute errors and doubts of the inferred slope, mm/mm."""


@dataclass(frozen=True, kw_only=True)
class Told:
    """What the doubt tells of the errors on some gradients."""

    gradients: str
    count: int
    largest_tenth_to_smaller_half: float
    """Mean error where the doubt is in its largest tenth, over that in its smaller half."""
    doubt_to_error: float
    """Mean doubt over mean error."""
    rank_of_each: Range
    """The first of these figures, on each gradient field alone."""
    size_of_each: Range
    """The second likewise."""


def told(gradients: str, judged: Iterable[Judged]) -> Told:
    """The figures of all pixels together.

    Raises:
        WedgeError: there is nothing to judge.
    """
    items = list(judged)
    if not items:
        raise WedgeError(f"{gradients}: no frame with its depth in truth/ shows a touch.")
    large = [item for item in items if len(item[0]) >= LEAST_PX] or items
    ranks, sizes = (np.array(figures) for figures in zip(*map(_figures, large), strict=True))
    error, doubt = (np.concatenate(parts) for parts in zip(*items, strict=True))
    rank, size = _figures((error, doubt))
    return Told(
        gradients=gradients,
        count=len(items),
        largest_tenth_to_smaller_half=rank,
        doubt_to_error=size,
        rank_of_each=(float(ranks.min()), float(ranks.max())),
        size_of_each=(float(sizes.min()), float(sizes.max())),
    )


def _figures(judged: Judged) -> tuple[float, float]:
    """How well the doubt ranks the errors, and how large it is beside them."""
    error, doubt = judged
    order = np.argsort(doubt)
    most, least = error[order[-(len(order) // 10) :]], error[order[: len(order) // 2]]
    return float(most.mean() / least.mean()), float(doubt.mean() / error.mean())


def on_balls(count: int) -> Iterator[Judged]:
    """Balls somewhere in the frame, under white noise."""
    rng = np.random.default_rng(SEED)
    for _ in range(count):
        slopes = random_ball(rng, BALL_FRAME_PX).gradient
        known = slopes[..., 1] + SLOPE_NOISE * rng.standard_normal(slopes.shape[:2])
        found = _inferred(known, np.ones(known.shape, bool))
        yield np.abs(found.gradient[..., 0] - slopes[..., 0]).ravel(), found.doubt.ravel()


def on_surfaces(count: int) -> Iterator[Judged]:
    """Random surfaces as random sensors measure them that do not see one axis."""
    rng = np.random.default_rng(SEED)
    while count:
        recipe = RECIPES["paper" if rng.random() < PAPER_SHARE else "contact"]
        slopes = surface_gradient(recipe(rng, *SURFACE_PX))
        seen = measure(rng, slopes)
        if seen.both:
            continue
        found = _inferred(seen.gradient[..., 1], seen.support)
        error = np.abs(found.gradient[..., 0] - slopes[..., 0])
        yield error[seen.support], found.doubt[seen.support]
        count -= 1


def on_presses(
    presses: Iterable[RenderedPress], sensors: Sequence[GradientEstimator]
) -> Iterator[Judged]:
    """Rendered presses, each as the next of the sensors reads it; those that show little are not.

    Args:
        presses: with the skin's true depth.
        sensors: with lights along y.
    """
    for press, sensor in zip(presses, cycle(sensors), strict=False):
        found = infer_gradient(
            gradient_field(sensor, press.difference),
            disturbed_in(press.difference, sensor),
            "x",
            press.mm_per_px,
            hinted=sensor.looks_around,
        )
        if found.support.sum() < LEAST_PX:
            continue
        slope = np.gradient(press.depth_mm, press.mm_per_px[0], axis=1)
        error = np.abs(found.gradient[..., 0] - slope)
        yield error[found.support], found.doubt[found.support]


def _inferred(known: Float[np.ndarray, "h w"], support: Support) -> Completed:
    """What becomes of a y slope where nothing hints at the other."""
    network = infer_missing_axis(known, "x", SQUARE, support=support)
    return weigh_columns(network, known, "x", support, SQUARE)


def calibrated(balls: Path, ways: Sequence[tuple[str, str]]) -> list[GradientEstimator]:
    """Estimators for some lights that all balls of a dataset taught."""
    presses = read_presses(read_dataset(balls)).presses
    return [fit_presses(presses, range(len(presses)), *way, SEED) for way in ways]


def measured(sensors: Sequence[tuple[str, str]]) -> Iterator[Told]:
    """Every row of the table.

    Args:
        sensors: of each a dataset of labelled balls, and one of rendered presses.

    Raises:
        WedgeError: a dataset is not on this machine, cannot be read or shows too little.
    """
    folders = [(dataset_folder(balls), dataset_folder(rendered)) for balls, rendered in sensors]
    yield told("balls in closed form, noise 0.04", on_balls(BALLS))
    yield told("random surfaces", on_surfaces(SURFACES))
    for name in TWINS:
        folder = dataset_folder(name)
        labelled = {Path(label.file).stem for label in read_dataset(folder).labels}
        shapes = [press for press in rendered_presses(folder) if press.name not in labelled]
        for (estimator, lit), sensor in zip(SHAPES_BY, calibrated(folder, SHAPES_BY), strict=True):
            yield told(f"shapes of {name}, {lit}, {estimator}", on_presses(shapes, [sensor]))
    for balls, rendered in folders:
        fitted = calibrated(balls, OBJECTS_BY)
        yield told(f"objects of {rendered.name}", on_presses(rendered_presses(rendered), fitted))


def _line(row: Told) -> str:
    cells = [row.gradients, str(row.count)]
    for figure, (least, most) in (
        (row.largest_tenth_to_smaller_half, row.rank_of_each),
        (row.doubt_to_error, row.size_of_each),
    ):
        cells += [f"{figure:.1f}", f"{least:.1f} to {most:.1f}"]
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.doubt", description=__doc__)
    parser.add_argument(
        "--sensor",
        nargs=2,
        action="append",
        default=[],
        metavar=("BALLS", "SET"),
        help="a dataset of labelled balls, and rendered presses of the same sensor",
    )
    parser.add_argument("--json", type=Path, help="write the figures here")
    options = parser.parse_args()
    found: list[Told] = []
    with ending_in_a_sentence(parser):
        check_outputs(options.json)
        print(
            "| gradients | n | largest tenth to smaller half | of each | doubt to error | of each |"
        )
        print("|---|--:|--:|--:|--:|--:|")
        for row in measured(options.sensor):
            found.append(row)
            print(_line(row), flush=True)
        write_json(options.json, {"doubt": [asdict(row) for row in found]})


if __name__ == "__main__":
    main()
