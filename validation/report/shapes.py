# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Shapes of the twin and their depth error, as a section of the page."""

from collections.abc import Mapping, Sequence

from validation.figures.png import frames_bytes
from validation.figures.shapes import shape_figure
from validation.report.page import Picture, Section, figure_html, paragraph, table_html
from validation.report.results import signed
from validation.shapes import Shape


def shapes_section(measured: Mapping[str, Sequence[Shape]]) -> Section:
    """Every set's shapes: errors in a table, rows of pictures.

    Args:
        measured: shapes by the name of their dataset.
    """
    rows = [
        [
            f"{shape.name.replace('_', ' ')}, {dataset}",
            f"{shape.truth_mm.max():.3f}",
            f"{shape.rmse_mm:.3f}",
            signed(shape.bias_mm),
            signed(shape.peak_error_mm),
        ]
        for dataset, shapes in measured.items()
        for shape in shapes
    ]
    pictures = "".join(
        figure_html(
            Picture(
                content=frames_bytes(shape_figure(shapes)),
                alt=f"Shapes of {dataset}: frame, difference image, reconstructed and true depth, "
                "and a cut; the table has the errors",
                caption=f"Shapes of {dataset} by a unit that learnt from its balls alone. Cuts go "
                "through the deepest point; dashed: the true skin.",
                wide=True,
            )
        )
        for dataset, shapes in measured.items()
    )
    return Section(
        title="Shapes that are no balls",
        html=paragraph(
            "The digital twin knows the depth of every pixel, so a unit that was calibrated on "
            "balls can be judged on the paper's showcase objects. The truth is the skin, not the "
            "object: the gel bridges grooves and sinks in beside a contact. Depth is integrated "
            "from slopes, so an error at a steep flank tilts everything behind it."
        )
        + table_html(
            "Depth errors in mm where the skin is pressed: root mean square, mean, and at the "
            "deepest point. One frame a shape, rendered.",
            ["shape", "true depth", "RMSE", "bias", "at the deepest point"],
            rows,
        )
        + pictures,
    )
