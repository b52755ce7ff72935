# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Refuses numbers that no training leaves, and that would turn every depth into NaN."""

from collections.abc import Mapping

import numpy as np

from recon.tensor_files import MOST_LEARNT, learnt

LEAST_SPREAD = 1e-6
"""Of colours among the pixels learnt from: training leaves a thousand times this, and beneath it
the first layer's inputs, and with them its sums, could leave what a float32 can hold."""
SPREADS = ("spread", "color_scale")


def refuse_absurd(tensors: Mapping[str, np.ndarray]) -> None:
    """Refuse arrays of the right shapes whose numbers cannot have been learnt.

    Raises:
        ValueError: names the array.
    """
    for key, values in tensors.items():
        if not learnt(values):
            raise ValueError(f"{key} holds numbers above {MOST_LEARNT:g}")
    divisors = {key: tensors[key] for key in SPREADS if key in tensors}
    if "high" in tensors and "low" in tensors:
        divisors["high - low"] = tensors["high"] - tensors["low"]
    for key, values in divisors.items():
        if values.min(initial=1) < LEAST_SPREAD:
            raise ValueError(f"{key} must be above zero")
