# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Files and folders that are either whole or absent."""

import errno
import fcntl
import os
import re
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from glob import escape
from pathlib import Path
from typing import Any

from sensor.documents import json_bytes
from sensor.errors import WedgeError

TOKEN_BYTES = 6
"""Of a temporary name, as hexadecimal digits at its end."""
DRAFT = ".draft"
"""End of the name of a folder that is not whole yet."""
NOT_EMPTY = "already exists and is not empty"


def read_text(path: Path, most_bytes: int) -> str:
    """The whole of a file that people write, and no more: no pipe, no device that never ends.

    Lines end in a line feed, whatever they end in there; a mark of the bytes' order is left out.

    Raises:
        WedgeError: it is missing, no file or cannot be read, or longer than that.
        UnicodeDecodeError: it is not UTF-8.
    """
    try:
        if path.is_fifo():
            raise WedgeError(f"{path} is a pipe: name a file.")
        with path.open("rb") as stream:
            content = stream.read(most_bytes + 1)
    except OSError as error:
        raise WedgeError(f"{path} cannot be read: {error.strerror}.") from error
    if len(content) > most_bytes:
        raise WedgeError(f"{path} is longer than {most_bytes >> 20} MB: is it the right file?")
    return re.sub("\r\n?", "\n", content.decode("utf-8-sig"))


