# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge bench`: every figure of the performance page, measured in one run."""

import math
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

from app._output import OutputFile, print_table
from app._progress import progress
from app._workers import process_pool
from sensor.dataset import read_dataset
from sensor.files import check_outputs, write_json

if TYPE_CHECKING:
    from benchmarks.measurement import Measurement


def main(json: OutputFile = None) -> int:
    """Measure every figure of the performance page and print it next to its limit.

    Measured are the integrators on exact slopes; the network on the real bench presses (5-fold by
    press); how long a calibration from 40 presses, raw frames to a certificate, the path from a
    JPEG to depth, the stream's client, the error table, the twin's frames and `wedge --help` take;
    and the largest memory of a process. Times on a shared machine are noisy: if two programs are
    compared, they run in turn, and the figure is the ratio of their medians. This takes some
    minutes.

    The exit status is 1 if a figure misses its limit.

    Args:
        json: Write the figures here as JSON.
    """
    check_outputs(json)
    found: list[Measurement] = []
    with progress("benchmarks") as show:
        for share, measurement in _all():
            found.append(measurement)
            show(share, measurement.name)
    print_table(
        ["figure", "value", "bar", "unit", ""],
        [
            [
                item.name,
                f"{item.value:.3g}" if math.isfinite(item.value) else "none",
                "" if item.bar is None else f"≤ {item.bar:.3g}",
                item.unit,
                "" if item.bar is None else "ok" if item.passed else "MISSED",
            ]
            for item in found
        ],
    )
    write_json(
        json,
        {
            "figures": [
                {"name": item.name, "value": item.value, "unit": item.unit, "bar": item.bar}
                for item in found
            ]
        },
    )
    return 0 if all(item.passed for item in found) else 1


def _all() -> "Iterator[tuple[float, Measurement]]":
    """Each figure, with the share of the run that is done when it is known."""
    from benchmarks import (
        calibration,
        estimators,
        fast_path,
        integrators,
        markers,
        missing_axis,
        stream,
        tracking,
        twin,
    )
    from benchmarks.measurement import Measurement, interleaved_ms
    from recon.images import read_frame
    from validation.datasets import dataset_folder

    folder = dataset_folder("taxim-gelsight")
    # The table first: the memory it takes is the most that this process has taken until then.
    start = time.perf_counter()
    with process_pool() as executor:
        for item in estimators.measure_errors(folder, executor):
            yield 0.3, item
    yield (
        0.3,
        Measurement(
            name="whole error table of mlp and table, 7 configurations x 5 folds",
            value=time.perf_counter() - start,
            unit="s",
            bar=240,
        ),
    )
    yield 0.3, calibration.peak_memory()
    for item in integrators.measure():
        yield 0.39, item
    for item in markers.measure():
        yield 0.41, item
    for item in tracking.measure():
        yield 0.49, item
    with process_pool() as executor:
        _, _, ours = executor.submit(calibration.measure, folder, "default").result()
        unit, difference, mlp = executor.submit(calibration.measure, folder, "mlp").result()
    for item in (ours, mlp):
        yield 0.62, item
    for item in calibration.raw_to_certificate():
        yield 0.67, item
    for item in estimators.measure_time(unit, difference):
        yield 0.76, item
    unseen = read_dataset(folder).labels[calibration.PRESSES :]
    frames = [read_frame(folder, label.file) for label in unseen]
    with process_pool() as executor:
        two_lights = executor.submit(
            calibration.by_two_lights, dataset_folder("twin-standard")
        ).result()
    for item in fast_path.measure(unit, frames, two_lights):
        yield 0.82, item
    for item in missing_axis.measure():
        yield 0.84, item
    with process_pool() as executor:
        for item in missing_axis.measure_surfaces(executor):
            yield 0.84, item
    for item in stream.measure():
        yield 0.86, item
    with process_pool() as executor:
        for item in twin.measure(executor):
            yield 0.95, item
    command = [sys.executable, "-m", "app", "--help"]
    (help_ms,) = interleaved_ms(
        [lambda: subprocess.run(command, check=True, stdout=subprocess.DEVNULL)], rounds=5
    )
    yield 1.0, Measurement(name="wedge --help", value=help_ms / 1e3, unit="s", bar=0.7)
