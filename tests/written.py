# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Files that a test writes again and again."""

from pathlib import Path


def write_anew(path: Path, content: bytes) -> None:
    """In place of what was there; a file that is emptied and filled again waits for the disk."""
    path.unlink(missing_ok=True)
    path.write_bytes(content)
