# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What `wedge track` and `wedge markers` write: files that grow with every frame, then pictures."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from app._output import RowFile
from sensor.errors import WedgeError
from sensor.files import refuse_kept_folder, write_atomic

if TYPE_CHECKING:
    from recon.touch_file import TouchFile
    from sensor.design import Gel
    from validation.figures.overlay import Clip


@dataclass(frozen=True, kw_only=True)
class Growing:
    """The files of one run: whole at any time, and kept from its first whole frame on."""

    out: Path
    names: tuple[str, str, str, str]
    """As of ``file_names``."""
    recording: "TouchFile"
    table: RowFile
    clip: "Clip"
    """To be given a picture of every whole frame once it is written."""
    failed: list[WedgeError] = field(default_factory=list)
    """What could not be written."""

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Note what cannot be written instead of raising it: a full disk takes nothing.

        Raises:
            WedgeError: there is nothing to keep yet.
        """
        try:
            yield
        except WedgeError as error:
            if self.clip.empty:
                raise
            self.failed.append(error)

    def finish(self, figure: bytes, span: str, rest: str = "") -> list[str]:
        """Close the files and write the pictures.

        Args:
            figure: a PNG.
            span: which frames are kept.
            rest: how to go on where a full disk ended the run.

        Returns:
            What is to be said where something could not be written.
        """
        rest = rest if self.failed else ""
        for file in (self.table, self.recording):
            with self.writing():
                file.close()
        recording, _, picture, clip = self.names
        short = f"; the last second may be missing from {recording}" if self.failed else ""
        for name, content in ((picture, figure), (clip, self.clip.webp())):
            with self.writing():
                write_atomic(self.out / name, content)
        if not self.failed:
            return []
        return [f"{self.failed[0]} {span} are kept in {self.written}{short}.{rest}"]

    @property
    def written(self) -> str:
        """The folder and what was written there."""
        names = (name for name in self.names if (self.out / name).exists())
        return f"{self.out}: {', '.join(names)}"


def file_names(name: str) -> tuple[str, str, str, str]:
    """Of the recording, the table, the figure and the clip that a run writes."""
    return f"{name}.mcap", f"{name}.csv", f"{name}.png", "overlay.webp"


@contextmanager
def growing(out: Path, name: str, columns: str, gel: "Gel | None" = None) -> Iterator[Growing]:
    """Begin files that stay, whatever ends the run.

    Only where that is before its first whole frame, they go again; so does a folder made here.

    Args:
        out: the folder; new or empty.
        name: of the files, but for their endings.
        columns: of the table, commas between them.
        gel: that the recorded skin is laid on; by default it is flat.

    Raises:
        WedgeError: the folder holds files, or cannot be written.
    """
    from recon.touch_file import TouchFile
    from validation.figures.overlay import Clip

    refuse_kept_folder(out)
    was_there = out.exists()
    names, clip = file_names(name), Clip()
    recording = TouchFile(out / names[0], gel)  # not over that of a run that began just now
    try:
        with recording, RowFile(out / names[1], columns.split(",")) as table:
            files = Growing(out=out, names=names, recording=recording, table=table, clip=clip)
            yield files
    except BaseException:
        if clip.empty:
            for file in names:
                (out / file).unlink(missing_ok=True)
            if not was_there:
                with suppress(OSError):
                    out.rmdir()
        else:
            print(f"Results so far are kept in {files.written}.", file=sys.stderr)
        raise
