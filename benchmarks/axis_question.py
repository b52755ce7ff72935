# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The missing axis alone, wherever the lights sit: one slope is given, what is the other?

    python -m benchmarks.axis_question --json axis_question.json

The slope that is given is measured with all lights: of the real bench presses by an estimator that
learnt from the other two thirds, judged against the ball caps on the error table's pixels; of the
twin's shapes it is the true one with white noise, judged where the skin is deeper than 0.02 mm.
"""

import argparse
from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from recon import unet
from recon.contact.disturbed import disturbed_mask
from recon.estimators import (
    GradientEstimator,
    as_labelled,
    gradient_field,
)
from recon.lights import Axis
from recon.missing_axis.baselines import by_columns, by_convex_fit
from recon.missing_axis.inference import infer_missing_axis
from recon.missing_axis.moved import may_have_moved
from recon.pixels import BallPress, label_pixels
from recon.presses import read_presses
from sensor.arguments import ending_in_a_sentence
from sensor.dataset import read_dataset
from sensor.files import check_outputs, write_json
from sensor.toml import Pair
from validation.datasets import dataset_folder
from validation.folds import fit_presses
from validation.shapes import DEEPER_THAN_MM, known_shapes

BENCH = "taxim-gelsight"
TWINS = ("twin-standard", "twin-finger")
ESTIMATOR = "mlp"
HELD_OUT = 3
SLOPE_NOISE = 0.04
SEED = 0
AXES: tuple[Axis, ...] = ("x", "y")

Slopes = Float[np.ndarray, "h w"]
Mask = Bool[np.ndarray, "h w"]
Answer = Callable[[Slopes, Axis, Pair, Mask], np.ndarray]


def by_network(weights: unet.Weights | None) -> Answer:
    """The network of some weights as an answer; the shipped ones where none are given."""
    return lambda known, axis, pitch, support: (
        infer_missing_axis(known, axis, pitch, support=support, weights=weights).gradient
    )


ANSWERS: dict[str, Answer] = {
    "columns": lambda known, axis, pitch, support: by_columns(known * support, axis, pitch),
    "convex fit": by_convex_fit,
    "network": by_network(None),
}
"""Gradient fields from the known slope, the missing axis, the pitch and where the gel moved."""


@dataclass(frozen=True, kw_only=True)
class Answered:
    """Errors of the answers on some gradients with one axis hidden."""

    gradients: str
    missing: Axis
    count: int
    share_of_zero: dict[str, float]
    """Mean absolute error of the hidden slope over that of zero."""


def moved(disturbed: Mask, known: Slopes, axis: Axis) -> Mask:
    """Where the gel may have moved, the known slope being across ``axis``."""
    if axis == "x":
        return may_have_moved(disturbed, known)
    return may_have_moved(disturbed.T, known.T).T


@lru_cache(maxsize=1)
def _bench() -> tuple[GradientEstimator, list[tuple[int, BallPress]]]:
    """An estimator, and the presses that it has not learnt from with their numbers."""
    presses = read_presses(read_dataset(dataset_folder(BENCH))).presses
    taught = [index for index in range(len(presses)) if index % HELD_OUT]
    estimator = fit_presses(presses, taught, ESTIMATOR, "RGB", SEED)
    return estimator, list(enumerate(presses))[::HELD_OUT]


def on_bench_presses(answers: Mapping[str, Answer] = ANSWERS) -> Iterator[Answered]:
    """Real presses with three lights about 120° apart, so that either axis may be hidden."""
    estimator, judged = _bench()
    for axis in AXES:
        lost, given = ("x", "y").index(axis), ("y", "x").index(axis)
        errors, zero = dict.fromkeys(answers, 0.0), 0.0
        for index, press in judged:
            pixels = label_pixels(press, index, SEED)
            known = gradient_field(estimator, press.difference)[..., given]
            support = moved(disturbed_mask(press.difference), known, axis)
            zero += float(np.abs(pixels.gradient[:, lost]).sum())
            for name, answer in answers.items():
                field = answer(known, axis, press.mm_per_px, support) * support[..., None]
                found = as_labelled(estimator, field.reshape(-1, 2)[pixels.place], pixels)
                errors[name] += float(np.abs(found - pixels.gradient)[:, lost].sum())
        yield Answered(
            gradients=f"{BENCH}, measured",
            missing=axis,
            count=len(judged),
            share_of_zero={name: error / zero for name, error in errors.items()},
        )


def on_shapes(name: str, answers: Mapping[str, Answer] = ANSWERS) -> Iterator[Answered]:
    """True slopes of a rendered set's shapes, with white noise."""
    dataset = read_dataset(dataset_folder(name))
    shapes = list(known_shapes(dataset))
    pitch = dataset.card.mm_per_px
    for axis in AXES:
        lost, given = ("x", "y").index(axis), ("y", "x").index(axis)
        errors, zero = dict.fromkeys(answers, 0.0), 0.0
        rng = np.random.default_rng(SEED)
        for shape in shapes:
            truth = shape.truth_mm
            along_y, along_x = np.gradient(truth, *pitch[::-1])
            slopes = np.stack([along_x, along_y], -1).astype(np.float32)
            known = slopes[..., given]
            known = known + SLOPE_NOISE * rng.standard_normal(known.shape, np.float32)
            support = moved(disturbed_mask(shape.difference), known, axis)
            pressed = truth > DEEPER_THAN_MM
            zero += float(np.abs(slopes[pressed, lost]).sum())
            for answer_name, answer in answers.items():
                found = answer(known, axis, pitch, support) * support[..., None]
                errors[answer_name] += float(np.abs(found - slopes)[pressed, lost].sum())
        yield Answered(
            gradients=f"shapes of {name}, true, noise {SLOPE_NOISE}",
            missing=axis,
            count=len(shapes),
            share_of_zero={key: error / zero for key, error in errors.items()},
        )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.axis_question", description=__doc__)
    parser.add_argument("--json", type=Path, help="write the figures here")
    options = parser.parse_args()
    found: list[Answered] = []
    with ending_in_a_sentence(parser):
        check_outputs(options.json)
        print("| gradients | missing | n |" + "".join(f" {name} |" for name in ANSWERS))
        print("|---|---|--:|" + "--:|" * len(ANSWERS))
        for source in (on_bench_presses(), *(on_shapes(name) for name in TWINS)):
            for item in source:
                found.append(item)
                shares = "".join(f" {item.share_of_zero[name]:.2f} |" for name in ANSWERS)
                line = f"| {item.gradients} | {item.missing} | {item.count} |{shares}"
                print(line, flush=True)
        write_json(options.json, {"axis_question": [asdict(item) for item in found]})


if __name__ == "__main__":
    main()
