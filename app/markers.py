# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge markers`: the dots of a marker gel, found and followed."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from app._frames import UnitFrame, read_checked, unit_frames
from app._growing_files import Growing, file_names, growing
from app._output import OutputFile, keep_inputs, print_rows
from app._progress import progress
from sensor.errors import WedgeError
from sensor.files import check_outputs, write_json

if TYPE_CHECKING:
    from recon.arrays import Unwarped
    from recon.geometry.unwarp import Unwarp
    from recon.markers.tracking import MarkerTracker, Tracked
    from sensor.toml import Pair

HEADINGS = ("frame", "seen", "mean moved [mm]", "most moved [mm]", "")
COLUMNS = "frame,time_ns,row,column,x_mm,y_mm,dx_mm,dy_mm,seen,image"


def main(
    unit: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="UNIT")],
    where: Annotated[tyro.conf.Positional[tuple[str, ...]], tyro.conf.arg(metavar="WHERE...")],
    out: Path,
    background: str | None = None,
    frames: int | None = None,
    json: OutputFile = None,
) -> int:
    """Follow the dots of a marker gel and write how each has moved.

    The dots are found in the blank frame; their size and spacing need not be given. In a video or a
    stream, each frame is followed from the one before. Images, and the presses of a dataset, are
    each searched starting from the dots at rest.

    OUT receives four files. markers.csv has a line for each dot of each frame: its row and column
    on the gel, its position at rest and its displacement in mm in the gel frame, whether it was
    seen or inferred from its neighbours, and the image if frames are files. markers.png shows the
    frame in which the dots moved most, overlay.webp all frames with arrows. markers.mcap holds dots
    and shifts as ROS 2 point clouds, for Foxglove and RViz.

    A dataset gives its blank frames, then its labelled presses or, if it has none, all its
    pictures. In a stream, damaged frames are left out and counted; Ctrl-C or SIGTERM ends it, and
    the results so far are written. If the disk fills up, the run ends and reports which frames are
    kept, and the exit status is 2.

    Example: wedge markers units/wedge-001 press.mp4 --out moved

    Example: wedge markers units/wedge-001 http://10.55.0.1:8080 --out moved --frames 300

    Args:
        unit: A unit folder, written by `wedge calibrate` for a gel with dots.
        where: Images, or one video, folder, dataset, recording (.mcap), usb:0 or http address.
        out: The folder for the results; new or empty.
        background: A blank frame taken today; by default the unit's own.
        frames: Stop after this many frames.
        json: Write the results of each frame here as JSON.
    """
    from recon.calibration import load_calibration
    from recon.markers.tracking import marker_tracker

    check_outputs(*(out / name for name in file_names("markers")), json)
    keep_inputs([unit, *where, background], [json])
    calibration = load_calibration(unit)
    unwarp, pitch = calibration.unwarp, calibration.card.mm_per_px
    blank = calibration.background if background is None else read_checked(background, unwarp)
    tracker = marker_tracker(unwarp(blank))
    if tracker is None:
        named = background or f"{unit}'s blank frame"
        raise WedgeError(f"{named} shows no grid of dots: `wedge markers` needs a marker gel.")
    markers = tracker.markers
    print(
        f"{len(markers)} dots, {markers.card(pitch)['spacing_mm']:.2f} mm apart, "
        f"{markers.card(pitch)['diameter_mm']:.2f} mm wide"
    )
    with (
        unit_frames(where, unwarp, frames) as came,
        growing(out, "markers", COLUMNS, calibration.gel) as files,
        progress("markers") as show,
    ):
        run = _Run(tracker, unwarp, pitch, files)
        for frame in came:
            if frame.image is None:
                continue
            run.add(frame, from_rest=came.apart)
            if files.failed:
                break
            show(len(run.rows) / max(len(where), len(run.rows) + 1), frame.name)
        span = f"Frames {run.rows[0]['frame']} to {run.rows[-1]['frame']}"
        said = files.finish(run.figure(), span)
    cells = [_cells(*told, len(markers)) for told in zip(run.shown, run.rows, strict=True)]
    print_rows(HEADINGS, cells, f", in {out / 'markers.csv'}")
    if (out / "overlay.webp").exists():
        print(f"Open {out / 'overlay.webp'}")
    for sentence in said:
        print(sentence, file=sys.stderr)
    document = {"unit": str(unit), "markers": markers.card(pitch), "frames": run.rows}
    write_json(json, {**document, "remarks": [*came.remarks, *said]})
    came.tell()
    return 2 if files.failed else 0


