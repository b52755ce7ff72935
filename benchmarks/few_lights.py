# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""One light and two against three: the unseen slope of ball presses, and depth of balls and shapes.

    python -m benchmarks.few_lights twin-standard twin-finger wedge-lab --estimator default,mlp

Every third press is held out; estimators learn from the others. Slopes are judged on the error
table's pixels (contact + 5 %), depth where the skin is pressed: of balls as the table has it, of
the rendered shapes where they are deeper than 0.02 mm.
"""

import argparse
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from itertools import product
from pathlib import Path

import numpy as np

from benchmarks.measurement import Measurement
from recon.estimators import (
    GradientEstimator,
    as_labelled,
    fit_estimator,
    gradient_field,
    lesson_of,
)
from recon.lights import unseen_axis
from recon.markers.filling import fill_gradients
from recon.missing_axis.baselines import by_columns, by_convex_fit
from recon.missing_axis.moved import may_have_moved
from recon.pipeline import disturbed_in, reconstruct
from recon.pixels import BallPress, label_pixels
from recon.presses import read_presses
from sensor.arguments import ending_in_a_sentence
from sensor.dataset import Dataset, read_dataset
from sensor.errors import WedgeError
from sensor.files import check_outputs, write_json
from sensor.unit import MissingAxis
from validation.datasets import dataset_folder
from validation.depth import depth_errors
from validation.reconstructed import reconstruct_press
from validation.shapes import known_shapes, rmse_of_deeper_mm

HELD_OUT = 3
SEED = 0
ANSWERS = ("zero", "columns", "convex fit", "network", "three lights")


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """What some lights of one set say, and what three say."""

    dataset: str
    estimator: str
    lights: str
    presses: int
    gx_mae: dict[str, float]
    """Of what stands in for the unseen slope, by ``ANSWERS``; mm/mm."""
    ball_rmse_mm: dict[str, float]
    """Depth, with zero, network and three lights."""
    shape_rmse_mm: dict[str, dict[str, float]]
    """The same of each shape."""
    shape_lowest: dict[str, float]
    """Least depth that the network's way gives over the shape's height."""

    def measurements(self, real: bool) -> Iterator[Measurement]:
        """The figures that were asked for, with their bars; a real set has its own."""
        here = f"{self.dataset}, {self.lights}, {self.estimator}"
        bar = 0.5 if real else {"RB": 0.33, "R": 0.45}[self.lights]
        gx, balls = self.gx_mae, self.ball_rmse_mm
        yield Measurement(
            name=f"{here}: unseen slope with network, {self.presses} presses",
            value=gx["network"] / gx["zero"],
            unit="of zero's error",
            bar=bar,
        )
        if self.lights != "RB":
            return
        yield Measurement(
            name=f"{here}: unseen slope with network",
            value=gx["network"] / gx["three lights"],
            unit="of three lights' error",
            bar=None if real else 1.0,
        )
        depths = {"balls": balls, **self.shape_rmse_mm}
        for name, rmse_mm in depths.items():
            yield Measurement(
                name=f"{here}: depth of {name}",
                value=rmse_mm["network"] / rmse_mm["three lights"],
                unit="of three lights' RMSE",
                bar=1.5,
            )
        for name, lowest in self.shape_lowest.items():
            yield Measurement(
                name=f"{here}: depth of {name} below zero",
                value=max(0.0, -100 * lowest),
                unit="% of height",
                bar=2.0,
            )


def compare(name: str, estimator: str) -> Iterator[Comparison]:
    """Each configuration with an unseen axis against all three lights.

    Raises:
        WedgeError: the dataset is not on this machine, its lights leave no axis unseen, or it has
            a single press.
    """
    folder = dataset_folder(name)
    dataset = read_dataset(folder)
    lights_deg = dataset.card.lights_deg
    if unseen_axis(lights_deg, "RB") != "x":
        raise WedgeError(f"{name}: red and blue do not shine along y, so they hide no axis.")
    presses = read_presses(dataset).presses
    others = [index for index in range(len(presses)) if index % HELD_OUT]
    if not others:
        raise WedgeError(f"{name} has but one press that can be used: press the ball more often.")
    taught = lesson_of(estimator, presses, others, SEED)
    fitted = {lit: fit_estimator(estimator, taught, lit, SEED) for lit in ("R", "RB", "RGB")}
    balls = {i: press for i, press in enumerate(presses) if i % HELD_OUT == 0}
    for lit in ("RB", "R"):
        yield _comparison(dataset, lit, fitted, balls)


def _comparison(
    dataset: Dataset,
    lit: str,
    fitted: dict[str, GradientEstimator],
    balls: dict[int, BallPress],
) -> Comparison:
    few, all_lights = fitted[lit], fitted["RGB"]
    card = dataset.card
    gx: dict[str, list[float]] = {answer: [] for answer in ANSWERS}
    ball_mm: dict[str, list[float]] = {"zero": [], "network": [], "three lights": []}

    pixel_count = 0
    for index, press in balls.items():
        pixels = label_pixels(press, index, SEED)
        pixel_count += len(pixels)
        for answer, slopes in _answers(few, all_lights, press, card.lights_deg).items():
            asked = as_labelled(
                all_lights if answer == "three lights" else few,
                slopes.reshape(-1, 2)[pixels.place],
                pixels,
            )
            if answer == "zero":
                asked = np.zeros_like(asked)
            gx[answer].append(float(np.abs(asked - pixels.gradient)[:, 0].sum()))
        for answer, estimator, missing in _DEPTHS:
            by = all_lights if estimator == "RGB" else few
            touch = reconstruct_press(press, by, missing, card.lights_deg)
            ball_mm[answer].append(depth_errors(touch.depth_mm, press, dataset.folder).rmse_mm)
    shapes, lowest = _shapes(dataset, few, all_lights)
    return Comparison(
        dataset=card.name,
        estimator=few.name,
        lights=lit,
        presses=len(balls),
        gx_mae={answer: sum(errors) / pixel_count for answer, errors in gx.items()},
        ball_rmse_mm={answer: float(np.mean(rmse)) for answer, rmse in ball_mm.items()},
        shape_rmse_mm=shapes,
        shape_lowest=lowest,
    )


_DEPTHS: tuple[tuple[str, str, MissingAxis], ...] = (
    ("zero", "few", "zero"),
    ("network", "few", "network"),
    ("three lights", "RGB", "none"),
)


def _answers(
    few: GradientEstimator,
    all_lights: GradientEstimator,
    press: BallPress,
    lights_deg: Mapping[str, float] | None,
) -> dict[str, np.ndarray]:
    """Gradient fields, (h, w, 2), whose x slope each stand-in gives; the last two as units do."""
    pitch = press.mm_per_px
    seen = gradient_field(few, press.difference)
    if press.hidden is not None:
        seen = fill_gradients(seen, press.hidden, "biharmonic", pitch)
    known = seen[..., 1]
    support = may_have_moved(disturbed_in(press.difference, few), known)
    return {
        "zero": seen,
        "columns": by_columns(np.where(support, known, 0), "x", pitch) * support[..., None],
        "convex fit": by_convex_fit(known, "x", pitch, support) * support[..., None],
        "network": reconstruct_press(press, few, "network", lights_deg).gradient,
        "three lights": reconstruct_press(press, all_lights, "none", lights_deg).gradient,
    }


def _shapes(
    dataset: Dataset, few: GradientEstimator, all_lights: GradientEstimator
) -> tuple[dict[str, dict[str, float]], dict[str, float]]:
    """Depth RMSE of each shape by answer, and the network's least depth over the height."""
    rmse_mm: dict[str, dict[str, float]] = {}
    lowest: dict[str, float] = {}
    for shape in known_shapes(dataset):
        rmse_mm[shape.name] = {}
        for answer, estimator, missing in _DEPTHS:
            depth = reconstruct(
                shape.difference,
                all_lights if estimator == "RGB" else few,
                missing=missing,
                lights_deg=dataset.card.lights_deg,
                mm_per_px=dataset.card.mm_per_px,
            ).depth_mm
            rmse_mm[shape.name][answer] = rmse_of_deeper_mm(depth, shape.truth_mm)
            if answer == "network":
                lowest[shape.name] = float(depth.min() / shape.truth_mm.max())
    return rmse_mm, lowest


