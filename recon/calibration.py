# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""One calibrated unit: what ball presses taught, kept in a unit folder."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from safetensors.numpy import save

from recon.arrays import Frame
from recon.estimators import (
    GradientEstimator,
    fit_estimator,
    lesson_of,
    restore_estimator,
)
from recon.geometry.lens import Lens, read_lens, write_lens
from recon.geometry.unwarp import Unwarp, prepare_unwarp
from recon.images import read_image, write_image
from recon.lights import unseen_axis
from recon.presses import PressSet, read_presses
from recon.tensor_files import read_tensors
from sensor.dataset import LENS_FILE, Dataset
from sensor.design import Gel, Wedge
from sensor.design_file import design_text, known_design, load_design
from sensor.errors import WedgeError
from sensor.files import new_folder, write_atomic
from sensor.unit import (
    BACKGROUND_FILE,
    DESIGN_FILE,
    GRADIENTS_FILE,
    UNIT_FILE,
    MissingAxis,
    UnitCard,
    read_unit_card,
    write_unit_card,
)

CHANNELS = "RGB"


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """Everything that turns a unit's frames into gradients."""

    card: UnitCard
    """What ``unit.toml`` says."""
    background: Frame
    """Its blank frame, (h, w, 3) uint8 RGB, as the camera gave it."""
    estimator: GradientEstimator
    """From colour to gradient."""
    lens: Lens | None = None
    """``None`` where the frames are taken for undistorted."""
    design: Wedge | None = None
    """That it was built from; ``None`` where nobody named one, or where its numbers are lost."""

    @property
    def gel(self) -> Gel | None:
        """The curved gel that its skin lies on; ``None`` where it counts as flat."""
        return None if self.design is None else self.design.gel

    @property
    def unwarp(self) -> Unwarp:
        """The map from the unit's frames to its gel plane."""
        card = self.card
        size = card.size_px if card.corners_px else None
        return prepare_unwarp(card.frame_size_px, card.corners_px, size, self.lens)

    def save(self, folder: Path, *, again: bool = False) -> None:
        """Write the unit folder, whole or not at all.

        Args:
            folder: a new or empty one.
            again: replace a unit that an earlier run has written, once the new one is whole.

        Raises:
            WedgeError: the folder is not empty or cannot be written.
        """
        with new_folder(folder, over=GRADIENTS_FILE if again else None) as unit:
            write_unit_card(unit, self.card)
            write_image(unit / BACKGROUND_FILE, self.background)
            # One entry: safetensors writes several in any order, and bytes must repeat.
            learnt = {"fitted": f"{self.estimator.name} on {self.card.dataset_sha256}"}
            content = save(self.estimator.tensors(), learnt)
            write_atomic(unit / GRADIENTS_FILE, content)
            if self.lens:
                write_lens(unit / LENS_FILE, self.lens)
            if self.design and known_design(self.design.sha256) is None:
                write_atomic(unit / DESIGN_FILE, design_text(self.design).encode())


def load_calibration(folder: str | Path) -> Calibration:
    """Read a unit folder.

    Raises:
        WedgeError: a file of it is missing or damaged, they do not fit together, or what is given
            names no folder.
    """
    if not isinstance(folder, str | Path):  # a background, most likely
        raise WedgeError(
            f"the unit folder must be text or a Path, not {type(folder).__name__}: give it as the "
            "first argument."
        )
    folder = Path(folder)
    card = read_unit_card(folder)
    background = read_image(folder / BACKGROUND_FILE)
    path = folder / GRADIENTS_FILE
    said, tensors = read_tensors(path, "", "calibrate the unit again")
    estimator_name, _, dataset_sha256 = said.get("fitted", "").partition(" on ")
    if estimator_name != card.estimator:
        raise WedgeError(
            f"{path} holds {estimator_name or 'no'} estimator, but unit.toml names "
            f"{card.estimator}: calibrate the unit again."
        )
    if dataset_sha256 != card.dataset_sha256:
        raise WedgeError(
            f"{path} was fitted to other presses than unit.toml names, so it may be another "
            "unit's: calibrate the unit again."
        )
    try:
        estimator = restore_estimator(card.estimator, tensors, card.channels)
    except WedgeError as error:
        raise WedgeError(f"{path}: {error}") from error
    lens = read_lens(folder / LENS_FILE) if (folder / LENS_FILE).is_file() else None
    calibration = Calibration(
        card=card,
        background=background,
        estimator=estimator,
        lens=lens,
        design=_built_from(folder, card.design_sha256),
    )
    try:
        unwarp = calibration.unwarp
        unwarp.check(background)
    except WedgeError as error:
        raise WedgeError(
            f"{folder}: unit.toml does not fit {BACKGROUND_FILE} or {LENS_FILE}: {error}"
        ) from error
    if unwarp.size_px != card.size_px:
        width, height = unwarp.size_px
        raise WedgeError(
            f"{folder / UNIT_FILE}: size_px must be [{width}, {height}] without corners_px."
        )
    return calibration


