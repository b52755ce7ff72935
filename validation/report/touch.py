# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Dots, contact and force, as sections of the page."""

from collections.abc import Mapping, Sequence

from recon.arrays import Unwarped
from recon.markers.tracking import Tracked
from sensor.toml import Pair
from validation.contact import Overlap, mean_iou
from validation.dots import DetectionScore
from validation.figures.force import force_figure
from validation.figures.markers import displacement_figure, marker_overlay
from validation.figures.overlay import clip_bytes
from validation.figures.png import frames_bytes, plot_bytes
from validation.force import ForceCurve
from validation.report.page import (
    Picture,
    Section,
    bullets,
    code,
    figure_html,
    gallery_html,
    paragraph,
    table_html,
)

PRESS_MS = 500
"""Of each press in the clip."""


def marker_section(
    scores: Mapping[str, DetectionScore],
    gel: str,
    presses: Sequence[tuple[str, Unwarped, Tracked]],
    mm_per_px: Pair,
) -> Section:
    """How the dots of real gels were found and followed.

    Args:
        scores: by dataset, against dots counted by eye.
        gel: one of them, that is shown.
        presses: of it: name, frame and its dots; the first in a still picture, all in a clip.
        mm_per_px: of these frames.
    """
    name, image, tracked = presses[0]
    name = f"{name} of {gel}"
    clip = Picture(
        content=clip_bytes(
            [marker_overlay(frame, dots, mm_per_px) for _, frame, dots in presses], PRESS_MS
        ),
        alt="Press after press on the same gel, with arrows on the dots that moved",
        caption=f"{len(presses)} presses on {gel}, as shown by wedge markers. A ring marks a dot "
        "that is not seen and is carried along by its neighbours: "
        f"{sum(int((~dots.seen).sum()) for *_, dots in presses)} of "
        f"{sum(len(dots.seen) for *_, dots in presses)}.",
    )
    picture = Picture(
        content=frames_bytes(displacement_figure(image, tracked, mm_per_px, title=name)),
        alt=f"A press on a gel of {len(tracked.markers)} dots; arrows from each dot's rest"
        " position",
        caption=f"{name}: {int(tracked.seen.sum())} of {len(tracked.markers)} dots seen. "
        "Arrows begin at the dot's rest position and are three times as long as its motion.",
    )
    rows = [
        [
            dataset,
            str(score.whole),
            str(score.found),
            str(score.false),
            f"{score.rms_px:.2f}",
        ]
        for dataset, score in scores.items()
    ]
    return Section(
        title="Dots on the gel",
        html=paragraph(
            "Dots are found on the blank frame without knowing their size or spacing, and followed "
            "through presses. The slopes under them are filled in from around them."
        )
        + table_html(
            "Blank frames of real marker gels, with dots counted by eye in enlarged frames. Dots "
            "cut by the frame's edge need not be found and do not count as false.",
            ["gel", "counted", "found", "false", "RMS distance to hand-marked places [px]"],
            rows,
        )
        + gallery_html([picture, clip])
        + paragraph("To compare the ways of filling in one table:")
        + code("wedge bench"),
    )


def contact_section(
    overlaps: Mapping[str, Sequence[Overlap]],
    curves: Sequence[ForceCurve],
    left_out: Sequence[str],
) -> Section:
    """How masks fit labelled discs, and how contact follows force.

    Args:
        overlaps: by dataset, of presses that the estimator has not seen.
        curves: of clips with the measured force; none where they are absent.
        left_out: sentences on what is not shown of contact and dots, and what to do.
    """
    rows = [
        [
            dataset,
            str(len(found)),
            f"{mean_iou(found):.3f}",
            f"{min(item.iou for item in found):.3f}",
            f"{sum(item.radius_ratio for item in found) / len(found):.2f}",
        ]
        for dataset, found in overlaps.items()
    ]
    html = paragraph(
        "A network tells gel that is touched from gel that only follows. In addition, a contact "
        "ends at the last contour of pressure along which the skin is, on average, about as steep "
        "as along the steepest one."
    ) + table_html(
        "Contact masks against the labelled discs of held-out ball presses.",
        ["dataset", "presses", "mean IoU", "least IoU", "radius, found / labelled"],
        rows,
    )
    if curves:
        words = "; ".join(
            f"{curve.name.removeprefix('wedge-mit-')} {curve.rank_correlation[0]:.2f} and "
            f"{curve.rank_correlation[1]:.2f}"
            for curve in curves
        )
        html += figure_html(
            Picture(
                content=plot_bytes(force_figure(curves)),
                alt=f"Disturbed area and deepest point against the measured force of {len(curves)} "
                "clips",
                caption="Clips of an MIT Wedge that grips objects; lines join the frames in time. "
                "Depths come from the twin's calibration and show only a trend. Rank correlation"
                f" of force with area and with depth: {words}.",
                wide=True,
            )
        )
    return Section(title="Where it touches", html=html + bullets(left_out) * bool(left_out))
