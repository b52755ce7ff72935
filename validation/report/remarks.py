# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What is weak, and how to get the page again."""

import html
from collections.abc import Mapping, Sequence

import numpy as np

from validation.intervals import counted
from validation.label_noise import label_shift_deg
from validation.report.page import Section, bullets, code, paragraph, table_html
from validation.report.results import DatasetResults

LEAST_LOSS_PERCENT = 2
"""Of steep slopes, to be called a weakness."""


def weakness_section(results: Sequence[DatasetResults]) -> Section:
    """What the numbers do not show well, with numbers."""
    parts = []
    for item in results:
        heading = f"<h3>{html.escape(item.dataset.card.name)}</h3>\n"
        parts.append(heading + bullets(_weaknesses(item)))
    return Section(
        title="What is weak",
        html=paragraph(
            "Every labelled press is a ball. A low error on balls can hide a worse depth on edges, "
            "corners and textures. The true depth of these is known for rendered sets only; no "
            "real one has been measured here. The paper's values come from another sensor, other "
            "presses and slopes that it does not state: they are given for orientation and are "
            "not a comparison."
        )
        + "".join(parts),
    )


def _weaknesses(results: DatasetResults) -> list[str]:
    card, held = results.dataset.card, results.held_out
    contact = held.pixels.contact
    truth, found = held.pixels.gradient[contact], held.estimated[contact]
    slope = np.hypot(truth[:, 0], truth[:, 1])
    steep = slope > np.percentile(slope, 90)
    returned = 100 * np.median((found * truth).sum(1)[steep] / slope[steep] ** 2)
    pitch_mm = card.mm_per_px[0]
    moved = label_shift_deg(truth, held.ball_radius_mm[contact], pitch_mm)
    found_mm, true_mm = results.peaks_mm()
    worst = max(results.table.depth[results.estimator], key=lambda error: error.rmse_mm)
    items = []
    if round(abs(returned - 100)) >= LEAST_LOSS_PERCENT:
        items.append(
            f"Steep slopes: in the steepest tenth of the contact pixels (slope above "
            f"{slope[steep].min():.2f}), {results.estimator} finds {returned:.0f} % of the "
            f"true slope (median; {counted(held.n_presses)} held out)."
        )
    items += [
        f"Depth: contacts are reconstructed as {found_mm:.2f} mm deep; the ball's cap is"
        f" {true_mm:.2f} mm deep (means of {counted(results.table.test)}). The worst press is"
        f" {worst.file}: RMSE {worst.rmse_mm:.3f} mm.",
        f"Labels: a centre that is one pixel off ({pitch_mm:g} mm) moves the true θx by "
        f"{moved:.1f}° on average, so errors near that size say as much about the labels as about "
        "the estimator.",
    ]
    if not contact.all():
        idle = np.abs(held.estimated[~contact]).mean()
        items.append(f"Untouched gel: the mean |G| estimated there is {idle:.3f}; it should be 0.")
    items += _useless_networks(results)
    left_out = results.table.left_out
    if left_out:
        named = "; ".join(f"{press.file}: {press.reason}" for press in left_out)
        items.append(f"Left out {len(left_out)} of {len(results.dataset.labels)} presses: {named}.")
    else:
        items.append(f"No press was left out; {len(results.dataset.labels)} were labelled.")
    if card.licence.startswith("none"):
        items.append(f"Licence: {card.licence}. This applies to its pictures on this page too.")
    return items


def _useless_networks(results: DatasetResults) -> list[str]:
    """Light configurations whose unseen axis is inferred no better than by calling it zero."""
    rows = [row for row in results.table.rows if row.estimator == results.estimator]
    zeros = {(r.configuration, r.pixels): r for r in rows if r.missing_axis == "zero"}
    items = []
    for row in rows:
        zero = zeros.get((row.configuration, row.pixels))
        if row.missing_axis != "network" or zero is None:
            continue
        for metric, name in (("theta_x_deg", "θx"), ("theta_y_deg", "θy")):
            inferred, nothing = row.errors.values[metric], zero.errors.values[metric]
            if inferred > 1.005 * nothing:  # the seen axis is the same but for rounding
                items.append(
                    f"Lights {row.configuration}, pixels {row.pixels}: the network that infers the "
                    f"unseen axis gives {name} an error of {inferred:.2f}°, more than calling it "
                    f"zero ({nothing:.2f}°)."
                )
    return items


def reproduction_section(
    command: str,
    results: Sequence[DatasetResults],
    absent: Mapping[str, str],
    about: Mapping[str, str],
) -> Section:
    """How to get this page again, and from what.

    Args:
        command: the command that made the page.
        results: what was measured.
        absent: known datasets that this machine lacks, and where they are looked for.
        about: versions and other facts of the run.
    """
    rows = [
        [item.dataset.card.name, item.dataset.card.licence, item.dataset.sha256] for item in results
    ]
    missing = [f"{name} was not on this machine: {sought}." for name, sought in absent.items()]
    return Section(
        title="How to reproduce",
        html=paragraph("The same seed on the same machine gives the same tables to the last digit.")
        + code(command)
        + table_html(
            "Data, with the hash of labels and frames.",
            ["data", "licence", "SHA-256"],
            rows,
            of_words=True,
        )
        + bullets(missing) * bool(missing)
        + table_html(
            "Versions used.",
            ["what", "version"],
            [list(item) for item in about.items()],
            of_words=True,
        ),
    )
