# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Weights of the U-Nets on disk: safetensors with what made them, checked before use."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from safetensors.numpy import save

from recon import unet
from recon.tensor_files import learnt, read_tensors
from sensor.errors import WedgeError
from sensor.files import write_atomic


@dataclass(frozen=True, kw_only=True)
class Purpose:
    """What a network is for."""

    name: str
    version: str
    """Of the layers and of what input and output mean."""
    inputs: int
    outputs: int
    training: str
    """The module that trains it."""
    fine: tuple[int, ...] = ()
    """Feature maps of its layers at full resolution."""

    @property
    def file(self) -> Path:
        """The weights that come with this package."""
        return Path(__file__).parents[1] / "weights" / f"{self.name}.safetensors"


MISSING_AXIS = Purpose(
    name="missing_axis",
    version="3",
    inputs=unet.INPUTS,
    outputs=unet.OUTPUTS,
    training="recon.training.missing_axis",
)


@lru_cache
def shipped_weights(purpose: Purpose = MISSING_AXIS) -> unet.Weights:
    """The weights that come with this package."""
    return load_weights(purpose.file, purpose)


def load_weights(path: Path, purpose: Purpose = MISSING_AXIS) -> unet.Weights:
    """Weights of a network, of any width, checked before use.

    Raises:
        WedgeError: the file is missing, is no safetensors file, was made for another version of the
            network, or its numbers are not those that training wrote, or none that any would.
    """
    said, weights = read_tensors(path, " as network weights", "install it again")
    try:
        made = json.loads(said.get(purpose.name, "{}"))
    except (ValueError, RecursionError) as error:
        raise WedgeError(
            f"{path} cannot be read as network weights: {error}; install it again."
        ) from error
    version = made.get("version", "unknown") if isinstance(made, dict) else "unknown"
    if version != purpose.version:
        raise WedgeError(
            f"{path} holds weights of version {version}, version {purpose.version} is needed: "
            f"reinstall, or train with python -m {purpose.training}."
        )
    if made.get("sha256") != sha256_of(weights):
        raise WedgeError(f"{path} is damaged, its hash does not match: install it again.")
    if not _fit_together(weights, purpose):
        raise WedgeError(f"{path} holds the weights of another network: install it again.")
    for name, values in weights.items():
        if not learnt(values):
            raise WedgeError(f"{path} holds {name} in sizes nobody learns: install it again.")
    return weights


def save_weights(
    path: Path,
    weights: unet.Weights,
    command: str,
    seed: int,
    purpose: Purpose = MISSING_AXIS,
) -> None:
    """Write weights with what made them; atomic, the same weights give the same bytes.

    Raises:
        WedgeError: ``path`` cannot be written.
    """
    made = {
        "version": purpose.version,
        "command": command,
        "seed": seed,
        "sha256": sha256_of(weights),
    }
    # One entry only: safetensors writes several in an order of chance.
    write_atomic(path, save(dict(weights), {purpose.name: json.dumps(made)}))


def sha256_of(weights: Mapping[str, np.ndarray]) -> str:
    """Of names, shapes and numbers, wherever in the file they stand."""
    digest = hashlib.sha256()
    for name, values in sorted(weights.items()):
        digest.update(f"{name}{values.shape}{values.dtype.str}".encode())
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()


def _fit_together(weights: Mapping[str, np.ndarray], purpose: Purpose) -> bool:
    """Whether these are all arrays of one U-Net."""
    channels = unet.channels_of(weights)
    layers = unet.layer_shapes(
        channels, purpose.inputs, purpose.outputs, purpose.fine, unet.doubt_of(weights)
    )
    expected: dict[str, tuple[int, ...]] = {}
    for name, (wide_out, wide_in, side) in layers.items():
        expected |= {f"{name}.weight": (wide_out, wide_in, side, side), f"{name}.bias": (wide_out,)}
    shapes = {name: values.shape for name, values in weights.items()}
    types = {values.dtype.str for values in weights.values()}
    return len(channels) >= 2 and shapes == expected and types == {"<f4"}
