# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Finds the circles of a sensor's presses: each by itself, then all centred in one way.

An outline is not drawn to the side that is lit more, and gives the centres of rendered balls within
0.2 px. But on some real sensors a dent turns so much light away to one side that a disc's outer
circles are centred elsewhere than its inner ones. The outline then misleads on every press, by
where on the pad it lies, and the shading is the better guide. Centres of one sensor are chosen
alike: a mixture scatters more than either (docs/decisions/0043-agreed-centers.md).
"""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from statistics import median

from recon.images import read_frame
from recon.labels.circles import Circle
from recon.labels.find_circle import find_circle
from recon.presses import PressReader
from sensor.dataset import BallLabel

WIDEST_SPREAD = 0.02
"""Outlines centre circles up to this median of ``Circle.spread`` over presses: 0.006 to 0.015 on
taxim-gelsight, known-depth and four rendered sets, 0.022 on marker-balls-a, 0.033 and 0.052 on
wedge-lab's gels (``python -m validation.circles SET`` tells a labelled set's)."""
FEWEST = 5
"""Circles with a spread, below which outlines centre them anyway."""


def found_labels(
    reader: PressReader,
    files: Sequence[str],
    pool: Executor,
    progress: Callable[[float], None] = lambda _: None,
) -> list[BallLabel]:
    """The labels of the frames in which a ball shows, centred in one way; as ``found_circles``."""
    return labels_of(reader, agreed(found_circles(reader, files, pool, progress)))


def found_circles(
    reader: PressReader,
    files: Sequence[str],
    pool: Executor,
    progress: Callable[[float], None] = lambda _: None,
) -> dict[str, Circle]:
    """The circles of the frames in which a ball shows, by file, each by itself.

    Args:
        reader: of the dataset.
        files: names of its frames.
        pool: finds the circles.
        progress: called with the share that is done.

    Raises:
        WedgeError: a frame is missing, damaged or of another size.
    """
    circles = dict[str, Circle]()
    found = pool.map(partial(found_circle, reader), files, chunksize=2)
    for done, (file, circle) in enumerate(zip(files, found, strict=True), start=1):
        if circle is not None:
            circles[file] = circle
        progress(done / len(files))
    return circles


def found_circle(reader: PressReader, file: str) -> Circle | None:
    """The circle of one frame, ``None`` where no ball shows.

    Raises:
        WedgeError: the frame is missing, damaged or of another size.
    """
    dataset = reader.dataset
    difference = reader.difference(reader.unwarped(file, read_frame(dataset.folder, file)))
    ball_mm = dataset.ball_radius_mm(dataset.label(file))
    return find_circle(difference, ball_mm, dataset.card.mm_per_px)


def agreed(circles: Mapping[str, Circle]) -> dict[str, Circle]:
    """The circles of one sensor, by file, centred by their outlines or all by their shading."""
    spreads = [one.spread for one in circles.values() if one.spread is not None]
    if len(spreads) < FEWEST or median(spreads) <= WIDEST_SPREAD:
        return dict(circles)
    return {
        file: replace(one, center_px=one.shading_px or one.center_px)
        for file, one in circles.items()
    }


def labels_of(reader: PressReader, circles: Mapping[str, Circle]) -> list[BallLabel]:
    """Circles as labels; a frame that has a label keeps the ball that this states."""
    labels = []
    for file, circle in circles.items():
        before = reader.dataset.label(file)
        stated_mm = None if before is None else before.ball_radius_mm
        labels.append(circle.label(file, reader.unwarp.size_px, stated_mm))
    return labels