def _built_from(folder: Path, sha256: str | None) -> Wedge | None:
    """The design of a unit's hash: a known one, or that of the file in its folder."""
    path, known = folder / DESIGN_FILE, known_design(sha256)
    if known or sha256 is None or not path.is_file():
        return known
    own = load_design(str(path))
    return own if own.sha256 == sha256 else None


def lit_channels(dataset: Dataset) -> tuple[str, MissingAxis]:
    """The colours that have a light, and what stands in for an axis that none of them sees."""
    lights_deg = dataset.card.lights_deg
    lit = CHANNELS if lights_deg is None else "".join(c for c in CHANNELS if c in lights_deg)
    return lit, "network" if unseen_axis(lights_deg, lit) else "none"


def calibrate(
    dataset: Dataset,
    presses: PressSet,
    *,
    estimator: str,
    serial: str,
    created: str,
    metrics: Mapping[str, int | float],
    seed: int,
    design: Wedge | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> Calibration:
    """Fit an estimator to all presses of a dataset and describe the unit.

    Args:
        dataset: where the presses come from.
        presses: the dataset's presses, as read.
        estimator: its name, such as "mlp".
        serial: the unit's name.
        created: today, YYYY-MM-DD.
        metrics: errors on presses held out, measured before.
        seed: of the drawn pixels and the training.
        design: the design that the unit was built from, where somebody named it.
        progress: called with the share that is done.
    """
    lit, _ = lit_channels(dataset)
    everything = lesson_of(estimator, presses.presses, range(len(presses.presses)), seed)
    return unit_of(
        dataset,
        presses,
        fit_estimator(estimator, everything, lit, seed, progress),
        serial=serial,
        created=created,
        metrics=metrics,
        design=design,
    )


def unit_of_set(dataset: Dataset, estimator: str) -> Calibration:
    """A unit that all usable presses of a dataset taught, to measure or to try something with.

    It is named as the dataset, of no real day, and says nothing of its errors.

    Raises:
        WedgeError: no press can be used.
    """
    return calibrate(
        dataset,
        read_presses(dataset),
        estimator=estimator,
        serial=dataset.card.name,
        created="2000-01-01",
        metrics={},
        seed=0,
    )


def unit_of(
    dataset: Dataset,
    presses: PressSet,
    fitted: GradientEstimator,
    *,
    serial: str,
    created: str,
    metrics: Mapping[str, int | float],
    design: Wedge | None,
) -> Calibration:
    """Describe the unit whose estimator was fitted to a dataset's presses; as ``calibrate``."""
    _, missing = lit_channels(dataset)
    card = UnitCard(
        serial=serial,
        created=created,
        design_sha256=None if design is None else design.sha256,
        dataset=dataset.card.name,
        dataset_sha256=dataset.sha256,
        estimator=fitted.name,
        channels=fitted.channels,
        missing_axis=missing,
        mm_per_px=dataset.card.mm_per_px,
        frame_size_px=presses.unwarp.frame_size_px,
        size_px=presses.unwarp.size_px,
        metrics=metrics,
        corners_px=dataset.card.corners_px,
        pad_size_mm=dataset.card.pad_size_mm,
        lights_deg=dataset.card.lights_deg,
        markers=None if presses.dots is None else presses.dots.markers.card(dataset.card.mm_per_px),
        learnt_frames=tuple(press.fingerprint for press in presses.presses),
        learnt_truths=tuple(press.truth_fingerprint for press in presses.presses),
    )
    return Calibration(
        card=card,
        background=presses.background,
        estimator=fitted,
        lens=presses.lens,
        design=design,
    )
