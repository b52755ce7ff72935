# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A figure to the bytes of a picture: the same figure gives the same bytes."""

import io

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from validation.figures.style import styled

DPI = 180
FRAME_DPI = 140
"""Of figures that show camera frames."""
WEBP_QUALITY = 90


@styled
def png_bytes(figure: Figure, dpi: int = DPI) -> bytes:
    """PNG without a date or a version in it."""
    FigureCanvasAgg(figure)
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=dpi, bbox_inches=None, metadata={"Software": None})
    return stream.getvalue()


@styled
def webp_bytes(figure: Figure) -> bytes:
    """WebP, for figures that show camera frames: a seventh of the PNG, whose noise stays large."""
    FigureCanvasAgg(figure)
    stream = io.BytesIO()
    options = {"quality": WEBP_QUALITY, "method": 6}
    figure.savefig(stream, format="webp", dpi=FRAME_DPI, bbox_inches=None, pil_kwargs=options)
    return stream.getvalue()
