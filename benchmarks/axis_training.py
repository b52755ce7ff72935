# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the recipe of the random surfaces and the network's size are worth, at a small budget.

    python -m benchmarks.axis_training --steps 300 --json axis_training.json

Networks of every recipe and of three sizes, each trained for the same few steps from one seed, and
judged on what none has seen: the measured slopes of the bench presses and the true ones of the
twin's shapes, as ``benchmarks.axis_question`` has them, and ideal balls under white noise.
"""

import argparse
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from benchmarks import axis_question
from benchmarks.measurement import interleaved_ms
from recon import unet
from recon.missing_axis.inference import infer_missing_axis
from recon.training.missing_axis import Settings, share_of_zeros_error, train
from recon.training.random_surfaces import Recipe
from sensor.arguments import ending_in_a_sentence
from sensor.files import check_outputs, write_json

STEPS = 600
SMALLER, LARGER = (6, 8, 12, 16), (24, 32, 48, 64)
BOTH: tuple[Recipe, ...] = ("paper", "contact")
VARIANTS: dict[str, tuple[tuple[Recipe, ...], tuple[int, ...]]] = {
    "paper's surfaces": (("paper",), unet.CHANNELS),
    "contacts": (("contact",), unet.CHANNELS),
    "both": (BOTH, unet.CHANNELS),
    "both, smaller network": (BOTH, SMALLER),
    "both, larger network": (BOTH, LARGER),
}
FRAME_PX = (320, 240)


@dataclass(frozen=True, kw_only=True)
class Trained:
    """One variant: its size and its errors over those of zero."""

    name: str
    steps: int
    parameters: int
    milliseconds: float
    """Of one inference at 320 x 240."""
    minutes: float
    """Of the training."""
    share_of_zero: dict[str, float]


def trained(name: str, steps: int) -> Trained:
    """Train one variant and judge it."""
    recipes, channels = VARIANTS[name]
    begin = time.monotonic()
    weights, _ = train(Settings(steps=steps, horizon=steps, channels=channels, recipes=recipes))
    minutes = (time.monotonic() - begin) / 60
    shares = {"ideal balls": share_of_zeros_error(weights, "x", FRAME_PX, presses=12)}
    answer = axis_question.by_network(weights)
    for source in (
        axis_question.on_bench_presses({"network": answer}),
        axis_question.on_shapes("twin-standard", {"network": answer}),
    ):
        for item in source:
            shares[f"{item.gradients}, {item.missing}"] = item.share_of_zero["network"]
    known = 0.04 * np.random.default_rng(0).standard_normal(FRAME_PX[::-1])
    (milliseconds,) = interleaved_ms(
        [lambda: infer_missing_axis(known, "x", (1.0, 1.0), weights=weights)], rounds=9
    )
    return Trained(
        name=name,
        steps=steps,
        parameters=sum(values.size for values in weights.values()),
        milliseconds=milliseconds,
        minutes=minutes,
        share_of_zero=shares,
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.axis_training", description=__doc__)
    parser.add_argument("--steps", type=int, default=STEPS, help="of each training")
    parser.add_argument("--json", type=Path, help="write the figures here")
    options = parser.parse_args()
    found: list[Trained] = []
    with ending_in_a_sentence(parser):
        check_outputs(options.json)
        for name in VARIANTS:
            item = trained(name, options.steps)
            if not found:
                print("| | parameters | ms |" + "".join(f" {key} |" for key in item.share_of_zero))
                print("|---|--:|--:|" + "--:|" * len(item.share_of_zero))
            found.append(item)
            shares = "".join(f" {share:.3f} |" for share in item.share_of_zero.values())
            print(f"| {name} | {item.parameters} | {item.milliseconds:.1f} |{shares}", flush=True)
        write_json(options.json, {"axis_training": [asdict(item) for item in found]})


if __name__ == "__main__":
    main()
