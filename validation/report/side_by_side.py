# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Estimators beside each other, as a section of the page."""

from collections.abc import Mapping, Sequence

from validation.figures.png import plot_bytes
from validation.figures.side_by_side import side_by_side_figure
from validation.report.page import Picture, Section, figure_html, paragraph
from validation.side_by_side import Unseen


def side_by_side_section(found: Mapping[str, Sequence[Unseen]]) -> Section:
    """Maps, error against slope and coverage, a figure a dataset.

    Args:
        found: what each estimator says, by the dataset's name.
    """
    pictures = "".join(
        figure_html(
            Picture(
                content=plot_bytes(side_by_side_figure(unseen)),
                alt="Angle errors of "
                + ", ".join(f"{x.estimator} {x.error_deg.mean():.2f}°" for x in unseen)
                + f" on {name}: maps over the ball, error against slope, coverage of intervals",
                caption=f"{name}, {unseen[0].n_presses} presses held out in the first fold, "
                f"{len(unseen[0].truth):,} contact pixels. Above: mean error by the direction "
                "that the true skin faces; the ball is seen from the camera, x to the right and y "
                "down. The interval is the one that the estimator itself reports.",
                wide=True,
            )
        )
        for name, unseen in found.items()
    )
    return Section(
        title="Estimators side by side",
        html=paragraph(
            "The same pixels, judged by every estimator. An even map means that no direction is "
            "favoured; a flat curve means that steep flanks are known as well as gentle ones."
        )
        + pictures,
    )
