# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A figure to PNG bytes: the same figure gives the same bytes."""

import io

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from validation.figures.style import styled

DPI = 180
FRAME_DPI = 140
"""Of figures that show camera frames, whose noise compresses badly."""


@styled
def png_bytes(figure: Figure, dpi: int = DPI) -> bytes:
    """PNG without a date or a version in it."""
    FigureCanvasAgg(figure)
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=dpi, bbox_inches=None, metadata={"Software": None})
    return stream.getvalue()
