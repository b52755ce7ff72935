# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""One calibration from 40 presses, its time and memory, and raw frames to a certificate."""

import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from benchmarks.measurement import Measurement
from recon.arrays import Difference, Frame
from recon.calibration import Calibration, calibrate, unit_of_set
from recon.images import read_frame
from recon.presses import read_presses
from sensor.dataset import read_dataset
from validation.datasets import shared_folder
from validation.evaluation import held_out_metrics, hold_out
from validation.importers.wedge_lab import BALL_RADIUS_MM

PRESSES = 40
LEFT_OUT = 4
"""Of so many presses one."""


def measure(folder: Path, estimator: str) -> tuple[Calibration, Difference, Measurement]:
    """Calibrate as `wedge calibrate` does; a unit, one of its difference images, the time."""
    start = time.perf_counter()
    whole = read_dataset(folder)
    dataset = replace(whole, labels=whole.labels[:PRESSES])
    presses = read_presses(dataset)
    measured = hold_out(dataset, presses, estimator, seed=0)
    unit = calibrate(
        dataset,
        presses,
        estimator=estimator,
        serial="bench",
        created="2000-01-01",
        metrics=held_out_metrics(measured, len(presses.presses)),
        seed=0,
    )
    taken_s = time.perf_counter() - start
    figure = Measurement(
        name=f"calibration of {estimator} from {len(presses.presses)} presses at 640x480, errors "
        "included",
        value=taken_s,
        unit="s",
        bar=60,
    )
    return unit, presses.presses[0].difference, figure


def by_two_lights(folder: Path) -> tuple[Calibration, list[Frame]]:
    """A unit with our estimator that red and blue alone light, and frames that it was not taught.

    Args:
        folder: a set of balls on a sensor on which they are opposite each other.
    """
    whole = read_dataset(folder)
    lights_deg = {c: deg for c, deg in (whole.card.lights_deg or {}).items() if c in "RB"}
    kept = [label for i, label in enumerate(whole.labels) if i % LEFT_OUT]
    dataset = replace(whole, card=replace(whole.card, lights_deg=lights_deg), labels=tuple(kept))
    unit = unit_of_set(dataset, "default")
    return unit, [read_frame(folder, label.file) for label in whole.labels[::LEFT_OUT]]


def raw_to_certificate() -> Iterator[Measurement]:
    """The two commands from a folder of raw frames, as someone types them; where there are some."""
    raw = shared_folder() / "wedge-lab" / "calibration"  # may not be redistributed
    if not raw.is_dir():
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "raw").mkdir()
        for pattern, most in (("bg-*", 1), ("5mm-*", 5), ("ball-*", PRESSES)):
            for picture in sorted(raw.glob(pattern))[:most]:
                shutil.copyfile(picture, folder / "raw" / picture.name)
        start = time.perf_counter()
        for words in (
            ("calibrate", "raw", "--ball-radius-mm", f"{BALL_RADIUS_MM:g}", "--out", "unit"),
            ("accept", "unit", "unit-presses", "--out", "certificate"),
        ):
            command = [sys.executable, "-m", "app", *words]
            subprocess.run(command, cwd=folder, check=True, capture_output=True)
        taken_s = time.perf_counter() - start
    yield Measurement(
        name=f"wedge-lab: raw frames of {PRESSES} presses to a certificate, two commands",
        value=taken_s,
        unit="s",
        bar=90,
    )


def peak_memory() -> Measurement:
    """The largest resident memory of this process, plus twice that of its largest worker."""
    to_gb = 1e-9 if sys.platform == "darwin" else 1024e-9
    own = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    worker = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    return Measurement(
        name="peak memory of the error table: this process and two workers",
        value=(own + 2 * worker) * to_gb,
        unit="GB",
        bar=2.0,
    )
