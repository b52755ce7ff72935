# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Datasets by name: found, imported once into the user's cache, and handed over as folders."""

import difflib
import hashlib
import os
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from recon.labels import ball_fit, circles
from sensor.dataset import CARD_FILE, read_dataset
from sensor.design import FINGER, STANDARD
from sensor.errors import WedgeError
from sensor.files import new_folder, sha256_of_files
from sensor.toml import Pair
from validation.importers import known_depth, marker_balls, taxim, twin, wedge_lab, wedge_mit


@dataclass(frozen=True, kw_only=True)
class KnownDataset:
    """A dataset that has a name, and how its folder comes about."""

    name: str
    summary: str
    presses: int
    """Labelled ones."""
    ball_radius_mm: float | None
    """``None`` where none is known; the folder's card then holds a stand-in."""
    mm_per_px: Pair
    licence: str
    origin: str
    find: Callable[[], Path | None]
    """The source, a file or a folder, where this machine has it."""
    sought: str
    """Where ``find`` looks, in words that tell what to do."""
    importer: Callable[[Path, Path], None]
    """Writes the dataset from a source into an empty folder."""

    def folder(self, source: Path) -> Path:
        """Where the imported set lies or will lie: a changed source or importer moves it.

        Raises:
            WedgeError: the source cannot be read.
        """
        files = [source] if source.is_file() else [p for p in source.rglob("*") if p.is_file()]
        fits = Path(ball_fit.__file__), Path(circles.__file__)
        code = [*Path(taxim.__file__).parent.glob("*.py"), *fits]
        try:
            frames = sha256_of_files({str(p.relative_to(source.parent)): p for p in files})
            importers = sha256_of_files({p.name: p for p in code})
        except OSError as error:
            raise WedgeError(f"{error.filename} cannot be read: {error.strerror}.") from error
        key = hashlib.sha256(f"{frames}{importers}".encode()).hexdigest()
        return cache_folder() / f"{self.name}-{key[:12]}"


def known_datasets() -> dict[str, KnownDataset]:
    """Every set that a command accepts by name, by that name."""
    return {known.name: known for known in DATASETS}


def dataset_folder(name: str | Path) -> Path:
    """The folder of a dataset, given as a folder or by a known name; imported where needed.

    Raises:
        WedgeError: the name is unknown, its source is absent, or the cache cannot be written.
    """
    path = Path(name)
    if (path / CARD_FILE).is_file():
        return path
    by_name = known_datasets()
    known = by_name.get(str(name))
    if known is None:
        if path.is_dir():
            raise WedgeError(f"{path} is not a dataset folder: it has no {CARD_FILE}.")
        near = difflib.get_close_matches(str(name), by_name, n=2, cutoff=0.5)
        hint = (
            f"did you mean {' or '.join(near)}?"
            if near
            else "`wedge data list` shows the known ones."
        )
        raise WedgeError(f"{str(name)!r} is neither a folder nor a known dataset; {hint}")
    source = known.find()
    if source is None:
        raise WedgeError(f"the dataset {known.name} is not on this machine: {known.sought}.")
    folder = known.folder(source)
    if (folder / CARD_FILE).is_file():
        return folder
    with new_folder(folder, alike=CARD_FILE) as temporary:
        known.importer(source, temporary)
    return folder


def each_once(names: Iterable[str]) -> list[str]:
    """Names of datasets, or folders, without those whose folder was named before."""
    first: dict[Path | str, str] = {}
    for name in names:
        try:
            first.setdefault(dataset_folder(name).resolve(), name)
        except WedgeError:  # whoever reads it says so
            first.setdefault(name, name)
    return list(first.values())


def told_apart(names: Iterable[str]) -> dict[str, str]:
    """What to call each dataset: its own name, and where several share it how it was named too."""
    own = {}
    for name in names:
        try:
            own[name] = read_dataset(dataset_folder(name)).card.name
        except WedgeError:  # whoever reads it says so
            own[name] = name
    count = Counter(own.values())
    return {
        name: card if count[card] == 1 or card == name else f"{card} ({name})"
        for name, card in own.items()
    }


def on_this_machine(names: Sequence[str]) -> list[str]:
    """Those of some known datasets that are here; what is left out is told on stderr.

    Raises:
        WedgeError: none is here.
    """
    sought = {known.name: known.sought for known in DATASETS if known.find() is None}
    here = [name for name in names if name not in sought]
    if not here:
        raise WedgeError(f"no dataset is on this machine: {sought[names[0]]}.")
    for name in names:
        if name in sought:
            print(f"left out {name}: {sought[name]}", file=sys.stderr)
    return here


def cache_folder() -> Path:
    """Where imported datasets are kept: ``WEDGE_CACHE``, else the user's cache."""
    if own := os.environ.get("WEDGE_CACHE"):
        return Path(own)
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "gelsight-wedge"


