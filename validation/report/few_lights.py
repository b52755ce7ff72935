# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""One light or two instead of three, as a section of the page."""

from collections.abc import Mapping, Sequence

from validation.few_lights import WAYS, Touch
from validation.figures.few_lights import few_lights_figure
from validation.figures.png import frames_bytes
from validation.report.page import Picture, Section, figure_html, paragraph, table_html
from validation.shapes import DEEPER_THAN_MM, name_in_words


def few_lights_section(measured: Mapping[str, Sequence[Touch]]) -> Section:
    """Every set's touches with few lights: depth errors in a table, rows of pictures.

    Args:
        measured: touches by the name of their dataset.
    """
    rows = [
        [
            f"{name_in_words(touch.name)}, {dataset}",
            f"{touch.truth_mm.max():.3f}",
            *(f"{touch.rmse_mm[way]:.3f}" for way, _, _ in WAYS),
            *(_least(touch, way) for way in ("two lights, zero", "two lights, network")),
        ]
        for dataset, touches in measured.items()
        for touch in touches
    ]
    pictures = "".join(
        figure_html(
            Picture(
                content=frames_bytes(few_lights_figure(touches)),
                alt=f"Touches of {dataset}: true depth, depth from two lights with Gx zero and "
                "with the network, from one light with the network, from three, and the"
                " uncertainty",
                caption=f"Touches of {dataset}. With Gx set to zero, the depth is flattened and "
                "smeared across the lights and turns negative (orange) next to the contact; with "
                "the network it is never negative. Uncertainty: the expected error of the "
                "inferred slope. The true depth of the ball starts at the rim of the contact.",
                wide=True,
            )
        )
        for dataset, touches in measured.items()
    )
    return Section(
        title="One light or two",
        html=paragraph(
            "Lights on one line show one slope. The other is inferred: a depth that only goes into "
            "the gel is fitted to the slope that was seen, and a network trained on random "
            "surfaces and rendered presses corrects it from what lies around each pixel. A unit "
            "calibrated with such lights does this by itself."
        )
        + table_html(
            f"Depth RMSE in mm: for shapes, where the skin is deeper than {DEEPER_THAN_MM:g} mm;"
            " for balls, in the contact, as in the error table. Then the least depth in per cent"
            " of the height. One rendered frame per touch; the ball press was held out.",
            [
                "touch",
                "true depth",
                *(way for way, _, _ in WAYS),
                "least, zero",
                "least, network",
            ],
            rows,
        )
        + pictures,
    )


def _least(touch: Touch, way: str) -> str:
    """How far below zero a depth goes, of the height."""
    return f"{min(0, round(100 * touch.lowest(way)))} %".replace("-", "−")
