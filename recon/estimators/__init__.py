# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What turns colour into slope: one contract, and the estimators by name."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import ClassVar, Protocol, runtime_checkable

import cv2
import numpy as np
from jaxtyping import Float32

from recon.arrays import Difference, GradientField
from recon.estimators.absurd_tensors import refuse_absurd
from recon.estimators.default import Default
from recon.estimators.default_fit import fit_default
from recon.estimators.effort import Effort
from recon.estimators.lesson import lesson_pixels
from recon.estimators.lookup_table import LookupTable, fit_lookup_table
from recon.estimators.mlp import Mlp
from recon.estimators.mlp_fit import fit_mlp
from recon.pixels import BallPress, Pixels, join, label_pixels, positions
from sensor.errors import WedgeError
from sensor.extras import how_to_install

Progress = Callable[[float], None]
"""Called with the share that is done, 0 to 1."""


@runtime_checkable
class GradientEstimator(Protocol):
    """Maps the colour difference and the position of a pixel to the slope of the skin."""

    name: ClassVar[str]
    looks_around: ClassVar[bool]
    """Whether it sees more than single pixels, so that what it says of a slope across the lights is
    a hint and not a guess."""

    @property
    def channels(self) -> str:
        """The colours it looks at, some of "RGB" in that order."""

    @property
    def reach(self) -> float | None:
        """How far gel follows what moved, in shares of the frame's shorter side.

        Slopes farther away are taken for zero; ``None`` where none are.
        """

    def prepared(self, difference: Difference) -> Float32[np.ndarray, "h w k"]:
        """A frame's difference as its ``slopes`` want it; first three colours."""

    def asked(self, difference: Difference) -> Float32[np.ndarray, "ah aw k"]:
        """The same for all of a frame, perhaps at a lower resolution."""

    def slopes(
        self, color: Float32[np.ndarray, "n k"], position: Float32[np.ndarray, "n 2"]
    ) -> Float32[np.ndarray, "n 2"]:
        """Gradients (mm/mm) of pixels, from prepared colours and positions (-1 to 1)."""

    def lean(self, position: Float32[np.ndarray, "*n 2"]) -> Float32[np.ndarray, "*n 2"]:
        """The dent's slopes, which ``slopes`` gives, less those of what is pressed in.

        Labels say a ball's own slopes; on a domed gel the two differ.
        """

    def half_width(self, slopes: Float32[np.ndarray, "*n 2"]) -> Float32[np.ndarray, "*n 2"] | None:
        """Half the width of each slope's 90 % interval; ``None`` where that was not measured."""

    def tensors(self) -> dict[str, np.ndarray]:
        """Everything it learnt, as arrays for ``gradients.safetensors``."""


Teach = Callable[[BallPress, int, int, int], Pixels]
"""The pixels to learn from; the press' index and a seed draw them, and it is one of so many."""
Fit = Callable[[Pixels, str, int, Progress, Effort], GradientEstimator]
"""Learn from labelled pixels, for some channels, with a seed."""
Restore = Callable[[Mapping[str, np.ndarray], str], GradientEstimator]


@dataclass(frozen=True, kw_only=True)
class Kind:
    """How an estimator is taught, fitted, and restored from what it learnt."""

    teach: Teach | None
    """``None`` where it learns from what it is judged by (``label_pixels``)."""
    fit: Fit
    restore: Restore
    needs_torch: bool
    """To be fitted."""


ESTIMATORS: Mapping[str, Kind] = {
    Default.name: Kind(
        teach=lesson_pixels, fit=fit_default, restore=Default.from_tensors, needs_torch=True
    ),
    Mlp.name: Kind(teach=None, fit=fit_mlp, restore=Mlp.from_tensors, needs_torch=True),
    LookupTable.name: Kind(
        teach=None, fit=fit_lookup_table, restore=LookupTable.from_tensors, needs_torch=False
    ),
}


def training_pixels(name: str, press: BallPress, index: int, seed: int, presses: int) -> Pixels:
    """The pixels of one of so many presses that the estimator of that name learns from.

    Raises:
        WedgeError: no estimator has that name.
    """
    teach = kind_of(name).teach
    return teach(press, index, seed, presses) if teach else label_pixels(press, index, seed)