def shared_folder() -> Path:
    """Where sets that may not be redistributed are looked for."""
    if own := os.environ.get("WEDGE_DATA"):
        return Path(own)
    return Path(__file__).resolve().parents[2] / "shared" / "data"


def _shared(name: str) -> Callable[[], Path | None]:
    """Finds a folder among the shared ones."""

    def find() -> Path | None:
        folder = shared_folder() / name
        return folder if folder.is_dir() else None

    return find


def _shared_sought(name: str) -> str:
    return (
        f"put {name}/ into the folder named by WEDGE_DATA, or into shared/data next to the checkout"
    )


DATASETS = (
    KnownDataset(
        name="taxim-gelsight",
        summary="bench GelSight, clear gel, three lights 120° apart",
        presses=48,
        ball_radius_mm=taxim.BALL_RADIUS_MM,
        mm_per_px=taxim.MM_PER_PX,
        licence=taxim.LICENCE,
        origin=taxim.SOURCE,
        find=taxim.find_taxim,
        sought="pip install taxim==1.4.1",
        importer=taxim.import_taxim,
    ),
    *(
        KnownDataset(
            name=f"twin-{design.name}",
            summary=f"digital twin of the {design.name} Wedge, clear gel, rendered",
            presses=40,
            ball_radius_mm=twin.BALL_RADIUS_MM,
            mm_per_px=twin.mm_per_px(design),
            licence=twin.LICENCE,
            origin=twin.SOURCE,
            find=partial(twin.find_twin, design),
            sought=f"wedge simulate --design {design.name} --scene set renders one like it",
            importer=twin.import_twin,
        )
        for design in (STANDARD, FINGER)
    ),
    KnownDataset(
        name="wedge-lab",
        summary="self-built Wedge, marker gel, raw mirror view",
        presses=50,
        ball_radius_mm=wedge_lab.BALL_RADIUS_MM,
        mm_per_px=wedge_lab.MM_PER_PX,
        licence=wedge_lab.LICENCE,
        origin=wedge_lab.SOURCE,
        find=_shared("wedge-lab"),
        sought=_shared_sought("wedge-lab"),
        importer=wedge_lab.import_wedge_lab,
    ),
    KnownDataset(
        name="wedge-lab-markerless",
        summary="the same Wedge, clear gel, presses not labelled yet",
        presses=0,
        ball_radius_mm=wedge_lab.BALL_RADIUS_MM,
        mm_per_px=wedge_lab.MM_PER_PX,
        licence=wedge_lab.LICENCE,
        origin=wedge_lab.SOURCE,
        find=_shared("wedge-lab"),
        sought=_shared_sought("wedge-lab"),
        importer=wedge_lab.import_wedge_lab_markerless,
    ),
    KnownDataset(
        name="known-depth",
        summary="GelSlim-like sensor, clear gel",
        presses=22,
        ball_radius_mm=known_depth.BALL_RADIUS_MM,
        mm_per_px=known_depth.MM_PER_PX,
        licence=known_depth.LICENCE,
        origin=known_depth.SOURCE,
        find=_shared("known-depth"),
        sought=_shared_sought("known-depth"),
        importer=known_depth.import_known_depth,
    ),
    KnownDataset(
        name="known-depth-spheres",
        summary="the same sensor, a ball at four commanded depths",
        presses=4,
        ball_radius_mm=known_depth.BALL_RADIUS_MM,
        mm_per_px=known_depth.MM_PER_PX,
        licence=known_depth.LICENCE,
        origin=known_depth.SOURCE,
        find=_shared("known-depth"),
        sought=_shared_sought("known-depth"),
        importer=known_depth.import_known_depth_spheres,
    ),
    *(
        KnownDataset(
            name=name,
            summary=f"GelSlim-like sensor, marker gel, {unit}; ball radius uncertain",
            presses=0,
            ball_radius_mm=marker_balls.BALL_RADIUS_MM,
            mm_per_px=marker_balls.MM_PER_PX,
            licence=marker_balls.LICENCE,
            origin=marker_balls.SOURCE,
            find=_shared(f"marker-balls/{unit}"),
            sought=_shared_sought("marker-balls"),
            importer=partial(marker_balls.import_marker_balls, name),
        )
        for name, unit in marker_balls.UNITS.items()
    ),
    *(
        KnownDataset(
            name=clip.name,
            summary=f"MIT Wedge, clear gel: {clip.thing}, not labelled",
            presses=0,
            ball_radius_mm=None,
            mm_per_px=wedge_mit.MM_PER_PX,
            licence=wedge_mit.LICENCE,
            origin=wedge_mit.SOURCE,
            find=_shared("wedge-mit"),
            sought=_shared_sought("wedge-mit"),
            importer=partial(wedge_mit.import_wedge_mit, clip),
        )
        for clip in wedge_mit.CLIPS
    ),
)
"""Every set that a command accepts by name."""
