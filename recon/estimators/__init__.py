# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What turns colour into slope: one contract, and the estimators by name."""

from collections.abc import Callable, Mapping
from typing import ClassVar, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float32

from recon.arrays import Difference, GradientField
from recon.estimators.lookup_table import LookupTable, fit_lookup_table
from recon.estimators.mlp import Mlp, fit_mlp
from recon.pixels import Pixels, positions
from sensor.errors import WedgeError

Progress = Callable[[float], None]
"""Called with the share that is done, 0 to 1."""


@runtime_checkable
class GradientEstimator(Protocol):
    """Maps the colour difference and the position of a pixel to the slope of the skin."""

    name: ClassVar[str]

    @property
    def channels(self) -> str:
        """The colours it looks at, some of "RGB" in that order."""

    def slopes(
        self, color: Float32[np.ndarray, "n 3"], position: Float32[np.ndarray, "n 2"]
    ) -> Float32[np.ndarray, "n 2"]:
        """Gradients (mm/mm) of pixels, from colours (full scale) and positions (-1 to 1)."""

    def tensors(self) -> dict[str, np.ndarray]:
        """Everything it learnt, as arrays for ``gradients.safetensors``."""


Fit = Callable[[Pixels, str, int, Progress], GradientEstimator]
"""Learn from labelled pixels, for some channels, with a seed."""
Restore = Callable[[Mapping[str, np.ndarray], str], GradientEstimator]

ESTIMATORS: Mapping[str, tuple[Fit, Restore]] = {
    Mlp.name: (fit_mlp, Mlp.from_tensors),
    LookupTable.name: (fit_lookup_table, LookupTable.from_tensors),
}


def fit_estimator(
    name: str, pixels: Pixels, channels: str, seed: int, progress: Progress = lambda _: None
) -> GradientEstimator:
    """Fit the estimator of that name, to all pixels but those under dots.

    Raises:
        WedgeError: no estimator has that name.
    """
    return _known(name)[0](pixels[~pixels.hidden], channels, seed, progress)


def restore_estimator(
    name: str, tensors: Mapping[str, np.ndarray], channels: str
) -> GradientEstimator:
    """The estimator of that name from what it learnt.

    Raises:
        WedgeError: no estimator has that name, or the arrays are not what it wrote.
    """
    for key, values in tensors.items():
        if values.dtype != np.float32 or not np.isfinite(values).all():
            raise WedgeError(f"the array {key} of the {name} estimator is not of finite float32.")
    try:
        return _known(name)[1](tensors, channels)
    except KeyError as error:
        raise WedgeError(f"the {name} estimator lacks the array {error}.") from error
    except ValueError as error:
        raise WedgeError(f"the arrays of the {name} estimator do not fit: {error}.") from error


def gradient_field(estimator: GradientEstimator, difference: Difference) -> GradientField:
    """Gradients of a whole difference image, (h, w, 2) float32."""
    height, width = difference.shape[:2]
    position = positions((width, height)).reshape(-1, 2)
    return estimator.slopes(difference.reshape(-1, 3), position).reshape(height, width, 2)


def _known(name: str) -> tuple[Fit, Restore]:
    if name not in ESTIMATORS:
        raise WedgeError(f"no estimator is called {name!r}: known are {', '.join(ESTIMATORS)}.")
    return ESTIMATORS[name]
