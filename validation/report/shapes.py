# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Shapes of the twin and their depth error, as a section of the page."""

from collections.abc import Mapping, Sequence

from validation.figures.png import frames_bytes
from validation.figures.shapes import shape_figure
from validation.report.page import Picture, Section, figure_html, paragraph, table_html
from validation.report.results import signed
from validation.shapes import TOUCHED, Shape, name_in_words

Measured = Mapping[str, Mapping[str, Sequence[Shape]]]
"""Shapes by the name of their dataset, then by the estimator that reconstructed them."""


def shapes_section(measured: Measured) -> Section:
    """Every set's shapes: errors in a table, rows of pictures of the first estimator's."""
    estimators = list(dict.fromkeys(name for found in measured.values() for name in found))
    rows = [
        _row(dataset, index, found, estimators)
        for dataset, found in measured.items()
        for index in range(len(found[estimators[0]]))
    ]
    pictures = "".join(
        figure_html(
            Picture(
                content=frames_bytes(shape_figure(found[estimators[0]])),
                alt=f"Shapes of {dataset}: frame, difference image, reconstructed and true depth, "
                "and a cut; the table lists the errors",
                caption=f"Shapes of {dataset} by a unit calibrated on its balls only, "
                f"estimator {estimators[0]}. Cuts go through the deepest point; dashed: the true "
                "skin.",
                wide=True,
            )
        )
        for dataset, found in measured.items()
    )
    return Section(
        title="Shapes other than balls",
        html=paragraph(
            "The digital twin knows the depth of every pixel, so a unit that was calibrated on "
            "balls can be judged on the paper's showcase objects. The truth is the skin, not the "
            "object: the gel bridges grooves and sinks in next to a contact. Depth is integrated "
            "from slopes, so an error at a steep flank tilts everything behind it."
        )
        + table_html(
            f"Depth errors in mm where the skin is deeper than {100 * TOUCHED:g} % of the shape's "
            "depth: root mean square, mean, and at the deepest point. One rendered frame per"
            " shape.",
            [
                "shape",
                "true depth",
                *(f"RMSE, {name}" for name in estimators),
                f"bias, {estimators[0]}",
                f"at the deepest point, {estimators[0]}",
            ],
            rows,
        )
        + pictures,
    )


def _row(
    dataset: str,
    index: int,
    found: Mapping[str, Sequence[Shape]],
    estimators: Sequence[str],
) -> list[str]:
    shape = found[estimators[0]][index]
    return [
        f"{name_in_words(shape.name)}, {dataset}",
        f"{shape.truth_mm.max():.3f}",
        *(f"{found[name][index].rmse_mm:.3f}" if name in found else "–" for name in estimators),
        signed(shape.bias_mm),
        signed(shape.peak_error_mm),
    ]
