# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Mean colour change against the direction that the skin faces: where each light sits."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes
from matplotlib.ticker import MaxNLocator

from validation.figures.style import CHANNELS, HALF_IN, INK, SOFT, styled
from validation.lighting import GRAY_LEVELS

HEIGHT_IN = 3.9
PLACE = (0.09, 0.1, 3.1 / HALF_IN, 3.1 / HEIGHT_IN)
SECTORS = 36
SLOPES = (0.3, 1.0)
"""Only pixels of such slopes count: flatter ones have no clear direction, steeper ones shadows."""
AZIMUTHS = ("+x", "45°", "+y", "135°", "180°", "−135°", "−90°", "−45°")


@styled
def lobe_figure(
    color: Float[np.ndarray, "n 3"],
    gradient: Float[np.ndarray, "n 2"],
    lights_deg: Mapping[str, float] | None = None,
) -> Figure:
    """Difference colour by azimuth on the contact, seen from its centre; x right, y down.

    The bulge faces the light where depth falls toward it, so a lobe points at its light.

    Args:
        color: difference to the background of contact pixels, full scale.
        gradient: their true gradient, some of it of ``SLOPES``.
        lights_deg: where the dataset says that the lights sit; drawn as spokes, and a colour
            without a light is not drawn. All are where it does not say.
    """
    figure = Figure(figsize=(HALF_IN, HEIGHT_IN), facecolor="white")
    axes = figure.add_axes(PLACE, projection="polar")
    assert isinstance(axes, PolarAxes)
    centers_deg, means = sector_means(color, gradient)
    closed = np.radians(np.append(centers_deg, centers_deg[:1]))
    levels = GRAY_LEVELS * means
    lit = [channel for channel in CHANNELS if not lights_deg or channel in lights_deg]
    for channel in lit:
        index, shade = "RGB".index(channel), CHANNELS[channel]
        values = np.append(levels[:, index], levels[:1, index])
        axes.plot(closed, values, color=shade, ls=("-", (0, (5, 1.5)), (0, (2, 1)))[index])
    highest, lowest = float(np.nanmax(levels)), float(np.nanmin(levels))
    span = max(highest - lowest, 1e-6)
    floor, top = lowest - 0.25 * span, highest + 0.12 * span
    axes.set_rlim(floor, top)
    axes.plot(np.linspace(0, 2 * np.pi, 181), np.zeros(181), color=INK, lw=0.9)
    for channel in lit:
        shade = CHANNELS[channel]
        mean_deg = lobe_azimuth_deg(centers_deg, means[:, "RGB".index(channel)])
        label = f"{channel}: {mean_deg:+.0f}°".replace("-", "−")
        axes.plot(np.radians(mean_deg), top, "o", color=shade, clip_on=False, ms=6, label=label)
        if lights_deg:
            spoke = np.radians(lights_deg[channel])
            axes.plot([spoke, spoke], [floor, top], color=shade, lw=0.9, ls=":")
    axes.set_theta_direction(-1)
    axes.set_thetagrids(range(0, 360, 45), AZIMUTHS)
    axes.tick_params(axis="x", pad=2)
    axes.spines["polar"].set_color(SOFT)
    axes.set_rlabel_position(22.5)
    axes.tick_params(axis="y", labelsize=7)
    axes.yaxis.set_major_locator(MaxNLocator(4))
    figure.legend(loc="upper right", title="direction of the lobe", title_fontsize=8)
    return figure


def sector_means(
    color: Float[np.ndarray, "n 3"], gradient: Float[np.ndarray, "n 2"]
) -> tuple[Float[np.ndarray, " s"], Float[np.ndarray, "s 3"]]:
    """Centres of the sectors in degrees and the mean colour in each; empty ones are left out."""
    slope = np.hypot(gradient[:, 0], gradient[:, 1])
    chosen = (slope >= SLOPES[0]) & (slope <= SLOPES[1])
    azimuth_deg = np.degrees(np.arctan2(-gradient[chosen, 1], -gradient[chosen, 0])) % 360
    sector = (azimuth_deg / (360 / SECTORS)).astype(int) % SECTORS
    filled = np.unique(sector)
    means = [color[chosen][sector == index].mean(0) for index in filled]
    centers_deg = (filled + 0.5) * 360 / SECTORS
    return centers_deg, np.array(means, dtype=float).reshape(len(filled), 3)


def lobe_azimuth_deg(
    centers_deg: Float[np.ndarray, " s"], values: Float[np.ndarray, " s"]
) -> float:
    """Azimuth of the first harmonic, -180 to 180."""
    around = np.exp(1j * np.radians(centers_deg))
    return float(np.degrees(np.angle(np.sum((values - values.mean()) * around))))
