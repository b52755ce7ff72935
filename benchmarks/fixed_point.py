# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How far the paper's network in 16-bit fixed point is from the same in floats, and its time.

    python -m benchmarks.fixed_point taxim-gelsight wedge-lab twin-standard twin-finger known-depth

For each set, four units are calibrated on all of its presses, and applied to the frames of these.
Largest difference in slope, over all frames and of the median frame, and processor time of one
thread against that of floats. A unit that 16 bits do not suffice for says ``floats``.
"""

import argparse
import time
from collections.abc import Iterator
from statistics import median
from typing import Final

import numpy as np

from benchmarks.measurement import one_thread
from recon.calibration import calibrate
from recon.estimators.mlp import Mlp
from recon.fast.network import FrameMlp
from recon.presses import read_presses
from sensor.arguments import ending_in_a_sentence
from sensor.dataset import read_dataset
from validation.datasets import dataset_folder

SEEDS: Final = range(4)


def rows(name: str) -> Iterator[str]:
    """A line for each unit of a set."""
    dataset = read_dataset(dataset_folder(name))
    read = read_presses(dataset)
    for seed in SEEDS:
        unit = calibrate(
            dataset, read, estimator="mlp", serial="s", created="-", metrics={}, seed=seed
        )
        network = unit.estimator
        assert isinstance(network, Mlp)
        ways = [
            FrameMlp(network, read.unwarp.size_px, in_words=in_words) for in_words in (None, False)
        ]
        worst: list[float] = []
        taken: tuple[list[float], list[float]] = [], []
        for press in read.presses:
            colors = np.ascontiguousarray(np.moveaxis(press.difference, -1, 0))
            found = np.empty((2, 2, *colors.shape[1:]), np.float32)
            for way, slopes, times in zip(ways, found, taken, strict=True):
                start = time.thread_time()
                way(colors, slopes)
                times.append(time.thread_time() - start)
            worst.append(float(np.abs(found[0] - found[1]).max()))
        yield (
            f"{name}, seed {seed}: {'16 bits' if ways[0].in_words else 'floats'}, off by "
            f"{max(worst):.1e}, median {median(worst):.1e} (n {len(worst)}), "
            f"{median(taken[0]) / median(taken[1]):.2f} of the time of floats"
        )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fixed_point", description=__doc__)
    parser.add_argument("datasets", nargs="+", help="such as taxim-gelsight")
    with ending_in_a_sentence(parser), one_thread():
        for name in parser.parse_args().datasets:
            for row in rows(name):
                print(row, flush=True)


if __name__ == "__main__":
    main()
