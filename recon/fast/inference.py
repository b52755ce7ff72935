# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Depth of frames of one size where the slope along one axis is inferred."""

import numpy as np

from recon.arrays import ContactMask, DepthMap, GradientField
from recon.depth import Depth, InferredField, fewer_px, inferred_depth
from recon.fast.convolution import CompiledLayers
from recon.fast.poisson import FrameIntegrator
from recon.fast.weighing import FrameWeighing
from recon.integration.poisson import Boundary
from recon.lights import Axis
from recon.unet.weights import shipped_weights
from sensor.toml import Pair

BORDERS: tuple[Boundary, ...] = ("dirichlet", "neumann")


class FrameInference:
    """``recon.depth.inferred_depth`` with its network compiled and its solvers prepared."""

    def __init__(
        self, size_px: tuple[int, int], mm_per_px: Pair, unseen: Axis, *, hinted: bool
    ) -> None:
        """Prepare for frames of (width, height)."""
        width, height = size_px
        rows, columns, pitch_mm = fewer_px(height, width, mm_per_px)
        self._unseen, self._mm_per_px, self._hinted = unseen, mm_per_px, hinted
        self._layers = CompiledLayers(shipped_weights())
        self._integrate = {
            border: FrameIntegrator((columns, rows), pitch_mm, border) for border in BORDERS
        }
        self._weigh = {
            border: FrameWeighing((columns, rows), pitch_mm, border) for border in BORDERS
        }

    def __call__(self, gradient: GradientField, disturbed: ContactMask) -> Depth:
        """Gradient, depth and doubt, of an estimator's gradient (h, w, 2)."""
        return inferred_depth(
            gradient,
            disturbed,
            self._unseen,
            self._mm_per_px,
            hinted=self._hinted,
            weights=self._layers,
            free_depth=self._free_depth,
        )

    def _free_depth(self, field: InferredField, boundary: Boundary) -> DepthMap:
        planes = np.ascontiguousarray(np.moveaxis(field.gradient, -1, 0))
        depth_mm = self._integrate[boundary](planes)
        self._weigh[boundary](planes, depth_mm, (field.unseen, field.network_doubt))
        return depth_mm