def write_atomic(path: Path, content: bytes) -> None:
    """Write ``content`` to ``path``, or leave ``path`` as it was.

    Raises:
        WedgeError: the disk is full, read-only or the folder cannot be made.
    """
    with new_file(path) as temporary, temporary.open("xb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())


def write_json(path: Path | None, document: Any) -> None:
    """Write a document where somebody asked for one; what is no finite number becomes null.

    Raises:
        WedgeError: as ``write_atomic``.
    """
    if path is not None:
        write_atomic(path, json_bytes(document))


def clear_leftovers(path: Path) -> None:
    """Take away what writes of ``path`` that were cut off, as by a kill, have left beside it."""
    for left in path.parent.glob(_hidden_names(path)):
        with suppress(OSError):
            left.unlink()


@contextmanager
def new_file(path: Path) -> Iterator[Path]:
    """Yield a temporary path for a file that becomes ``path`` when the block succeeds.

    For what is too long for ``write_atomic``. Nothing is left behind when the block fails, and a
    file that was there stays.

    Raises:
        WedgeError: the disk is full, read-only or the folder cannot be made.
    """
    temporary = _hidden_sibling(path)
    try:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except FileExistsError as error:
            place = f"{path.parent} is not a folder that takes files"
            raise WedgeError(f"{path} cannot be written: {place}.") from error
        with _called(path, temporary):
            yield temporary
        temporary.replace(path)
    except OSError as error:
        raise WedgeError(f"{path} cannot be written: {error.strerror}.") from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


@contextmanager
def new_folder(
    folder: Path, *, over: str | None = None, alike: str | None = None
) -> Iterator[Path]:
    """Yield an empty temporary folder that becomes ``folder`` when the block succeeds.

    Nothing is left behind when the block fails; what a killed process has left of the same folder
    is taken away by the next that makes it. An existing empty ``folder`` is replaced, and with
    ``over`` one that holds a file of this name, as only an earlier run would have made. With
    ``alike`` one that holds a file of this name stays: another process has made the same meanwhile.
    What is whole and cannot be moved there is kept beside it, and the sentence says where.

    Raises:
        WedgeError: ``folder`` exists and is not to be or cannot be replaced, or cannot be written.
    """
    check_new_folder(folder, over=over or alike)
    _clear_drafts(folder)
    try:
        with _draft_of(folder) as draft:
            try:
                with _called(folder, draft):
                    yield draft
            except BaseException:
                shutil.rmtree(draft, ignore_errors=True)
                raise
            temporary = draft.rename(_hidden_sibling(folder))  # whole: no run clears it any more
    except OSError as error:
        raise WedgeError(f"{folder} cannot be written: {error.strerror}.") from error
    try:
        _put_in_place(temporary, folder, over, alike)
    except OSError as error:
        lies = f"; the complete result is in {temporary}: move it" if temporary.is_dir() else ""
        raise WedgeError(f"{folder} cannot be written: {error.strerror}{lies}.") from error


@contextmanager
def _draft_of(folder: Path) -> Iterator[Path]:
    """Make a folder for what is not whole yet, locked while its maker lives."""
    while True:
        draft = _hidden_sibling(folder, DRAFT)
        draft.mkdir(parents=True)
        with suppress(FileNotFoundError):
            handle = os.open(draft, os.O_RDONLY | os.O_DIRECTORY)
            with suppress(OSError):  # some file systems know no locks
                fcntl.flock(handle, fcntl.LOCK_EX)
            if draft.is_dir():
                break
            os.close(handle)  # another process has cleared it before it was locked
    try:
        yield draft
    finally:
        os.close(handle)


def _clear_drafts(folder: Path) -> None:
    """Take away drafts of ``folder`` whose makers are gone."""
    for left in folder.parent.glob(_hidden_names(folder, DRAFT)):
        with suppress(OSError):
            handle = os.open(left, os.O_RDONLY | os.O_DIRECTORY)
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(left, ignore_errors=True)
            finally:
                os.close(handle)


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Run the block while no other process or thread is in here with the same folder.

    For what is read, changed and written back. The lock leaves no file behind and ends with the
    process. On a drive of the network it holds among the processes of one computer.

    Raises:
        WedgeError: there is no such folder, or it cannot be read.
    """
    try:
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    except OSError as error:
        raise WedgeError(f"{folder} cannot be read: {error.strerror}.") from error
    try:
        with suppress(OSError):  # some file systems know no locks
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


@contextmanager
def _called(path: Path, temporary: Path) -> Iterator[None]:
    """Let what goes wrong be told of ``path``, as nobody knows the temporary one."""
    try:
        yield
    except WedgeError as error:
        if str(temporary) not in str(error):
            raise
        raise WedgeError(str(error).replace(str(temporary), str(path))) from error


def check_outputs(*files: Path | None) -> None:
    """Refuse what could not be written, before minutes are spent on what it would hold.

    Raises:
        WedgeError: names the file, and the folder that is in its way; or two are one file.
    """
    taken = set[Path]()
    for file in files:
        if file is None:
            continue
        if file.resolve() in taken:
            raise WedgeError(
                f"{file} cannot be written: it is named for another output too; name two files."
            )
        taken.add(file.resolve())
        try:
            if file.is_dir():
                raise WedgeError(f"{file} cannot be written: it is a folder; name a file.")
            _check_place(file)
        except OSError as error:  # of a folder that may not be looked into
            raise WedgeError(f"{file} cannot be written: {error.strerror}.") from error


def check_new_folder(folder: Path, *, over: str | None = None) -> None:
    """Refuse what ``new_folder`` could not replace, before minutes are spent on what it would hold.

    Raises:
        WedgeError: as ``refuse_kept_folder``; or none can be made or moved to where it is to be.
    """
    refuse_kept_folder(folder, over=over)
    _check_place(folder)
    if folder.is_symlink() or os.path.ismount(folder):
        raise WedgeError(
            f"{folder} cannot be written: it is a link or a mount point, which no folder can "
            "replace; name a new folder."
        )


def _check_place(path: Path) -> None:
    """Refuse what the folder around it would not take."""
    folder = path.absolute().parent
    while not folder.exists():
        if folder.is_symlink():
            raise WedgeError(
                f"{path} cannot be written: {folder} is a link that leads nowhere; name a folder."
            )
        folder = folder.parent
    if not folder.is_dir() or not os.access(folder, os.W_OK):
        raise WedgeError(f"{path} cannot be written: {folder} is not a folder that takes files.")


def refuse_kept_folder(folder: Path, *, over: str | None = None) -> None:
    """Refuse a folder in which something lies already.

    Raises:
        WedgeError: ``folder`` is a file, or holds files but none of the name ``over``, or cannot
            be read.
    """
    try:
        kept = _is_kept(folder, over)
    except OSError as error:
        raise WedgeError(f"{folder} cannot be read: {error.strerror}.") from error
    if kept:
        why = "is a file" if folder.is_file() else NOT_EMPTY
        raise WedgeError(f"{folder} {why}: name a new folder.")


def _is_kept(folder: Path, over: str | None) -> bool:
    try:
        with os.scandir(folder) as entries:  # once, as another process may take it away
            files = {entry.name: entry.is_file() for entry in entries}
    except FileNotFoundError:
        return False
    except NotADirectoryError:
        return folder.exists()  # else something above it is a file: said when it is written
    return bool(files) and not (over and files.get(over))


def sha256_of_files(paths: Mapping[str, Path]) -> str:
    """Hash of named files: the same names and contents give the same hash, wherever they lie."""
    import hashlib  # here, as it loads OpenSSL, and a Pi's settings are read without it

    digest = hashlib.sha256()
    for name, path in sorted(paths.items()):
        with path.open("rb") as stream:
            content = hashlib.file_digest(stream, "sha256").hexdigest()
        digest.update(f"{name}\0{content}\0".encode())
    return digest.hexdigest()


def _put_in_place(temporary: Path, folder: Path, over: str | None, alike: str | None) -> None:
    """Move a folder to where none is, or an empty one, or one that it may replace.

    What another process puts there meanwhile is judged anew; what was there stays if no move helps.

    Raises:
        OSError: no folder can be moved there, or what is there by now is not to be replaced.
    """
    before = _hidden_sibling(folder)
    try:
        while not _moved(temporary, folder):
            if alike and (folder / alike).is_file():
                shutil.rmtree(temporary, ignore_errors=True)
                return
            if _is_kept(folder, over):
                raise FileExistsError(errno.EEXIST, f"it {NOT_EMPTY}")
            shutil.rmtree(before, ignore_errors=True)
            with suppress(FileNotFoundError):  # another process takes it away now
                folder.replace(before)
    except BaseException:  # also where somebody presses Ctrl-C between the two moves
        with suppress(OSError):
            before.replace(folder)
        raise
    shutil.rmtree(before, ignore_errors=True)


def _moved(source: Path, target: Path) -> bool:
    """Whether a folder could be moved; False if there is one with files in it."""
    try:
        source.replace(target)
    except OSError as error:
        if error.errno in (errno.ENOTEMPTY, errno.EEXIST):
            return False
        raise
    return True


def _hidden_sibling(path: Path, end: str = "") -> Path:
    return path.parent / f".{path.name}.{os.urandom(TOKEN_BYTES).hex()}{end}"


def _hidden_names(path: Path, end: str = "") -> str:
    """Pattern of what ``_hidden_sibling`` gives."""
    return f".{escape(path.name)}.{'[0-9a-f]' * 2 * TOKEN_BYTES}{end}"