def main() -> None:
    """Print every figure beside its bar."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.few_lights", description=__doc__)
    parser.add_argument("datasets", nargs="+", help="such as twin-standard; see `wedge data list`")
    parser.add_argument("--estimator", default="mlp", help="names, with commas between them")
    parser.add_argument("--json", type=Path, help="write the figures here")
    options = parser.parse_args()
    found: list[Comparison] = []
    with ending_in_a_sentence(parser):
        check_outputs(options.json)
        for name, estimator in product(options.datasets, options.estimator.split(",")):
            for comparison in compare(name, estimator):
                found.append(comparison)
                _print(comparison, real=not name.startswith("twin"))
        write_json(options.json, {"few_lights": [asdict(comparison) for comparison in found]})


def _print(comparison: Comparison, real: bool) -> None:
    gx = comparison.gx_mae
    print(
        f"{comparison.dataset}, {comparison.lights}, {comparison.estimator}: Gx error over zero's"
    )
    for answer in ANSWERS[1:]:
        print(f"  {answer:14}{gx[answer] / gx['zero']:.3f}")
    for name, rmse_mm in {"balls": comparison.ball_rmse_mm, **comparison.shape_rmse_mm}.items():
        depths = "  ".join(f"{answer} {value:.3f}" for answer, value in rmse_mm.items())
        print(f"  depth RMSE of {name} [mm]: {depths}")
    for item in comparison.measurements(real):
        bar = (
            "" if item.bar is None else f" (bar {item.bar:g}: {'ok' if item.passed else 'MISSED'})"
        )
        print(f"  {item.name}: {item.value:.3f} {item.unit}{bar}", flush=True)


if __name__ == "__main__":
    main()
