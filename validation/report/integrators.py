# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The integrators, as a section of the page."""

from collections.abc import Mapping, Sequence

import numpy as np

from recon.arrays import DepthMap
from recon.integration.poisson import Boundary
from sensor.toml import Pair
from validation.figures.integrators import cap_error_figure, convergence_figure
from validation.figures.png import plot_bytes
from validation.report.page import Picture, Section, code, figure_html, paragraph

BORDERS: Mapping[Boundary, str] = {
    "dirichlet": "zero border (Dirichlet)",
    "neumann": "free border (Neumann)",
}


def integrator_section(
    depth_mm: DepthMap,
    found_mm: Mapping[Boundary, DepthMap],
    mm_per_px: Pair,
    samples: Sequence[int],
    errors: Mapping[Boundary, Sequence[float]],
) -> Section:
    """How exact depth from exact gradients is.

    Args:
        depth_mm: of ball caps.
        found_mm: by boundary, integrated from the caps' gradients at pixel centres.
        mm_per_px: of both.
        samples: per side, of a smooth surface.
        errors: by boundary, its largest error at those samples, of its height.
    """
    rows, columns = depth_mm.shape
    rmse = {
        name: 100 * float(np.sqrt(np.mean((found - depth_mm) ** 2)) / depth_mm.max())
        for name, found in found_mm.items()
    }
    words = " and ".join(f"{value:.2f} % ({BORDERS[name]})" for name, value in rmse.items())
    orders = {
        name: float(-np.polyfit(np.log(samples), np.log(values), 1)[0])
        for name, values in errors.items()
    }
    order_words = " and ".join(f"{value:.2f}" for value in orders.values())
    caps = Picture(
        content=plot_bytes(
            cap_error_figure(
                depth_mm, {BORDERS[name]: found for name, found in found_mm.items()}, mm_per_px
            )
        ),
        alt=f"Three ball caps and the two integrators' errors, which lie on the caps' rims; "
        f"RMSE {words} of the height",
        caption=f"Three ball caps at {columns} × {rows} pixels, gradients exact at pixel centres. "
        f"RMSE {words} of the height; the error lies on the rims, where the slope jumps.",
        wide=True,
    )
    convergence = Picture(
        content=plot_bytes(
            convergence_figure(samples, {BORDERS[name]: values for name, values in errors.items()})
        ),
        alt=f"Log-log plot of the error against samples per side; slopes {order_words}",
        caption=f"Largest error on a smooth bump of height 1. Fitted order of convergence: "
        f"{order_words}.",
    )
    return Section(
        title="Integrators",
        html=paragraph(
            "Gradients become depth by solving a Poisson equation whose border is either zero or "
            "free. Both solvers are exact for their stencil; the remaining error is due to "
            "sampling."
        )
        + figure_html(caps)
        + f'<div class="gallery">{figure_html(convergence)}</div>\n'
        + paragraph("All figures of the integrators, with their limits:")
        + code("wedge bench"),
    )