def lesson_of(name: str, presses: Sequence[BallPress], chosen: Sequence[int], seed: int) -> Pixels:
    """All that the estimator of that name learns from the chosen of a dataset's presses.

    Raises:
        WedgeError: no estimator has that name.
    """
    count = len(chosen)
    return join([training_pixels(name, presses[index], index, seed, count) for index in chosen])


def fit_estimator(
    name: str,
    pixels: Pixels,
    channels: str,
    seed: int,
    progress: Progress = lambda _: None,
    *,
    effort: Effort = Effort.WHOLE,
) -> GradientEstimator:
    """Fit the estimator of that name, to all pixels but those under dots.

    Args:
        name: from ``ESTIMATORS``.
        pixels: labelled.
        channels: of "RGB", in that order.
        seed: of what is drawn.
        progress: called with the share that is done.
        effort: whether its ``half_width`` is measured, too, and how long it is trained.

    Raises:
        WedgeError: as ``refuse_unfittable``.
    """
    refuse_unfittable(name)
    return kind_of(name).fit(pixels[~pixels.hidden], channels, seed, progress, effort)


def restore_estimator(
    name: str, tensors: Mapping[str, np.ndarray], channels: str
) -> GradientEstimator:
    """The estimator of that name from what it learnt.

    Raises:
        WedgeError: no estimator has that name, or the arrays are not what it wrote.
    """
    if name not in ESTIMATORS:
        raise WedgeError(
            f"no estimator is called {name!r} here (known are {', '.join(ESTIMATORS)}): the unit "
            "may come from an extension or a later version; use that one, or calibrate again."
        )
    for key, values in tensors.items():
        if values.dtype != np.float32 or not np.isfinite(values).all():
            raise WedgeError(f"the array {key} of the {name} estimator is not of finite float32.")
    try:
        estimator = ESTIMATORS[name].restore(tensors, channels)
        refuse_absurd(tensors)
        return estimator
    except KeyError as error:
        raise WedgeError(
            f"the {name} estimator lacks the array {error}; calibrate again."
        ) from error
    except ValueError as error:
        raise WedgeError(
            f"the arrays of the {name} estimator do not fit: {error}; calibrate again."
        ) from error


def gradient_field(estimator: GradientEstimator, difference: Difference) -> GradientField:
    """Gradients of a whole difference image, (h, w, 2) float32."""
    seen = estimator.asked(difference)
    height, width, count = seen.shape
    position = positions((width, height)).reshape(-1, 2)
    slopes = estimator.slopes(seen.reshape(height * width, count), position)
    field, size_px = slopes.reshape(height, width, 2), difference.shape[1::-1]
    return field if (width, height) == size_px else cv2.resize(field, size_px)


def slopes_at(
    estimator: GradientEstimator, difference: Difference, pixels: Pixels
) -> Float32[np.ndarray, "n 2"]:
    """Gradients of some pixels of a difference image, as their labels mean them."""
    prepared = estimator.prepared(difference)
    seen = prepared.reshape(-1, prepared.shape[2])[pixels.place]
    return as_labelled(estimator, estimator.slopes(seen, pixels.position), pixels)


def as_labelled(
    estimator: GradientEstimator, slopes: Float32[np.ndarray, "n 2"], pixels: Pixels
) -> Float32[np.ndarray, "n 2"]:
    """Slopes of a dent to those that labels speak of: in contact, the pressed ball's own."""
    return slopes - pixels.contact[:, None] * estimator.lean(pixels.position)


def refuse_unfittable(name: str) -> None:
    """Refuse an estimator that cannot be fitted here, before anything is read for it.

    Raises:
        WedgeError: no estimator has that name, or it needs torch, which is not installed.
    """
    if kind_of(name).needs_torch and find_spec("torch") is None:
        raise WedgeError(f"calibration needs torch: {how_to_install('train')}.")


def kind_of(name: str) -> Kind:
    """How the estimator of that name is made.

    Raises:
        WedgeError: no estimator has that name.
    """
    if name not in ESTIMATORS:
        raise WedgeError(f"no estimator is called {name!r}: known are {', '.join(ESTIMATORS)}.")
    return ESTIMATORS[name]