class _Run:
    """How dots moved frame after frame, written as they come."""

    def __init__(
        self, tracker: "MarkerTracker", unwarp: "Unwarp", mm_per_px: "Pair", files: Growing
    ) -> None:
        self.rows: list[dict[str, Any]] = []
        """As in the JSON file."""
        self.shown: list[str] = []
        """The frames' names, for a table."""
        self._tracker, self._unwarp = tracker, unwarp
        self._mm_per_px, self._files = mm_per_px, files
        self._tracked: Tracked | None = None
        self._farthest: tuple[float, str, Unwarped, Tracked] | None = None
        """How far, in mm, dots moved in the frame in which they did most; its name, and all."""

    def add(self, frame: UnitFrame, *, from_rest: bool) -> None:
        """Take in the next whole frame, unless it cannot be written.

        Args:
            frame: to be searched.
            from_rest: whether it has nothing to do with the one before.
        """
        from validation.figures.markers import marker_overlay

        assert frame.image is not None
        image = self._unwarp(frame.image)
        self._tracked = tracked = self._tracker.track(image, None if from_rest else self._tracked)
        size_px = image.shape[1], image.shape[0]
        with self._files.writing():
            self._files.recording.add_dots(frame.time_ns, tracked, self._mm_per_px, size_px)
            self._files.table.add(*_lines(frame, tracked, self._mm_per_px, size_px))
        if self._files.failed:
            return
        self._files.clip.add(marker_overlay(image, tracked, self._mm_per_px))
        self.rows.append(_row(frame, tracked, self._mm_per_px))
        self.shown.append(frame.shown)
        most_mm = self.rows[-1]["most_mm"] or 0.0
        if self._farthest is None or most_mm > self._farthest[0]:
            self._farthest = most_mm, frame.file or frame.name, image, tracked

    def figure(self) -> bytes:
        """A PNG of the frame in which dots moved most."""
        from validation.figures.markers import displacement_figure
        from validation.figures.png import png_bytes

        assert self._farthest is not None
        _, name, image, tracked = self._farthest
        title = f"{Path(name).name}, displacement × 3"
        return png_bytes(displacement_figure(image, tracked, self._mm_per_px, title=title))


def _row(frame: UnitFrame, tracked: "Tracked", mm_per_px: "Pair") -> dict[str, object]:
    """What is said of a frame in JSON."""
    import numpy as np

    seen_mm = np.hypot(*tracked.displacement_mm(mm_per_px).T)[tracked.seen]
    return {
        "frame": frame.number,
        "image": frame.file or None,
        "time_ns": frame.time_ns,
        "seen": len(seen_mm),
        "mean_mm": float(seen_mm.mean()) if len(seen_mm) else None,
        "most_mm": float(seen_mm.max()) if len(seen_mm) else None,
        "word": tracked.word,
    }


def _cells(shown: str, row: dict[str, Any], dots: int) -> list[str]:
    """A row of the table, by the name that is shown of its frame."""
    return [
        shown,
        f"{row['seen']} of {dots}",
        "–" if row["mean_mm"] is None else f"{row['mean_mm']:.3f}",
        "–" if row["most_mm"] is None else f"{row['most_mm']:.3f}",
        str(row["word"]),
    ]


def _lines(
    frame: UnitFrame,
    tracked: "Tracked",
    mm_per_px: "Pair",
    size_px: tuple[int, int],
) -> list[list[Any]]:
    """Each dot of a frame, as in the file of all frames."""
    markers = tracked.markers
    rows = []
    for cell, rest_mm, moved_mm, seen in zip(
        markers.cell,
        markers.rest_mm(mm_per_px, size_px),
        tracked.displacement_mm(mm_per_px),
        tracked.seen,
        strict=True,
    ):
        lengths_mm = [f"{length_mm:.4f}" for length_mm in (*rest_mm, *moved_mm)]
        rows.append([frame.number, frame.time_ns, *cell, *lengths_mm, int(seen), frame.file])
    return rows
