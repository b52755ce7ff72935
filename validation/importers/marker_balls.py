# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Two units of a GelSlim-like sensor with a dense marker gel: ball presses without labels.

No corners are published, so the frames are used as they are. Which ball was pressed is not
certain: its radius and the scale are published as two pairs that contradict each other.
"""

from pathlib import Path

from sensor.dataset import DatasetCard
from sensor.errors import WedgeError
from validation.importers.folder import copy_frames, write_dataset

SOURCE = "github.com/siyuandong16/gelsight_heightmap_reconstruction"
LICENCE = "none stated by siyuandong16; for development only, not redistributed"
UNITS = {"marker-balls-a": "unit-a", "marker-balls-b": "unit-b"}
"""The folder of each dataset."""
BACKGROUND = "ref.jpg"
BALL_RADIUS_MM = 2.38
MM_PER_PX = (0.106, 0.106)
AMBIGUITY = "ball and scale are not certain: R 2.38 mm at 0.106 mm/px, or R 3.8 mm at 0.10577"


def import_marker_balls(name: str, source: Path, folder: Path) -> None:
    """Write the dataset from one unit's folder: ball presses ``sample_*``, ``reconstruct_*``.

    Raises:
        WedgeError: the background is missing, a frame cannot be read, or there is no press.
    """
    presses = sorted(path.name for path in source.glob("sample_*.jpg"))
    if not presses:
        raise WedgeError(f"{source} holds no sample_*.jpg.")
    objects = sorted(path.name for path in source.glob("reconstruct_*.jpg"))
    copy_frames(source, folder, [BACKGROUND, *presses, *objects])
    card = DatasetCard(
        name=name,
        source=f"{SOURCE}, {UNITS[name]}; {AMBIGUITY}",
        licence=LICENCE,
        mm_per_px=MM_PER_PX,
        ball_radius_mm=BALL_RADIUS_MM,
        background=(BACKGROUND,),
    )
    write_dataset(folder, card, labels=[])
