# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A figure to the bytes of a picture: the same figure gives the same bytes."""

import io

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from validation.figures.style import spell_out, styled

DPI = 180
FRAME_DPI = 140
"""Of figures that show camera frames."""
FRAME_QUALITY = 90
"""Of 100: below it, text beside a frame frays."""


@styled
def png_bytes(figure: Figure, dpi: int = DPI) -> bytes:
    """PNG without a date or a version in it."""
    FigureCanvasAgg(figure)
    spell_out(figure)
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=dpi, bbox_inches=None, metadata={"Software": None})
    return stream.getvalue()


def plot_bytes(figure: Figure) -> bytes:
    """A plot for the page: WebP without loss, two fifths of the PNG."""
    return _webp(figure, DPI, lossless=True, method=4)


def frames_bytes(figure: Figure) -> bytes:
    """A figure that shows camera frames, for the page: WebP, a seventh of the PNG."""
    return _webp(figure, FRAME_DPI, quality=FRAME_QUALITY, method=6)


@styled
def _webp(figure: Figure, dpi: int, **options: int | bool) -> bytes:
    FigureCanvasAgg(figure)
    spell_out(figure)
    stream = io.BytesIO()
    figure.savefig(stream, format="webp", dpi=dpi, bbox_inches=None, pil_kwargs=options)
    return stream.getvalue()
