# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Draws held.png: contact masks of the standard's fine shapes, by slopes and by a known light.

Prints what the masks by slopes miss and add of every shape, and what one row of pixels costs it.
"""

from pathlib import Path

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch
from scipy.ndimage import binary_dilation, binary_erosion
from style import BLUE, ORANGE, SOFT, bare, figure

from recon.presses import read_presses
from sensor.dataset import read_dataset
from sensor.design import STANDARD
from validation.contact import iou
from validation.contact_shapes import shape_contacts
from validation.datasets import dataset_folder
from validation.folds import fit_presses
from validation.shapes import name_in_words

SHAPES = ("screw_cap", "m2_screw", "cube_corner", "prism")
MARGIN_PX = 8
SCALE_MM = 2.0
KINDS = {"held, found": SOFT, "held, missed": BLUE, "found, not held": ORANGE}


dataset = read_dataset(dataset_folder("twin-standard"))
presses = read_presses(dataset).presses
fitted = fit_presses(presses, range(len(presses)), "default", "RGB", seed=0)
shapes = {shape.name: shape for shape in shape_contacts(dataset, STANDARD, fitted)}
for shape in shapes.values():
    truth, by_slopes = shape.truth, shape.by_slopes
    held_px = truth.sum()
    fewer, more = (iou(edged(truth), truth) for edged in (binary_erosion, binary_dilation))
    print(
        f"{shape.name:12s} by slopes: {(truth & ~by_slopes).sum() / held_px:.0%} missed, "
        f"{(by_slopes & ~truth).sum() / held_px:.0%} added; "
        f"one row too few all around {fewer:.2f}, too many {more:.2f}"
    )
drawing = figure(8.4, 4.6)
rows = drawing.subplots(2, len(SHAPES))
for column, name in zip(rows.T, SHAPES, strict=True):
    shape = shapes[name]
    touch, truth = shape.touch, shape.truth
    by_slopes = shape.by_slopes
    places = np.argwhere(truth)
    side = int((places.max(0) - places.min(0)).max()) // 2 + MARGIN_PX
    middle = (places.max(0) + places.min(0)) // 2
    window = tuple(slice(max(0, at - side), at + side) for at in middle)
    for axes, (how, mask) in zip(
        column, (("by slopes", by_slopes), ("light known", touch.contact)), strict=True
    ):
        kind = np.select([truth & mask, truth, mask], [1, 2, 3], 0)[window]
        colors = ListedColormap(["white", *KINDS.values()])
        bare(axes).imshow(kind, cmap=colors, vmin=0, vmax=3, interpolation="nearest")
        axes.set_title(f"{name_in_words(name)}\n{how}: {iou(mask, truth):.2f}")
    low = 0.97 * kind.shape[0]
    column[1].plot([1, 1 + SCALE_MM / touch.mm_per_px[0]], [low, low], color="black", lw=2)
    column[1].text(1, low - 0.03 * kind.shape[0], f"{SCALE_MM:g} mm")
drawing.legend(
    handles=[Patch(color=color, label=label) for label, color in KINDS.items()],
    loc="outside lower center",
    ncols=3,
    frameon=False,
)
drawing.savefig(Path(__file__).with_suffix(".png"), dpi=100, metadata={"Software": None})
