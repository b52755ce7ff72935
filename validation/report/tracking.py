# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Tracking, as a section of the page."""

from collections.abc import Sequence

from validation.report.page import Picture, Section, code, gallery_html, paragraph, table_html


def tracking_section(
    headings: Sequence[str],
    rows: Sequence[Sequence[str]],
    pictures: Sequence[Picture],
    remark: str,
) -> Section:
    """How exact poses are, on touches whose pose is known.

    Args:
        headings: of the table of steps.
        rows: one for each object and tracker.
        pictures: of a roll, and of real clips where there are any.
        remark: what the clips say, or why there are none.
    """
    return Section(
        title="Pose tracking",
        html=paragraph(
            "An object in closed form is pressed, moved by 2.5° about a random axis and by 0.2 mm, "
            "and pressed again; both touches have slope noise 0.05 on each of 320 × 240 pixels of "
            "0.063 mm, and their depth is integrated from it. Each tracker starts from no motion."
        )
        + table_html(
            "Median errors of one step. The last column is the mean squared error in units of the "
            "reported covariance: 6 where a tracker knows how wrong it is.",
            headings,
            rows,
        )
        + gallery_html(pictures)
        + paragraph(remark)
        + paragraph("To follow an object with a sensor of your own:")
        + code("wedge track units/wedge-001 press.mp4 --background first --out tracked"),
    )
