# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Contact masks of shapes over the truth."""

from collections.abc import Sequence

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from validation.contact_shapes import ShapeContact
from validation.figures.style import BLUE, FAINT, FULL_IN, ORANGE, SOFT, card, styled
from validation.shapes import name_in_words

COLUMNS = 4
AROUND_PX = 8
"""Shown beside what is held."""


@styled
def contact_figure(shapes: Sequence[ShapeContact]) -> Figure:
    """A picture a shape: held and found, found alone, held but missed."""
    rows = -(-len(shapes) // COLUMNS)
    figure = card(FULL_IN, 2.45 * rows)
    places = figure.subplots(rows, COLUMNS).ravel()
    for place, shape in zip(places, shapes, strict=False):
        place.imshow(_overlay(shape), interpolation="nearest")
        place.set_title(f"{name_in_words(shape.name)}: {shape.iou:.2f}")
        place.set(xticks=[], yticks=[])
        place.spines[:].set_visible(True)
    for place in places[len(shapes) :]:
        place.set_visible(False)
    return figure


def _overlay(shape: ShapeContact) -> np.ndarray:
    """RGB of the part where something is held or found."""
    found, truth = shape.touch.contact, shape.truth
    picture = np.full((*truth.shape, 3), to_rgb(FAINT))
    for mask, color in ((found & truth, SOFT), (found & ~truth, ORANGE), (truth & ~found, BLUE)):
        picture[mask] = to_rgb(color)
    rows, columns = np.nonzero(truth | found)
    middle = [(int(along.min()) + int(along.max())) // 2 for along in (rows, columns)]
    half = max(np.ptp(rows), np.ptp(columns)) // 2 + AROUND_PX
    window = tuple(slice(max(0, place - half), place + half + 1) for place in middle)
    return np.asarray(picture[window])
