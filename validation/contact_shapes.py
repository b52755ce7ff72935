# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Contact masks and shadows on the twin's shapes, where it is known which points are held.

The truth is the twin's own: the pixels where the skin lies on the object, before paint blurs it.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from recon.arrays import ContactMask, Difference
from recon.contact.disturbed import disturbed_mask
from recon.contact.mask import contact_mask
from recon.contact.shadows import cast_shadows
from recon.estimators import GradientEstimator
from recon.images import read_frame
from recon.pipeline import Reconstruction, reconstruct
from recon.presses import press_reader
from sensor.dataset import Dataset
from sensor.design import Wedge
from simulation.indenters import shapes
from simulation.presses import Press, skin_under
from simulation.skin import Skin, View
from validation.contact import iou
from validation.shadows import ShadowScore, score_shadows, true_shadows


@dataclass(frozen=True, kw_only=True)
class ShapeContact:
    """One shape's contact as found and as it is."""

    name: str
    difference: Difference
    touch: Reconstruction
    truth: ContactMask
    exact: ContactMask
    """Found from the twin's own depth, without a camera: what the mask itself can do."""
    shadows: ShadowScore

    @property
    def iou(self) -> float:
        """Of the mask with the truth."""
        return iou(self.touch.contact, self.truth)

    @property
    def by_slopes(self) -> ContactMask:
        """The mask that a sensor of unknown light would get."""
        touch = self.touch
        return contact_mask(touch.disturbed, touch.depth_mm, touch.gradient, touch.mm_per_px)

    @property
    def exact_iou(self) -> float:
        """The same from the exact skin."""
        return iou(self.exact, self.truth)


def shape_contacts(
    dataset: Dataset, design: Wedge, fitted: GradientEstimator
) -> list[ShapeContact]:
    """The shapes of a twin's set, by an estimator that has seen its balls alone.

    Args:
        dataset: of the twin, labelled balls and shapes.
        design: that the twin rendered.
        fitted: to all colours of the balls.
    """
    reader = press_reader(dataset)
    card = dataset.card
    lights: Mapping[str, float] = card.lights_deg or {}
    found = []
    for name, indenter in shapes(design.pad_size_mm).items():
        frame = reader.unwarp(read_frame(dataset.folder, f"{name}.jpg"))
        height, width = frame.shape[:2]
        view = View(size_px=(width, height), mm_per_px=card.mm_per_px)
        press = Press(
            name=name, indenter=indenter, center_mm=(0.0, 0.0), depth_mm=indenter.depth_mm
        )
        skin = skin_under(design, view, press)
        difference = frame - reader.blank
        touch = reconstruct(
            difference,
            fitted,
            missing="none",
            lights_deg=card.lights_deg,
            mm_per_px=card.mm_per_px,
        )
        dark = cast_shadows(difference, touch.depth_mm, lights, card.mm_per_px)
        found.append(
            ShapeContact(
                name=name,
                difference=difference,
                touch=touch,
                truth=skin.contact,
                exact=_exact_mask(skin, difference, view),
                shadows=score_shadows(name, dark, true_shadows(design, view, skin.depth_mm)),
            )
        )
    return found


def _exact_mask(skin: Skin, difference: Difference, view: View) -> ContactMask:
    """The mask of the twin's own depth and slopes."""
    along_y, along_x = np.gradient(skin.depth_mm, *view.mm_per_px[::-1])
    return contact_mask(
        disturbed_mask(difference),
        skin.depth_mm,
        np.stack([along_x, along_y], -1),
        view.mm_per_px,
    )
