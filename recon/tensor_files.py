# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Arrays of safetensors files, which may come from anywhere."""

from pathlib import Path

import numpy as np
from safetensors import SafetensorError, safe_open

from sensor.errors import WedgeError

KINDS = frozenset("BOOL F16 F32 F64 I8 I16 I32 I64 U8 U16 U32 U64".split())
"""Of numbers that numpy has; a file may also hold BF16 or F8."""
Said = dict[str, str]
Tensors = dict[str, np.ndarray]
MOST_LEARNT = 1000.0
"""Of what was learnt, a hundred times the largest number that any training here has left: from
there on, a few layers' sums would leave what a float32 can hold."""


def read_tensors(path: Path, what: str, remedy: str) -> tuple[Said, Tensors]:
    """What a safetensors file says of itself, and its arrays by name.

    Args:
        path: of the file.
        what: it is read as, for the sentence.
        remedy: what to do where that cannot be.

    Raises:
        WedgeError: it is missing, damaged, or holds a kind of numbers that numpy has not.
    """
    if path.is_fifo():
        raise WedgeError(f"{path} cannot be read{what}: it is a pipe; {remedy}.")
    try:
        with safe_open(path, framework="numpy") as file:
            kinds = {name: file.get_slice(name).get_dtype() for name in file.keys()}
            for name, kind in kinds.items():
                if kind not in KINDS:
                    raise WedgeError(f"{path} cannot be read{what}: {name} is of {kind}; {remedy}.")
            return file.metadata() or {}, {name: file.get_tensor(name) for name in kinds}
    except (OSError, SafetensorError) as error:
        raise WedgeError(f"{path} cannot be read{what}: {error}; {remedy}.") from error


def learnt(values: np.ndarray) -> bool:
    """Whether training can have left these numbers: finite ones of sensible size."""
    return bool(np.isfinite(values).all() and np.abs(values).max(initial=0) <= MOST_LEARNT)
