# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What was measured on ball presses, as sections of the page."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sensor.dataset import Dataset
from validation.error_table import ErrorTable, Row
from validation.examples import Example, HeldOut
from validation.figures.ball_press import press_figure, strip_figure
from validation.figures.depth_scatter import peak_figure, rmse_figure
from validation.figures.gradients import gradient_figure
from validation.figures.light_lobes import SLOPES, lobe_figure, sector_means
from validation.figures.png import frames_bytes, plot_bytes
from validation.intervals import counted, enough, remark
from validation.metrics import PIXEL_SETS, PixelSet
from validation.report.error_tables import (
    error_pictures,
    error_tables,
    interval_text,
    number_cell,
)
from validation.report.page import (
    Picture,
    Section,
    Tile,
    code,
    figure_html,
    gallery_html,
    paragraph,
    table_html,
    tiles_html,
)
from validation.table_text import split_words


@dataclass(frozen=True, kw_only=True)
class DatasetResults:
    """Everything that was measured on one dataset."""

    dataset: Dataset
    about: str
    """The sensor and the gel, in a few words."""
    table: ErrorTable
    held_out: HeldOut
    command: str
    """Which makes the table again."""

    @property
    def estimator(self) -> str:
        """The one in the headline: the first of the table."""
        return self.table.rows[0].estimator

    def row(self, pixels: PixelSet) -> Row:
        """All lights, the headline's estimator."""
        return max(
            (r for r in self.table.rows if (r.estimator, r.pixels) == (self.estimator, pixels)),
            key=lambda row: len(row.configuration),
        )

    def rmse_quartiles_mm(self) -> tuple[float, float, float]:
        """Of the depth RMSE over presses: lower, median, upper."""
        errors = [error.rmse_mm for error in self.table.depth[self.estimator]]
        low, median, high = np.percentile(errors, (25, 50, 75))
        return float(low), float(median), float(high)

    def peaks_mm(self) -> tuple[float, float]:
        """Mean depth at the contacts' centres: reconstructed and true."""
        errors = self.table.depth[self.estimator]
        return (
            float(np.mean([error.peak_mm for error in errors])),
            float(np.mean([error.peak_truth_mm for error in errors])),
        )


def headline_section(results: Sequence[DatasetResults]) -> Section:
    """The first dataset's numbers in large type, a press of every dataset, and all in a table."""
    first = results[0]
    contact = first.row("contact")
    low_mm, median_mm, high_mm = first.rmse_quartiles_mm()
    presses = f"{counted(first.table.test)} of {first.table.dataset}, each judged once"
    tiles = [
        Tile(
            label=f"{name} error in the contact",
            value=f"{contact.errors.values[key]:.2f}°",
            note=f"95 % interval {interval}; {presses}"
            if (interval := interval_text(contact, key))
            else presses,
        )
        for key, name in (("theta_x_deg", "θx"), ("theta_y_deg", "θy"))
    ]
    found, true = first.peaks_mm()
    tiles.append(
        Tile(
            label="Depth RMSE in the contact",
            value=f"{median_mm:.3f} mm",
            note=f"median press; half lie within {low_mm:.3f} and {high_mm:.3f} mm"
            if enough(first.table.test)
            else counted(first.table.test),
        )
    )
    tiles.append(
        Tile(
            label="Depth at the centre",
            value=f"{found:.2f} mm",
            note=f"reconstructed, of {true:.2f} mm true"
            + "; means over the presses" * (first.table.test > 1),
        )
    )
    return Section(
        title="In short",
        html=tiles_html(tiles)
        + paragraph(
            f"Estimator {first.estimator}, all lights. An angle error means little without the "
            f"slopes that it was measured on: here the mean |G| of the contact pixels is "
            f"{contact.errors.mean_abs_gradient:.2f} ({contact.errors.n_pixels:,} pixels)."
        )
        + "".join(map(_strip, results))
        + table_html(summary_caption(results), *summary_cells(results)),
    )


