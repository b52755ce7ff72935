# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The Taxim wheel's bench GelSight: 48 labelled presses, three lights about 120 degrees apart."""

import zipfile
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from recon.images import write_image
from sensor.dataset import BallLabel, DatasetCard
from sensor.errors import WedgeError
from validation.importers.folder import write_dataset

SOURCE = "PyPI taxim 1.4.1, calib/gelsight/dataPack.npz (CMU)"
LICENCE = "MIT"
BALL_RADIUS_MM = 2.0
MM_PER_PX = (0.0295, 0.0295)


def find_taxim() -> Path | None:
    """The wheel's data file, found without importing the package, which is heavy."""
    spec = find_spec("taxim")
    if spec is None or not spec.submodule_search_locations:
        return None
    path = Path(spec.submodule_search_locations[0]) / "calib" / "gelsight" / "dataPack.npz"
    return path if path.is_file() else None


def import_taxim(source: Path, folder: Path) -> None:
    """Write the dataset from ``dataPack.npz``; circles are its authors', good to a pixel or two.

    Raises:
        WedgeError: the source is damaged or not the expected archive.
    """
    try:
        with np.load(source, allow_pickle=False) as pack:
            background, frames = pack["f0"], pack["imgs"]
            centers, radii = pack["touch_center"], pack["touch_radius"]
    except (OSError, EOFError, KeyError, ValueError, zipfile.BadZipFile) as error:
        raise WedgeError(f"{source} is not Taxim's dataPack.npz: {error}.") from error
    frames = np.ascontiguousarray(frames[..., ::-1])  # BGR there
    background = np.ascontiguousarray(background[..., ::-1]).astype(np.uint8)
    write_image(folder / "background.png", background)
    np.savez(folder / "frames.npz", frames=frames)
    labels = [
        BallLabel(
            file=f"frames.npz#{index}",
            center_x_px=float(center[0]),
            center_y_px=float(center[1]),
            contact_radius_px=float(radius),
        )
        for index, (center, radius) in enumerate(zip(centers, radii, strict=True))
    ]
    write_dataset(
        folder,
        DatasetCard(
            name="taxim-gelsight",
            source=SOURCE,
            licence=LICENCE,
            mm_per_px=MM_PER_PX,
            ball_radius_mm=BALL_RADIUS_MM,
            background=("background.png",),
        ),
        labels,
    )
