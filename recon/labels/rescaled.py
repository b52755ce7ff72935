# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Labels moved to the pixels of another scale, where that was measured anew."""

import math
from dataclasses import replace

from recon.labels.label_book import largest_radius_px
from sensor.dataset import BallLabel, Dataset, frame_name


def rescaled_label(label: BallLabel, before: Dataset, after: Dataset) -> BallLabel:
    """A circle where it was on the gel, smaller than its ball, in the pixels of another card.

    Args:
        label: in pixels of ``before``.
        before: by the card until now.
        after: by the new card, whose unwarped pictures may have another size.
    """
    sizes = before.card.unwarped_size_px, after.card.unwarped_size_px
    old, new = ((1, 1) if size is None else size for size in sizes)
    x, y = (n / m for m, n in zip(old, new, strict=True))
    radius_px = label.contact_radius_px * math.sqrt(x * y)
    return replace(
        label,  # the middle of the first pixel is 0
        center_x_px=round((label.center_x_px + 0.5) * x - 0.5, 2),
        center_y_px=round((label.center_y_px + 0.5) * y - 0.5, 2),
        contact_radius_px=round(min(radius_px, largest_radius_px(after, label)), 2),
    )


def merged(before: Dataset, after: Dataset, now: Dataset) -> list[BallLabel]:
    """Circles found anew, and those that somebody wrote meanwhile, carried over.

    Args:
        before: as it was read.
        after: the same by the new card, with circles found by it; frames without one have no label.
        now: as it is on disk, still by the card of ``before``.
    """
    known = {frame_name(label.file): label for label in before.labels}
    found = {frame_name(label.file): label for label in after.labels}
    labels: list[BallLabel | None] = []
    for label in now.labels:
        name = frame_name(label.file)
        is_theirs = label != known.get(name)
        labels.append(rescaled_label(label, before, after) if is_theirs else found.get(name))
    return [label for label in labels if label is not None]
