# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The estimators on the real bench presses: errors by press, and time per frame."""

from collections.abc import Iterator
from concurrent.futures import Executor
from pathlib import Path
from statistics import fmean

import numpy as np

from benchmarks.measurement import Measurement, interleaved_ms
from recon.arrays import Difference
from recon.calibration import Calibration
from recon.estimators import gradient_field
from recon.estimators.mlp import Mlp
from recon.pixels import positions
from validation.error_table import error_table

BARS_DEG = {("mlp", "contact"): 4.4, ("mlp", "contact+5%"): 2.7}


def measure_errors(folder: Path, executor: Executor) -> Iterator[Measurement]:
    """Mean of theta x and theta y with three lights, 5-fold by press."""
    table = error_table(folder, ["mlp", "table"], folds=5, seed=0, executor=executor)
    for row in table.rows:
        if row.configuration == "RGB":
            values = row.errors.values
            yield Measurement(
                name=f"{table.dataset}: {row.estimator}, RGB, {row.pixels}, 5-fold,"
                f" mean |G| {row.errors.mean_abs_gradient:.2f}, n {row.errors.n_presses} presses",
                value=fmean((values["theta_x_deg"], values["theta_y_deg"])),
                unit="°",
                bar=BARS_DEG.get((row.estimator, row.pixels)),
            )


def measure_time(calibration: Calibration, difference: Difference) -> Iterator[Measurement]:
    """The network by numpy against the same network by plain torch, one thread, 640x480."""
    import torch

    network = calibration.estimator
    assert isinstance(network, Mlp)
    layers = [(torch.from_numpy(weight), torch.from_numpy(bias)) for weight, bias in network.layers]
    position = positions(difference.shape[1::-1]).reshape(-1, 2)

    def plain_torch() -> np.ndarray:
        values = torch.from_numpy(network.inputs(difference.reshape(-1, 3), position))
        for weight, bias in layers[:-1]:
            values = torch.tanh(values @ weight + bias)
        weight, bias = layers[-1]
        return (values @ weight + bias).numpy()

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    ours_ms, torch_ms = interleaved_ms(
        [lambda: gradient_field(network, difference), plain_torch], rounds=9
    )
    torch.set_num_threads(threads)
    height, width = difference.shape[:2]
    yield Measurement(
        name=f"mlp: gradients at {width}x{height} by numpy against plain torch, one thread",
        value=ours_ms / torch_ms,
        unit=f"ratio ({ours_ms:.0f} ms)",
        bar=1.0,
    )
