# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Files and folders that are either whole or absent."""

import hashlib
import os
import secrets
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from sensor.errors import WedgeError


def write_atomic(path: Path, content: bytes) -> None:
    """Write ``content`` to ``path``, or leave ``path`` as it was.

    Raises:
        WedgeError: the disk is full, read-only or the folder cannot be made.
    """
    temporary = _hidden_sibling(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with temporary.open("xb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(path)
    except OSError as error:
        raise WedgeError(f"{path} cannot be written: {error.strerror}.") from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


@contextmanager
def new_folder(folder: Path, *, over: str | None = None) -> Iterator[Path]:
    """Yield an empty temporary folder that becomes ``folder`` when the block succeeds.

    Nothing is left behind when the block fails. An existing empty ``folder`` is replaced, and with
    ``over`` one that holds a file of this name, as only an earlier run would have made.

    Raises:
        WedgeError: ``folder`` exists and is not to be replaced, or cannot be written.
    """
    refuse_kept_folder(folder, over=over)
    temporary, before = _hidden_sibling(folder), _hidden_sibling(folder)
    try:
        temporary.mkdir(parents=True)
        yield temporary
        with suppress(FileNotFoundError):  # none is there, or another process takes it away now
            if any(folder.iterdir()):
                folder.replace(before)
            else:
                folder.rmdir()
        temporary.replace(folder)
    except OSError as error:
        raise WedgeError(f"{folder} cannot be written: {error.strerror}.") from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
        shutil.rmtree(before, ignore_errors=True)


def refuse_kept_folder(folder: Path, *, over: str | None = None) -> None:
    """Refuse what ``new_folder`` would not replace.

    Raises:
        WedgeError: ``folder`` is a file, or holds files but none of the name ``over``.
    """
    if not folder.exists() or (over and (folder / over).is_file()):
        return
    if not folder.is_dir() or any(folder.iterdir()):
        raise WedgeError(f"{folder} already exists and is not empty: name a new folder.")


def sha256_of_files(paths: Mapping[str, Path]) -> str:
    """Hash of named files: the same names and contents give the same hash, wherever they lie."""
    digest = hashlib.sha256()
    for name, path in sorted(paths.items()):
        with path.open("rb") as stream:
            content = hashlib.file_digest(stream, "sha256").hexdigest()
        digest.update(f"{name}\0{content}\0".encode())
    return digest.hexdigest()


def _hidden_sibling(path: Path) -> Path:
    return path.parent / f".{path.name}.{secrets.token_hex(6)}"
