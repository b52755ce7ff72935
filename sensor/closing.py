# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What is closed where a block that uses it ends."""

from abc import ABC, abstractmethod
from typing import Self


class Closing(ABC):
    """Base of sources and files: ``with`` closes them."""

    @abstractmethod
    def close(self) -> None:
        """Let go of what is held."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
