# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Contact masks and shadows on the twin's shapes, as a section of the page."""

from collections.abc import Sequence

import numpy as np

from validation.contact_shapes import ShapeContact
from validation.figures.contact import contact_figure
from validation.figures.png import plot_bytes
from validation.report.page import Picture, Section, code, figure_html, paragraph, table_html
from validation.shapes import name_in_words


def shape_contact_section(dataset: str, estimator: str, shapes: Sequence[ShapeContact]) -> Section:
    """How masks and shadows fit what is known of the twin's shapes.

    Args:
        dataset: its name.
        estimator: the name of the one that read the slopes.
        shapes: as found.
    """
    mean = float(np.mean([shape.iou for shape in shapes]))
    rows = [
        [
            name_in_words(shape.name),
            str(int(shape.truth.sum())),
            f"{shape.iou:.3f}",
            f"{shape.exact_iou:.3f}",
            str(shape.shadows.cast_px),
            f"{shape.shadows.recall:.2f}",
            f"{shape.shadows.precision:.2f}",
        ]
        for shape in shapes
    ]
    picture = Picture(
        content=plot_bytes(contact_figure(shapes)),
        alt=f"Contact masks of {len(shapes)} shapes over the pixels that each object touches",
        caption="Gray: touched and found. Orange: found, but the gel only follows. Blue: touched, "
        f"but missed. Mean IoU {mean:.3f}.",
        wide=True,
    )
    return Section(
        title="Where shapes touch",
        html=paragraph(
            f"Shapes of {dataset}, by the estimator {estimator}, trained on balls only. The truth "
            "is where the skin lies on the object; skin that bridges a groove does not count."
        )
        + table_html(
            "Overlap of the mask with the truth, as measured and from the exact skin; then the"
            " share of the cast shadows that was found, and the share of the shadows found that"
            " really lack half of their light.",
            [
                *("shape", "touched [px]", "IoU", "IoU, exact skin"),
                *("cast shadow [px]", "found", "right"),
            ],
            rows,
        )
        + figure_html(picture)
        + code(f"python -m benchmarks.contact --estimator {estimator}"),
    )
