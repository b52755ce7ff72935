# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The separate places of a contact, with area and deepest point, and a plain word on the whole."""

from dataclasses import dataclass

import cv2
import numpy as np

from recon.arrays import ContactMask, DepthMap
from recon.contact.disturbed import BORDER_PX
from sensor.toml import Pair

LEAST_PX = 4
"""A smaller patch is a speck of noise."""


@dataclass(frozen=True, kw_only=True)
class ContactPatch:
    """One connected place of contact, in the gel frame."""

    area_mm2: float
    deepest_mm: float
    deepest_at_mm: Pair
    """x and y of the deepest point."""
    center_mm: Pair
    """x and y of the middle of its area."""
    at_border: bool
    """Whether the frame cuts it: it may go on beyond."""


def contact_patches(
    contact: ContactMask, depth_mm: DepthMap, mm_per_px: Pair
) -> tuple[ContactPatch, ...]:
    """The patches of a mask, the largest first; specks are left out.

    Args:
        contact: where something touches.
        depth_mm: of the same pixels.
        mm_per_px: pixel pitch along x and y.
    """
    height, width = contact.shape
    count, label, boxes, middles = cv2.connectedComponentsWithStats(
        contact.astype(np.uint8), connectivity=8
    )

    def in_gel_mm(column: float, row: float) -> Pair:
        return (
            (column - (width - 1) / 2) * mm_per_px[0],
            (row - (height - 1) / 2) * mm_per_px[1],
        )

    found = []
    for number in range(1, count):
        left, top, wide, high, area_px = (int(value) for value in boxes[number])
        if area_px < LEAST_PX:
            continue
        rows, columns = slice(top, top + high), slice(left, left + wide)
        depth = np.where(label[rows, columns] == number, depth_mm[rows, columns], -np.inf)
        row, column = np.unravel_index(depth.argmax(), depth.shape)
        found.append(
            ContactPatch(
                area_mm2=area_px * mm_per_px[0] * mm_per_px[1],
                deepest_mm=float(depth[row, column]),
                deepest_at_mm=in_gel_mm(float(left + column), float(top + row)),
                center_mm=in_gel_mm(float(middles[number][0]), float(middles[number][1])),
                at_border=min(left, top, width - left - wide, height - top - high) < BORDER_PX,
            )
        )
    return tuple(sorted(found, key=lambda patch: -patch.area_mm2))


def contact_word(patches: tuple[ContactPatch, ...]) -> str:
    """What a mask says, in words: "no contact", "1 patch", "3 patches, cut by the border"."""
    if not patches:
        return "no contact"
    word = "1 patch" if len(patches) == 1 else f"{len(patches)} patches"
    return word + (", cut by the border" if any(patch.at_border for patch in patches) else "")
