# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Six clips of an MIT Wedge that grips objects, raw mirror view, with the force at each frame.

The gel frame. The base with its green light is at the raw picture's left, the mirror's foot and
the tip at its right. Beyond the foot the camera sees the pad directly: there the tip is at the
left, yet above and below are as in the mirror, so the mirror's picture is reversed. Listing the
corners from below undoes that: x runs from base to tip, and red comes from above, blue from
below, as on the other lab's Wedge.

The clips of 2023-11-11 show another, bluer light, bubbles along one edge, and forces that count
pressing as negative. No clip states a ball's radius, and none has the pose of its object.
"""

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2

from recon.arrays import Frame
from recon.images import write_image
from sensor.dataset import DatasetCard
from sensor.errors import WedgeError
from sensor.files import write_atomic
from sensor.toml import Pair
from validation.importers.folder import write_dataset

SOURCE = "github.com/GelSight-lab/EstimateModulus"
LICENCE = "none stated by GelSight-lab/EstimateModulus; for development only, not redistributed"
CORNERS_FILE = "config/config_100.csv"
CORNER_NAMES = ("bottomleft", "bottomright", "topright", "topleft")
"""In the raw picture; in the gel frame top left, top right, bottom right, bottom left."""
PAD_SIZE_MM = (35.0, 25.5)
"""Between those corners."""
MM_PER_PX = (0.1, 0.1)
STAND_IN_RADIUS_MM = 1.0
NO_BALL = (
    "no ball of known radius: ball_radius_mm is a placeholder that the format requires; "
    "no press is labelled"
)
EVERY = 5
"""Frames of the clip to one of the dataset: about 0.17 s."""


@dataclass(frozen=True, kw_only=True)
class Clip:
    """One clip and what was gripped in it."""

    name: str
    path: str
    """Within the source, without its ending."""
    thing: str


CLIPS = (
    Clip(name="wedge-mit-sphere", path="2023-11-11/small_rigid_sphere_1", thing="a sphere"),
    Clip(name="wedge-mit-lego", path="2023-11-11/lego_1", thing="a Lego brick"),
    Clip(name="wedge-mit-golf-ball", path="2023-12-16/golf_ball_t0", thing="a golf ball"),
    Clip(name="wedge-mit-strawberry", path="2023-12-16/rigid_strawberry_t0", thing="a strawberry"),
    Clip(name="wedge-mit-bolt", path="2024-01-10/bolt_t0", thing="a bolt"),
    Clip(name="wedge-mit-eraser", path="2024-01-10/rose_eraser_t0", thing="a rose eraser"),
)


def import_wedge_mit(clip: Clip, source: Path, folder: Path) -> None:
    """Write every fifth frame of a clip, named by its number there, and ``force.csv`` beside.

    The forces have a row for every frame of the clip.

    Raises:
        WedgeError: the clip, its forces or the corners are missing or damaged, or the clip has
            another number of frames than the forces.
    """
    corners_px = pad_corners_px(source)
    video = _video(clip, source)
    force = force_file(clip, source)
    try:
        rows = force.read_bytes()
    except OSError as error:
        raise WedgeError(f"{force} cannot be read: {error.strerror}.") from error
    count = 0
    for index, frame in enumerate(clip_frames(clip, source)):
        count += 1
        if index % EVERY == 0:
            write_image(folder / _frame_name(index), frame)
    expected = len(rows.splitlines()[1:])
    if count != expected:
        raise WedgeError(
            f"{video} has {count} frames that can be decoded, but {force.name} has "
            f"{expected} rows: copy both again."
        )
    write_atomic(folder / "force.csv", rows)
    card = DatasetCard(
        name=clip.name,
        source=f"{SOURCE}, {clip.path}.avi, every {EVERY}th frame; {NO_BALL}",
        licence=LICENCE,
        mm_per_px=MM_PER_PX,
        ball_radius_mm=STAND_IN_RADIUS_MM,
        background=(_frame_name(0),),
        corners_px=corners_px,
        pad_size_mm=PAD_SIZE_MM,
    )
    write_dataset(folder, card, labels=[])


def force_file(clip: Clip, source: Path) -> Path:
    """Where the clip's forces are, a row for each frame."""
    return source / f"{clip.path}_force_width.csv"


def _video(clip: Clip, source: Path) -> Path:
    return source / f"{clip.path}.avi"


def _frame_name(index: int) -> str:
    return f"frame-{index:03d}.png"


def clip_frames(clip: Clip, source: Path) -> Iterator[Frame]:
    """The frames of a clip, RGB.

    Raises:
        WedgeError: the clip is missing, or yields no frame.
    """
    video = _video(clip, source)
    if not video.is_file():
        raise WedgeError(f"{video} is missing.")
    capture = cv2.VideoCapture(str(video))
    try:
        seen, frame = capture.read()
        if not seen:
            raise WedgeError(f"{video} cannot be decoded: it yields no frame.")
        while seen:
            yield cv2.cvtColor(frame, cv2.COLOR_BGR2RGB)
            seen, frame = capture.read()
    finally:
        capture.release()


def pad_corners_px(source: Path) -> tuple[Pair, Pair, Pair, Pair]:
    """The pad's corners in the gel frame's order, from a table ``Name,x,y`` of the raw picture.

    Raises:
        WedgeError: the table is missing or damaged.
    """
    path = source / CORNERS_FILE
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            named = {
                row["Name"]: (float(row["x"]), float(row["y"])) for row in csv.DictReader(stream)
            }
        top_left, top_right, bottom_right, bottom_left = (named[name] for name in CORNER_NAMES)
    except (OSError, ValueError, KeyError, TypeError, csv.Error) as error:
        raise WedgeError(
            f"{path} must hold Name,x,y of {', '.join(sorted(CORNER_NAMES))}: {error}."
        ) from error
    return top_left, top_right, bottom_right, bottom_left
