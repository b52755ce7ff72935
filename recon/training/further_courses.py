# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the further courses share: sensors by words, presses by a digest, weights in between."""

import argparse
import hashlib
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from recon import unet


def name_sensors(parser: argparse.ArgumentParser) -> None:
    """Let a program be told of sensors: of each its balls, and rendered sets."""
    parser.add_argument(
        "--sensor",
        nargs="+",
        action="append",
        required=True,
        type=Path,
        metavar=("BALLS", "SETS"),
        help="a dataset of labelled balls, and sets of rendered presses of the same sensor",
    )


def words_of(sensors: Sequence[Sequence[Path]]) -> str:
    """The words on the command line that name these sensors."""
    return " ".join(" ".join(["--sensor", *(path.name for path in paths)]) for paths in sensors)


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
