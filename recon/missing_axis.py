# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The gradient along the axis that no light shows, inferred from the gradient along the other.

Both are derivatives of one surface that is flat outside the contacts, so that one says much about
the other. Slopes have no unit: the network knows neither millimetres nor the size of a frame, only
that pixels are square, which is arranged here.
"""

import hashlib
import json
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Literal

import cv2
import numpy as np
from jaxtyping import Float, Float32
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from recon import unet
from sensor.errors import WedgeError
from sensor.files import write_atomic
from sensor.toml import Pair

WEIGHTS_FILE = Path(__file__).with_name("weights") / "missing_axis.safetensors"
WEIGHTS_VERSION = "1"  # of the network's layers and of what its input and output mean
LONGEST_SIDE_PX = 320  # of the frame that the network sees; the largest it was trained on

Axis = Literal["x", "y"]
Slopes = Float[np.ndarray, "h w"]


def infer_missing_axis(
    known: Slopes, axis: Axis, mm_per_px: Pair, weights: unet.Weights | None = None
) -> Float32[np.ndarray, "h w"]:
    """The gradient along ``axis``, which was not measured, from the measured one.

    Frames longer than ``LONGEST_SIDE_PX``, or of oblong pixels, are resampled to square pixels and
    the result is resampled back.

    Args:
        known: ∂depth/∂y where ``axis`` is "x", and the reverse; mm/mm, positive toward the camera.
        axis: the axis that is missing.
        mm_per_px: pixel pitch along x and y; only the ratio counts.
        weights: of the network; the shipped ones unless given.

    Returns:
        (h, w) float32, mm/mm.

    Raises:
        WedgeError: ``known`` holds a NaN or infinity, ``mm_per_px`` is not positive, or the shipped
            weights are missing or damaged.
    """
    if not np.isfinite(known).all():
        raise WedgeError("The known gradient holds NaN or infinity: fill such pixels first.")
    if not all(np.isfinite(pitch) and pitch > 0 for pitch in mm_per_px):
        raise WedgeError(f"mm_per_px = {tuple(mm_per_px)} must be two positive numbers.")
    if weights is None:
        weights = shipped_weights()
    # The network infers x from y; the transposed surface has its axes swapped.
    if axis == "y":
        swapped = infer_missing_axis(known.T, "x", (mm_per_px[1], mm_per_px[0]), weights)
        return np.ascontiguousarray(swapped.T)
    h, w = known.shape
    if known.size == 0:
        return np.zeros((h, w), np.float32)
    working = _resampled(np.asarray(known, np.float32), *_working_size(h, w, mm_per_px))
    rows, columns = working.shape
    flat_gel = ((0, 0), (0, -rows % unet.STRIDE), (0, -columns % unet.STRIDE))
    maps = np.pad(unet.network_input(working), flat_gel)
    inferred = unet.forward(weights, maps)[:rows, :columns]
    return _resampled(inferred, h, w)


@lru_cache
def shipped_weights() -> unet.Weights:
    """The weights that come with this package."""
    return load_weights(WEIGHTS_FILE)


def load_weights(path: Path) -> unet.Weights:
    """Weights of the network, checked before use.

    Raises:
        WedgeError: the file is missing, is no safetensors file, was made for another version of the
            network, or its numbers are not those that training wrote.
    """
    try:
        with safe_open(path, framework="numpy") as file:
            made = json.loads((file.metadata() or {}).get("missing_axis", "{}"))
            weights = {name: file.get_tensor(name) for name in file.keys()}
    except (OSError, SafetensorError, json.JSONDecodeError) as error:
        raise WedgeError(f"{path} cannot be read as network weights: {error}.") from error
    if made.get("version") != WEIGHTS_VERSION:
        raise WedgeError(
            f"{path} holds weights of version {made.get('version', 'unknown')}, version"
            f" {WEIGHTS_VERSION} is needed: reinstall, or train with python -m recon.unet_training."
        )
    if made.get("sha256") != _sha256(weights):
        raise WedgeError(f"{path} is damaged, its hash does not match: install it again.")
    return weights


def save_weights(path: Path, weights: unet.Weights, command: str, seed: int) -> None:
    """Write weights with what made them; atomic, the same weights give the same bytes.

    Raises:
        WedgeError: ``path`` cannot be written.
    """
    made = {
        "version": WEIGHTS_VERSION,
        "command": command,
        "seed": seed,
        "sha256": _sha256(weights),
    }
    # One entry only: safetensors writes several in an order of chance.
    write_atomic(path, save(dict(weights), {"missing_axis": json.dumps(made)}))


def _sha256(weights: Mapping[str, np.ndarray]) -> str:
    """Of names, shapes and numbers, wherever in the file they stand."""
    digest = hashlib.sha256()
    for name, values in sorted(weights.items()):
        digest.update(f"{name}{values.shape}{values.dtype.str}".encode())
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()


def _working_size(h: int, w: int, mm_per_px: Pair) -> tuple[int, int]:
    """Rows and columns of the same frame in square pixels, at most ``LONGEST_SIDE_PX`` long.

    Neither axis grows: stretched noise is alike in neighbouring rows, and its integral adds up.
    """
    width_mm, height_mm = w * mm_per_px[0], h * mm_per_px[1]
    pitch_mm = max(*mm_per_px, max(width_mm, height_mm) / LONGEST_SIDE_PX)
    return max(1, round(height_mm / pitch_mm)), max(1, round(width_mm / pitch_mm))


def _resampled(
    slopes: Float32[np.ndarray, "h w"], rows: int, columns: int
) -> Float32[np.ndarray, "rows columns"]:
    # One axis at a time: OpenCV averages areas only where no axis grows.
    h, w = slopes.shape
    if columns != w:
        how = cv2.INTER_AREA if columns < w else cv2.INTER_LINEAR
        slopes = np.asarray(cv2.resize(slopes, (columns, h), interpolation=how), np.float32)
    if rows != h:
        how = cv2.INTER_AREA if rows < h else cv2.INTER_LINEAR
        slopes = np.asarray(cv2.resize(slopes, (columns, rows), interpolation=how), np.float32)
    return np.ascontiguousarray(slopes)