def dataset_section(results: DatasetResults) -> Section:
    """One dataset: error tables, figures, a bad press."""
    card, table = results.dataset.card, results.table
    split = split_words(table.train, table.test, table.folds)
    about = (
        f"{results.about[:1].upper()}{results.about[1:]}: {len(results.dataset.labels)} presses of "
        f"{'a ball' if len(table.ball_radii_mm) == 1 else 'balls'} of {table.balls} radius, "
        f"{card.mm_per_px[0]:g} × {card.mm_per_px[1]:g} mm per pixel. Source: {card.source}. "
        f"Licence: {card.licence}. {split[:1].upper()}{split[1:]}; seed {table.seed}."
    )
    return Section(
        title=card.name,
        html=paragraph(about)
        + "".join(error_tables(table))
        + gallery_html(_figures(results))
        + "".join(_press_picture(example, results) for example in results.held_out.examples)
        + paragraph("To get this table again:")
        + code(results.command),
    )


def signed(value_mm: float) -> str:
    """With its sign, a true minus."""
    return f"{value_mm:+.3f}".replace("-", "−")


def known_depth_section(
    dataset: Dataset, examples: Sequence[Example], estimator: str, learnt_from: str
) -> Section:
    """Presses whose depth was commanded, by a unit that has seen none of them."""
    rows = [
        [
            item.depth.file,
            f"{item.depth.peak_truth_mm:.3f}",
            f"{item.depth.peak_mm:.3f}",
            signed(item.depth.peak_mm - item.depth.peak_truth_mm),
            f"{item.depth.rmse_mm:.3f}",
            signed(item.depth.bias_mm),
        ]
        for item in examples
    ]
    mean_mm = float(np.mean([i.depth.peak_mm - i.depth.peak_truth_mm for i in examples]))
    headings = ["press", "true at the centre", "reconstructed", "error", "RMSE", "bias"]
    results = "".join(
        figure_html(
            Picture(
                content=frames_bytes(press_figure(item.picture)),
                alt=_alt(item),
                caption=f"{item.picture.title}, reconstructed by a unit that was calibrated on "
                f"{learnt_from} only. The truth is the ball at its commanded depth.",
                wide=True,
            )
        )
        for item in examples[-1:]
    )
    return Section(
        title=dataset.card.name,
        html=paragraph(
            f"Here the depth itself is known: {len(examples)} presses to a commanded depth, "
            f"reconstructed by the {estimator} of a unit calibrated on {learnt_from}. The command "
            "places the ball, not the gel, which sinks in around it. So the truth holds at the "
            "centre, but only roughly at the rim. The error at the centre is "
            f"{signed(mean_mm)} mm on average. Source: {dataset.card.source}. Licence: "
            f"{dataset.card.licence}."
        )
        + table_html(
            f"Depth against the commanded depth, in mm; {len(examples)} presses, nothing fitted "
            "to them. RMSE and bias are taken over the contact.",
            headings,
            rows,
        )
        + results,
    )


def summary_cells(results: Sequence[DatasetResults]) -> tuple[list[str], list[list[str]]]:
    """Headings and rows of a table with all datasets: the headline's estimator, all lights."""
    headings = ["data", "presses"]
    for pixels in reversed(PIXEL_SETS):
        headings += [f"θx {pixels}", f"θy {pixels}", "mean |G|"]
    rows = []
    for item in results:
        cells = [item.dataset.card.name, str(item.table.test)]
        for pixels in reversed(PIXEL_SETS):
            row = item.row(pixels)
            cells += [number_cell(row, "theta_x_deg"), number_cell(row, "theta_y_deg")]
            cells.append(f"{row.errors.mean_abs_gradient:.2f}")
        rows.append([*cells, f"{item.rmse_quartiles_mm()[1]:.3f}"])
    return [*headings, "depth RMSE"], rows


def summary_caption(results: Sequence[DatasetResults]) -> str:
    """What the numbers of that table are."""
    intervals = remark(
        "the press-level bootstrap 95 % interval below them", *(item.table.test for item in results)
    )
    return (
        f"Mean absolute angle errors in degrees, all lights, {results[0].estimator}; {intervals}. "
        "Depth RMSE is that of the median press, in mm."
    )


def truth_of_peaks(truths: set[str]) -> str:
    """What depths at the centre are judged against, in words.

    Args:
        truths: of ``DepthErrors.truth``.
    """
    cap = "the ball's cap above the rim of the labelled circle"
    file = "the set's own, below the gel at rest"
    if truths == {"truth file"}:
        return file
    return cap if truths == {"ball cap"} else f"{file}, or where it has none, {cap}"


