# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What one frame says of the skin, and what follows from it: the same of every way to depth."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from jaxtyping import Bool

from recon.arrays import ContactMask, DepthMap, Difference, GradientField
from recon.contact.known_light import held_in_light, is_known
from recon.contact.mask import contact_mask, dents
from recon.contact.patches import ContactPatch, contact_patches
from recon.contact.shadows import cast_shadows
from recon.depth_error import slope_error
from recon.estimators import GradientEstimator
from recon.estimators.default import Default
from recon.estimators.shading import blank_colors
from recon.integration.poisson import Boundary
from recon.markers.tracking import Tracked
from sensor.toml import Pair


def in_known_light(
    estimator: GradientEstimator | None, size_px: tuple[int, int], mm_per_px: Pair
) -> Default | None:
    """The estimator, if its sensor is lit as the rendered standard and shows as much of the pad.

    Args:
        estimator: that reads the slopes; ``None`` where nobody said.
        size_px: (width, height) of the frames.
        mm_per_px: pixel pitch along x and y.
    """
    ours = estimator if isinstance(estimator, Default) else None
    return ours if ours and is_known(ours.unlike, size_px, mm_per_px) else None


@dataclass(frozen=True, kw_only=True)
class Touched:
    """The skin in one frame."""

    difference: Difference
    """(h, w, 3) float32: unwarped frame minus unwarped background, in shares of full scale."""
    gradient: GradientField
    """(h, w, 2): slopes of the depth along x and y, mm/mm."""
    depth_mm: DepthMap
    """(h, w) float32, mm, positive where pushed in; noise may leave some below zero."""
    disturbed: Bool[np.ndarray, "_ _"]
    """(h, w): where the colour changed."""
    boundary: Boundary
    """``"dirichlet"``: the border was held at zero; ``"neumann"``: left free as gel moved there."""
    mm_per_px: Pair
    """Pixel pitch along x and y."""
    lights_deg: Mapping[str, float] | None = None
    """Where the lights sit; ``None`` where nobody said."""
    estimator: GradientEstimator | None = None
    """That read the slopes; ``None`` where nobody said."""
    doubt: DepthMap | None = None
    """How far off an inferred slope is expected to be, mm/mm; ``None`` where both were measured."""
    dots: Tracked | None = None
    """Of a marker gel: where each dot is now."""

    @cached_property
    def contact(self) -> ContactMask:
        """Where something touches; worked out when first asked for."""
        return self._held_of(self.disturbed)

    def refuse_if_overwritten(self) -> None:
        """Refuse to work out anything from arrays that are another frame's by now; these stay."""

    def _held_of(self, disturbed: ContactMask) -> ContactMask:
        """What something holds of the disturbed gel, by colours too where their light is known."""
        self.refuse_if_overwritten()
        size_px = self.depth_mm.shape[::-1]
        ours = in_known_light(self.estimator, size_px, self.mm_per_px)
        if ours is None or self.dots is not None:  # what dots hide has no colour of its own
            return contact_mask(disturbed, self.depth_mm, self.gradient, self.mm_per_px)
        patches, _ = dents(disturbed, self.depth_mm)
        return held_in_light(
            self.difference,
            partial(blank_colors, ours.light),
            self.depth_mm,
            self.gradient,
            self.mm_per_px,
            patches > 0,
        )

    @cached_property
    def deepest_mm(self) -> float:
        """The largest depth where something touches; 0 where nothing does."""
        self.refuse_if_overwritten()
        return float(self.depth_mm[self.contact].max(initial=0))

    @property
    def contact_mm2(self) -> float:
        """Area of the contact."""
        return float(self.contact.sum() * self.mm_per_px[0] * self.mm_per_px[1])

    @cached_property
    def patches(self) -> tuple[ContactPatch, ...]:
        """The separate places of contact, the largest first."""
        self.refuse_if_overwritten()
        return contact_patches(self.contact, self.depth_mm, self.mm_per_px)

    @cached_property
    def slope_error(self) -> GradientField | None:
        """Standard deviation expected of each slope's error; ``None`` where it is not known."""
        self.refuse_if_overwritten()
        return slope_error(self.estimator, self.gradient, self.lights_deg, self.doubt)

    @cached_property
    def shadow(self) -> ContactMask:
        """Where dented skin keeps a light off: the slopes there are to be doubted."""
        self.refuse_if_overwritten()
        lights = self.lights_deg or {}
        shadows = cast_shadows(self.difference, self.depth_mm, lights, self.mm_per_px)
        return np.asarray(shadows.any(-1))
