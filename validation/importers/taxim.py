# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The Taxim wheel's bench GelSight: 48 labelled presses, three lights about 120 degrees apart."""

from importlib.util import find_spec
from pathlib import Path

from sensor.dataset import DatasetCard
from validation.importers.folder import write_dataset
from validation.importers.taxim_pack import BACKGROUND, read_taxim_pack, write_taxim_frames

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
    pack = read_taxim_pack(source)
    write_taxim_frames(pack, folder)
    write_dataset(
        folder,
        DatasetCard(
            name="taxim-gelsight",
            source=SOURCE,
            licence=LICENCE,
            mm_per_px=MM_PER_PX,
            ball_radius_mm=BALL_RADIUS_MM,
            background=(BACKGROUND,),
        ),
        pack.labels,
    )
