# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Draw the README's picture: one real press that the calibration has not seen, from frame to depth.

The frames come from the ``taxim`` wheel (Carnegie Mellon University, MIT). Takes about 30 s.
"""

import dataclasses
import io
import tempfile
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image
from style import INK, ORANGE, SOFT

from recon.calibration import calibrate
from recon.images import read_frame
from recon.pipeline import Reconstruction, Reconstructor
from recon.presses import read_presses
from sensor.dataset import read_dataset
from sensor.toml import Pair
from validation.depth import cap_of
from validation.importers.taxim import find_taxim, import_taxim

SHOWN = 20
"""The press that is drawn; the estimator learns from all others."""
PICTURE = Path(__file__).with_suffix(".jpg")


def reconstruct() -> tuple[np.ndarray, Reconstruction, np.ndarray, Pair]:
    """The frame, what it says, the ideal ball's depth, and the contact's centre in pixels."""
    source = find_taxim()
    if source is None:
        raise SystemExit("the taxim wheel is not installed")
    with tempfile.TemporaryDirectory() as folder:
        import_taxim(source, Path(folder))
        dataset = read_dataset(Path(folder))
        presses = read_presses(dataset)
        shown = presses.presses[SHOWN]
        others = tuple(press for press in presses.presses if press is not shown)
        unit = calibrate(
            dataset,
            dataclasses.replace(presses, presses=others),
            estimator="default",
            serial="readme",
            created="2026-01-01",
            metrics={},
            seed=0,
        )
        frame = read_frame(dataset.folder, shown.file)
    return frame, Reconstructor(unit)(frame), cap_of(shown).depth_mm, shown.center_px


def draw_image(axes: Axes, title: str, image: np.ndarray, mm_per_px: float, color: str) -> None:
    """One picture of the pad with a scale bar of 2 mm."""
    height, width = image.shape[:2]
    axes.imshow(image, cmap="viridis")
    axes.set_title(title)
    axes.set_axis_off()
    end = width - 24
    axes.plot([end - 2 / mm_per_px, end], [height - 26] * 2, color=color, lw=2.5)
    axes.text(
        end - 1 / mm_per_px, height - 40, "2 mm", color=color, ha="center", va="bottom", fontsize=8
    )


def draw_cut(
    axes: Axes, depth: np.ndarray, ideal: np.ndarray, center_px: Pair, mm_per_px: float
) -> None:
    """The row through the contact's centre against the ball, in true proportions."""
    row = round(center_px[1])
    x_mm = (np.arange(depth.shape[1]) - center_px[0]) * mm_per_px
    inside = ideal[row] > 0
    first, last = np.flatnonzero(inside)[[0, -1]]
    rim_mm = float(depth[row, [first, last]].mean())  # the ideal cap starts at its rim
    axes.plot(
        x_mm[inside],
        ideal[row][inside] + rim_mm,
        color=ORANGE,
        lw=5,
        label="the ball, set on the measured rim",
    )
    axes.plot(x_mm, depth[row], color=INK, lw=1.5, label="measured")
    axes.axhline(0, color=SOFT, lw=0.5)
    axes.set_aspect("equal")
    axes.set_xlim(-5.4, 5.4)
    axes.set_ylim(2.15, -0.25)
    axes.set_xlabel("distance from the contact's centre [mm]")
    axes.set_ylabel("depth [mm]")
    axes.set_title("A cut through its centre, in true proportions")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, loc="lower right")


def draw(frame: np.ndarray, result: Reconstruction, ideal: np.ndarray, center_px: Pair) -> Figure:
    """The whole picture."""
    pitch_mm = result.mm_per_px[0]
    matplotlib.rcParams["font.size"] = 9
    drawing = Figure(figsize=(9.0, 4.5), facecolor="white", layout="constrained")
    grid = drawing.add_gridspec(2, 3, height_ratios=[1.15, 1])
    pictures = {
        "1  a ball is pressed on the gel": frame,
        "2  minus the blank gel (doubled)": np.clip(0.5 + 2 * result.difference, 0, 1),
        "3  depth": result.depth_mm,
    }
    for column, (title, image) in enumerate(pictures.items()):
        axes = drawing.add_subplot(grid[0, column])
        draw_image(axes, title, image, pitch_mm, "white")
    bar = drawing.colorbar(axes.images[0], ax=axes, shrink=0.8, pad=0.02)
    bar.ax.set_title("mm", fontsize=8, loc="left")
    bar.outline.set_visible(False)
    draw_cut(drawing.add_subplot(grid[1, :]), result.depth_mm, ideal, center_px, pitch_mm)
    return drawing


if __name__ == "__main__":
    stream = io.BytesIO()
    draw(*reconstruct()).savefig(stream, format="png", dpi=140)
    Image.open(stream).convert("RGB").save(PICTURE, quality=90, subsampling=0, optimize=True)
