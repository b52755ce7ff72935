# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Dots, contact and force for the page of `wedge reproduce`, of the sets that are here."""

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING

from app._progress import progress
from sensor.dataset import read_dataset
from sensor.design import STANDARD

if TYPE_CHECKING:
    from recon.arrays import Unwarped
    from recon.estimators import GradientEstimator
    from recon.markers.tracking import Tracked
    from sensor.toml import Pair
    from validation.contact_shapes import ShapeContact
    from validation.datasets import KnownDataset
    from validation.force import ForceCurve
    from validation.report.page import Section
    from validation.report.results import DatasetResults

TWIN = "twin-standard"
SHOWN = "wedge-lab"
"""A real marker gel, by presses of it."""
SHOWN_PRESSES = tuple(f"ball-{number}.jpg" for number in range(8, 20))


def touch_sections(
    results: "Sequence[DatasetResults]",
    estimator: str,
    twin: "GradientEstimator | None",
    executor: Executor,
) -> "list[Section]":
    """The sections, of the sets that are here.

    Args:
        results: of datasets with labelled balls on this machine; masks are those of the presses
            that each fold of the error table holds out.
        estimator: what masks and depths are made with; one of the tables'.
        twin: it, fitted to all balls of ``TWIN``, where that is here.
        executor: does the sets side by side.
    """
    from validation.datasets import dataset_folder, known_datasets
    from validation.dots import COUNTED_FRAMES, hand_counted, score_detection
    from validation.importers.wedge_mit import CLIPS
    from validation.report.contact_shapes import shape_contact_section
    from validation.report.touch import contact_section, marker_section

    known = known_datasets()
    here = {name for name, dataset in known.items() if dataset.find() is not None}
    sections: list[Section] = []
    with progress("contact and dots") as show:
        held = executor.submit(_shapes, dataset_folder(TWIN), twin) if twin else None
        clips = [dataset_folder(clip.name) for clip in CLIPS if {clip.name, TWIN} <= here]
        curves = executor.submit(_curves, dataset_folder(TWIN), clips) if clips else None
        counted = {
            name: frame
            for name in COUNTED_FRAMES
            if name in here and (frame := hand_counted(name)) is not None
        }
        scores = {name: score_detection(*frame) for name, frame in counted.items()}
        if SHOWN in scores:
            sections.append(marker_section(scores, SHOWN, *_shown(dataset_folder(SHOWN))))
        found = curves.result() if curves else []
        show(0.5, "contact of shapes")
        shapes = [shape_contact_section(TWIN, estimator, held.result())] if held else []
    overlaps = {item.table.dataset: item.table.contact[estimator] for item in results}
    return [contact_section(overlaps, found, left_out(known)), *shapes, *sections]


def left_out(known: "Mapping[str, KnownDataset]") -> list[str]:
    """What the page does not show of dots and force, and where to put the sets that it lacks."""
    from validation.dots import COUNTED_FRAMES
    from validation.importers.wedge_mit import CLIPS

    of_each = dict.fromkeys(COUNTED_FRAMES, "dots on other marker gels")
    of_each[SHOWN] = "dots on a real gel"
    of_each |= {clip.name: "contact against force" for clip in CLIPS}
    lacking = {
        (of_each[name], dataset.sought)
        for name, dataset in known.items()
        if name in of_each and dataset.find() is None
    }
    return [f"Not shown: {what}. For that, {sought}." for what, sought in sorted(lacking)]


def _shapes(folder: Path, fitted: "GradientEstimator") -> "list[ShapeContact]":
    from validation.contact_shapes import shape_contacts

    return shape_contacts(read_dataset(folder), STANDARD, fitted)


def _curves(twin: Path, clips: list[Path]) -> "list[ForceCurve]":
    from validation.force import force_curve, lend

    lent = lend(read_dataset(twin))
    return [force_curve(read_dataset(clip), lent) for clip in clips]


def _shown(folder: Path) -> "tuple[list[tuple[str, Unwarped, Tracked]], Pair]":
    """Name, frame and dots of some presses, and their pitch."""
    from recon.images import read_frame
    from recon.presses import press_reader

    reader = press_reader(read_dataset(folder))
    assert reader.dots is not None
    shown = []
    for name in SHOWN_PRESSES:
        image = reader.unwarped(name, read_frame(folder, name))
        shown.append((name, image, reader.dots.track(image)))
    return shown, reader.dataset.card.mm_per_px
