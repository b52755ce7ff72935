# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Tracking, as a section of the page."""

from collections.abc import Sequence

import numpy as np

from validation.figures.overlay import clip_bytes
from validation.figures.png import plot_bytes
from validation.figures.tracking import anchor_on, overlay, pose_figure, roll_figure, shaded
from validation.report.page import Picture, Section, code, gallery_html, paragraph, table_html
from validation.tracking import Roll, StepErrors

HEADINGS = ("object, tracker", "angle [°]", "shift [µm]", "time [ms]", "squared error")
CLIP_STEP = 3
"""Every such frame of a roll is in its clip."""


def tracking_section(measured: Sequence[StepErrors], rolled: Roll) -> Section:
    """How exact poses are, on touches whose pose is known.

    Args:
        measured: by object and tracker, of as many steps each.
        rolled: what was followed beyond single steps.
    """
    return Section(
        title="Pose tracking",
        html=paragraph(
            "An object given by a formula is pressed, turned by 2.5° about a random axis, shifted"
            " by 0.2 mm and pressed again. Both touches have slope noise of 0.05 on each of 320 ×"
            " 240 pixels of 0.063 mm, and their depth is integrated from these slopes. Each tracker"
            " starts from no motion."
        )
        + table_html(
            "Median errors of one step. The last column is the mean squared error in units of the "
            "reported covariance: 6 if a tracker knows its own error.",
            HEADINGS,
            map(_cells, measured),
        )
        + gallery_html(_pictures(rolled))
        + paragraph(
            f"n = {measured[0].steps} steps for each object. joint fits slopes and depth together, "
            "gicp aligns point clouds with small_gicp."
        )
        + paragraph("To track an object with your own sensor:")
        + code("wedge track units/wedge-001 press.mp4 --background first --out tracked"),
    )


def _cells(item: StepErrors) -> list[str]:
    return [
        f"{item.thing}, {item.tracker}",
        f"{item.angle_deg:.3f}",
        f"{1e3 * item.shift_mm:.1f}",
        f"{item.milliseconds:.1f}",
        f"{item.squares:.0f}",
    ]


def _pictures(rolled: Roll) -> list[Picture]:
    """The roll's errors, the roll itself, and what the first tracker says of it."""
    ends = ", ".join(f"{name} {off[-1]:.2f}°" for name, off in rolled.error_deg.items())
    errors = roll_figure(rolled.true_deg, rolled.error_deg, "a textured bead rolls once round")
    times_s = [angle / rolled.true_deg[-1] for angle in rolled.true_deg]
    return [
        Picture(
            content=plot_bytes(errors),
            alt=f"Error against the angle rolled; at the end {ends}",
            caption="A bead of 5 mm radius with a texture of 0.02 mm rolls in steps of 2.5° at "
            f"160 × 120 pixels. After 360°, where the first keyframe appears again: {ends}.",
        ),
        Picture(
            content=_clip(rolled),
            alt="The bead's slopes as light, its contact outlined, its axes turning once round",
            caption="The same roll, every third step: contact, the object's axes, and what the "
            "tracker reports.",
        ),
        Picture(
            content=plot_bytes(pose_figure(times_s, rolled.found, "one turn per second")),
            alt="Rotation vector and shift over one turn, in bands of two standard deviations",
            caption="What joint reports: rotation and shift with two standard deviations; "
            "hatched where it warns.",
            wide=True,
        ),
    ]


def _clip(rolled: Roll) -> bytes:
    anchor = anchor_on(rolled.touches[0], np.eye(4))
    steps = list(zip(rolled.touches, rolled.found, strict=True))[::CLIP_STEP]
    return clip_bytes(
        [
            overlay(shaded(touch.gradient), touch.contact, touch.mm_per_px, found, anchor)
            for touch, found in steps
        ]
    )
