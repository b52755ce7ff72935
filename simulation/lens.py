# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The lens of a design's camera as ``camera.toml`` tells it, which raw sets carry."""

from typing import Final

import numpy as np

from sensor.design import Wedge
from sensor.toml import toml_text
from simulation.raw_view import pad_corners_px

LEAST_RMS_PX: Final = 0.001
"""Of what is written: the file allows no zero."""
NODES: Final = 201


def lens_text(design: Wedge) -> str | None:
    """The ``camera.toml`` that undoes a design's lens over the pad.

    The angle from the axis, the arcus tangent of an ideal radius r, is fitted by two radial terms,
    to 0.08 px on both designs. With a third, ten times as exact, the picture would fold between the
    pad and the frame's corners.

    Returns:
        ``None`` where there is nothing to undo.
    """
    camera = design.camera
    if camera.projection == "pinhole":
        return None
    focal_px, middle_px = camera.focal_length_px, (camera.width_px / 2, camera.height_px / 2)
    center_px = (middle_px[0] - 0.5, middle_px[1] - 0.5)  # pixel centres are integers
    corners = np.array(pad_corners_px(design))
    farthest = np.linalg.norm(corners - center_px, axis=1).max() / focal_px  # radians
    # As Chebyshev's nodes: what is left is about as large everywhere.
    seen = farthest * np.sin(np.linspace(0, np.pi / 2, NODES))
    ideal = np.tan(seen)
    powers = ideal[:, None] ** [1, 3, 5]
    terms, *_ = np.linalg.lstsq(powers, seen, rcond=None)
    off_px = focal_px * np.abs(powers @ terms - seen)
    linear, *further = terms.tolist()
    document = {
        "frame_size_px": [camera.width_px, camera.height_px],
        "focal_px": [focal_px * linear] * 2,
        "center_px": list(center_px),
        "radial": [*(term / linear for term in further), 0.0],
        "rms_px": max(float(np.sqrt((off_px**2).mean())), LEAST_RMS_PX),
    }
    told = f"# Of the design, not measured; over the pad at most {off_px.max():.2f} px off.\n"
    return told + toml_text(document)