def _figures(results: DatasetResults) -> list[Picture]:
    table, held, card = results.table, results.held_out, results.dataset.card
    judged = f"{card.name}, {counted(table.test)}"
    intervals = remark("bars are 95 % intervals over presses", table.test)
    contact = held.pixels.contact
    found_mm, true_mm = results.peaks_mm()
    low_mm, median_mm, high_mm = results.rmse_quartiles_mm()
    truths = {error.truth for errors in table.depth.values() for error in errors}
    radii_px = [label.contact_radius_px for label in results.dataset.labels]
    columns = truths == {"ball cap"} and all(radius.is_integer() for radius in radii_px)
    pictures = [
        *error_pictures(table, f"{intervals} ({judged})"),
        Picture(
            content=plot_bytes(peak_figure(table.depth)),
            alt=f"Scatter of reconstructed against true depth, one point per press; means "
            f"{found_mm:.2f} and {true_mm:.2f} mm for {results.estimator}",
            caption=f"Depth at the contact's centre, all lights ({judged}). The truth is "
            + truth_of_peaks(truths)
            + (
                "; the points form columns because radii were labelled in whole pixels."
                if columns
                else "."
            ),
        ),
        Picture(
            content=plot_bytes(rmse_figure(table.depth)),
            alt=f"Cumulative share of presses by depth RMSE; quartiles {low_mm:.3f}, "
            f"{median_mm:.3f} and {high_mm:.3f} mm for {results.estimator}",
            caption=f"Depth RMSE in the contact, all lights: share of presses below each value "
            f"({judged}).",
        ),
        Picture(
            content=plot_bytes(
                gradient_figure(held.estimated[contact], held.pixels.gradient[contact])
            ),
            alt="Signed error of Gx and Gy against the true value: its median, and the bands that "
            "contain half and nine tenths of the pixels",
            caption=f"Gradient error against the true slope, {results.estimator}, all lights "
            f"({card.name}, {counted(held.n_presses)} held out in the first fold, "
            f"{contact.sum():,} contact pixels).",
        ),
    ]
    return [*pictures, *_lobes(results)]


def _lobes(results: DatasetResults) -> list[Picture]:
    """Where each colour grows; none of contacts too flat or too steep to tell."""
    held, card = results.held_out, results.dataset.card
    pixels = held.pixels[held.pixels.contact]
    if not len(sector_means(pixels.color, pixels.gradient)[0]):
        return []
    flattest, steepest = SLOPES
    picture = Picture(
        content=plot_bytes(lobe_figure(pixels.color, pixels.gradient, card.lights_deg)),
        alt="Polar curves of the mean colour change per channel, and the direction of each",
        caption="Mean colour change in grey levels against the direction that the skin faces "
        f"(slopes {flattest:g} to {steepest:g}; {card.name}, {counted(held.n_presses)}). Black "
        "circle: no change. Dots: the direction of each lobe"
        + ("; dotted spokes: the set's lights_deg." if card.lights_deg else "."),
    )
    return [picture]


def _strip(results: DatasetResults) -> str:
    example = results.held_out.examples[0]
    return figure_html(
        Picture(
            content=frames_bytes(strip_figure(example.picture)),
            alt=f"{example.picture.title}: frame, difference image and depth map",
            caption=f"{example.picture.title}, {results.about}; {example.rank} of the "
            f"{counted(results.held_out.n_presses)} held out in the first fold "
            f"(depth RMSE {example.depth.rmse_mm:.3f} mm).",
            wide=True,
        )
    )


def _press_picture(example: Example, results: DatasetResults) -> str:
    title = example.picture.title
    picture = replace(example.picture, title=f"{title}, held out")
    return figure_html(
        Picture(
            content=frames_bytes(press_figure(picture)),
            alt=_alt(example),
            caption=f"{title}: {example.rank} of the {counted(results.held_out.n_presses)} held "
            f"out in the first fold ({results.estimator}, all lights; depth RMSE "
            f"{example.depth.rmse_mm:.3f} mm). Dotted lines: the labelled circle; the ideal ball "
            "ends at its rim.",
            wide=True,
        )
    )


def _alt(example: Example) -> str:
    depth = example.depth
    return (
        f"Press {depth.file}: frame, difference image, depth map, gradients next to their truth, "
        f"depth error and cross-sections; depth RMSE {depth.rmse_mm:.3f} mm, centre "
        f"{depth.peak_mm:.2f} of {depth.peak_truth_mm:.2f} mm"
    )
