# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A self-built Wedge: raw frames of a mirror, 50 labelled presses on a marker gel.

The gel frame. In the raw picture the base with its green light is above, the tip below, next to
the direct view. Raised letters on pressed objects (a USB plug's SS mark, a part's maker) read
mirrored, so the one mirror in the path is not undone yet: to have x run from base to tip and
letters read right, raw x becomes y and raw y becomes x, which is how the corners are listed. Red
then comes from above (about -90 degrees) and blue from below.

The scale. Five pictures of caliper jaws 5 mm apart show gaps of 50.4 px across and 50.2 to 51.7
px along the finger in the authors' 240x320 warp; the gel's square grid of dots has a pitch of
19.8 px across and 19.3 (base) to 21.3 px (tip) along it. Both agree on a pitch of 1.965 mm, so
the pad measures 23.9 x 31.1 mm. The four corners leave that 4 % trend along the finger in place.

The circles. The published centres drift along the finger, by -6 px at the tip, against both the
shading and the outline of the discs, and the radii stop at 24 px, the ball's own radius; all are
refitted. Presses 41 and 49 also show the ball's holder: 41 has the lowest quality of all, 0.62;
in 49 the holder is too faint to stand out (0.76, where the median is 0.80).
"""

from pathlib import Path

import numpy as np

from sensor.dataset import BallLabel, DatasetCard
from sensor.errors import WedgeError
from validation.importers.folder import copy_frames, write_dataset

SOURCE = "github.com/wyh5625/gelsight"
LICENCE = "none stated by wyh5625/gelsight; for development only, not redistributed"
BALL_RADIUS_MM = 2.42
MM_PER_PX = (0.1, 0.1)
CORNERS_PX = ((33.0, 58.0), (56.0, 250.0), (185.0, 250.0), (208.0, 61.0))
PAD_SIZE_MM = (31.1, 23.9)
AUTHORS_WARP_PX = (240, 320)

MARKERLESS_CORNERS_PX = ((27.0, 52.0), (55.0, 250.0), (195.0, 247.0), (209.0, 49.0))
MARKERLESS_PAD_SIZE_MM = (31.9, 25.2)


def import_wedge_lab(source: Path, folder: Path) -> None:
    """Write the dataset from ``calibration/``: ``ball-*.jpg`` and ``ball_position/ball-*.txt``.

    Raises:
        WedgeError: a frame or a label is missing or damaged.
    """
    calibration = source / "calibration"
    names = _numbered(calibration, "ball-")
    labels = [_published_label(calibration, name) for name in names]
    copy_frames(calibration, folder, ["bg-0.jpg", *names])
    card = DatasetCard(
        name="wedge-lab",
        source=f"{SOURCE}, calibration/",
        licence=LICENCE,
        mm_per_px=MM_PER_PX,
        ball_radius_mm=BALL_RADIUS_MM,
        background=("bg-0.jpg",),
        corners_px=CORNERS_PX,
        pad_size_mm=PAD_SIZE_MM,
    )
    write_dataset(folder, card, labels, mend_circles=True)


def import_wedge_lab_markerless(source: Path, folder: Path) -> None:
    """Write the dataset from ``markerless/``: 79 presses of the same ball, no labels.

    Its corners were read off its own background; its size follows from the other gel's scale,
    good to about 3 %.

    Raises:
        WedgeError: a frame is missing or damaged.
    """
    markerless = source / "markerless"
    copy_frames(markerless, folder, ["bg-0.jpg", *_numbered(markerless, "cal-")])
    card = DatasetCard(
        name="wedge-lab-markerless",
        source=f"{SOURCE}, markerless/",
        licence=LICENCE,
        mm_per_px=MM_PER_PX,
        ball_radius_mm=BALL_RADIUS_MM,
        background=("bg-0.jpg",),
        corners_px=MARKERLESS_CORNERS_PX,
        pad_size_mm=MARKERLESS_PAD_SIZE_MM,
    )
    write_dataset(folder, card, labels=[])


def _numbered(folder: Path, prefix: str) -> list[str]:
    """File names ``prefix``-number, by number."""
    names = [path.name for path in folder.glob(f"{prefix}*.jpg")]
    if not names:
        raise WedgeError(f"{folder} holds no {prefix}*.jpg.")
    return sorted(names, key=lambda name: int(Path(name).stem.removeprefix(prefix)))


def _published_label(calibration: Path, name: str) -> BallLabel:
    """The authors' circle, from their warp to the gel frame.

    Their warp maps the corners to the outermost pixels' far sides counted from 0, ours to the
    outer edges of the frame, at -0.5.
    """
    path = calibration / "ball_position" / f"{Path(name).stem}.txt"
    try:
        across, along, radius = (float(word) for word in path.read_text().split())
    except (OSError, ValueError) as error:
        raise WedgeError(f"{path} must hold three numbers, x y r: {error}.") from error
    scale = np.array(PAD_SIZE_MM) / MM_PER_PX / AUTHORS_WARP_PX[::-1]
    return BallLabel(
        file=name,
        center_x_px=float(along * scale[0] - 0.5),
        center_y_px=float(across * scale[1] - 0.5),
        contact_radius_px=float(radius * np.sqrt(np.prod(scale))),
    )
