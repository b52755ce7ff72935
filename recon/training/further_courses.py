# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the further courses share: words, presses and their digest, weights in between."""

import argparse
import hashlib
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np

from recon import unet
from recon.unet.weights import sha256_of
from sensor.arguments import at_least
from sensor.errors import WedgeError

P = TypeVar("P")


def course_parser(
    module: str, about: str | None, *, seed: int, steps: int
) -> argparse.ArgumentParser:
    """The words that every further course takes.

    Args:
        module: that is run, named as the first courses' with "_further" at its end.
        about: what it does.
        seed: unless another is named.
        steps: batches, unless others are named.
    """
    parser = argparse.ArgumentParser(prog=f"python -m {module}", description=about)
    first = module.removesuffix("_further")
    parser.add_argument("first", type=Path, help=f"weights of {first}")
    parser.add_argument(
        "--sensor",
        nargs="+",
        action="append",
        required=True,
        type=Path,
        metavar=("BALLS", "SETS"),
        help="a dataset of labelled balls, and sets of rendered presses of the same sensor",
    )
    parser.add_argument("--seed", type=at_least(0), default=seed)
    parser.add_argument("--steps", type=int, default=steps, help="batches")
    parser.add_argument("--out", type=Path, required=True, help="the safetensors file to write")
    return parser


def command_of(module: str, options: argparse.Namespace, *further: str) -> str:
    """The command line that does the same again, further words before its last.

    Files and folders are told by their names alone.
    """
    sensors = (word for paths in options.sensor for word in ("--sensor", *(x.name for x in paths)))
    counts = ("--seed", str(options.seed), "--steps", str(options.steps))
    out = ("--out", options.out.name)
    return " ".join(["python -m", module, options.first.name, *sensors, *counts, *further, *out])


def presses_of(
    sensors: Sequence[Sequence[Path]], read: Callable[[Path, Sequence[Path]], Iterable[P]]
) -> list[P]:
    """Rendered presses as each of the sensors measured them, given its balls and its sets.

    Raises:
        WedgeError: there is none.
    """
    presses = [press for balls, *rendered in sensors for press in read(balls, rendered)]
    if not presses:
        raise WedgeError("no rendered press is felt: name sets of benchmarks.rendered_presses.")
    print(f"{len(presses)} presses as felt", flush=True)
    return presses


def settings_of(
    seed: int, first: unet.Weights, truths: Iterable[np.ndarray]
) -> dict[str, int | str]:
    """What a checkpoint must agree in: the seed, the weights before, and what was pressed."""
    return {"seed": seed, "first": sha256_of(first), "presses": digest_of(truths)}


def digest_of(truths: Iterable[np.ndarray]) -> str:
    """Of what was pressed, by the truth of each: what is measured of it may round otherwise."""
    digest = hashlib.sha256()
    for truth in truths:
        digest.update(f"{truth.shape}".encode())
        digest.update(np.ascontiguousarray(truth).tobytes())
    return digest.hexdigest()


def between(first: unet.Weights, after: unet.Weights, share_after: float) -> dict[str, np.ndarray]:
    """Weights on the line from those before a course to those after it.

    They stay as good on what the course does not show (Wortsman et al., CVPR 2022,
    https://arxiv.org/abs/2109.01903).
    """
    return {
        name: np.float32(share_after) * values
        + np.float32(1 - share_after) * np.asarray(first[name])
        for name, values in after.items()
    }
