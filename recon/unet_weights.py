# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Weights of the U-Net on disk: safetensors with what made them, checked before use."""

import hashlib
import json
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from recon import unet
from sensor.errors import WedgeError
from sensor.files import write_atomic

SHIPPED_FILE = Path(__file__).with_name("weights") / "missing_axis.safetensors"
VERSION = "2"  # of the network's layers and of what its input and output mean


@lru_cache
def shipped_weights() -> unet.Weights:
    """The weights that come with this package."""
    return load_weights(SHIPPED_FILE)


def load_weights(path: Path) -> unet.Weights:
    """Weights of the network, of any width, checked before use.

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
    version = made.get("version", "unknown") if isinstance(made, dict) else "unknown"
    if version != VERSION:
        raise WedgeError(
            f"{path} holds weights of version {version}, version {VERSION} is needed: reinstall, or"
            " train with python -m recon.unet_training."
        )
    if made.get("sha256") != sha256_of(weights):
        raise WedgeError(f"{path} is damaged, its hash does not match: install it again.")
    if not _fit_together(weights):
        raise WedgeError(f"{path} holds the weights of another network: install it again.")
    return weights


def save_weights(path: Path, weights: unet.Weights, command: str, seed: int) -> None:
    """Write weights with what made them; atomic, the same weights give the same bytes.

    Raises:
        WedgeError: ``path`` cannot be written.
    """
    made = {"version": VERSION, "command": command, "seed": seed, "sha256": sha256_of(weights)}
    # One entry only: safetensors writes several in an order of chance.
    write_atomic(path, save(dict(weights), {"missing_axis": json.dumps(made)}))


def sha256_of(weights: Mapping[str, np.ndarray]) -> str:
    """Of names, shapes and numbers, wherever in the file they stand."""
    digest = hashlib.sha256()
    for name, values in sorted(weights.items()):
        digest.update(f"{name}{values.shape}{values.dtype.str}".encode())
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()


def _fit_together(weights: Mapping[str, np.ndarray]) -> bool:
    """Whether these are all arrays of one U-Net."""
    channels = unet.channels_of(weights)
    expected: dict[str, tuple[int, ...]] = {}
    for name, (wide_out, wide_in, side) in unet.layer_shapes(channels).items():
        expected |= {f"{name}.weight": (wide_out, wide_in, side, side), f"{name}.bias": (wide_out,)}
    shapes = {name: values.shape for name, values in weights.items()}
    types = {values.dtype.str for values in weights.values()}
    return len(channels) >= 2 and shapes == expected and types == {"<f4"}
