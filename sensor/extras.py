# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How packages that not everybody needs are installed."""

CPU_INDEX = "https://download.pytorch.org/whl/cpu"
"""PyTorch's; from elsewhere a wheel for Linux brings CUDA."""


def how_to_install(extra: str) -> str:
    """What to do where a package is missing, as the end of a sentence.

    From the checkout: no index has the project. The quotes keep zsh from reading the brackets.

    Args:
        extra: as ``pyproject.toml`` calls it, such as ``live``.
    """
    index = f"--extra-index-url {CPU_INDEX} " if extra == "train" else ""
    return f'run `pip install {index}".[{extra}]"` in the checkout'
