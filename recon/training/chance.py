# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Chance that all trainings draw from."""

import numpy as np


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """As likely within any factor of two as within another."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
