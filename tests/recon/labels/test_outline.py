# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The outline of a disc gives its centre, however unevenly its sides are lit."""

import numpy as np
import pytest

from recon.labels.outline import outline_of

SIZE_PX = (160, 120)
RADIUS_PX = 20.0


def ring(center: tuple[float, float], uneven: float = 0.0) -> np.ndarray:
    """Change that rises to the rim and falls beyond, by another amount on each side."""
    y, x = np.mgrid[: SIZE_PX[1], : SIZE_PX[0]]
    dx, dy = x - center[0], y - center[1]
    distance = np.hypot(dx, dy)
    rise = np.minimum(distance / RADIUS_PX, 1) * np.exp(-np.maximum(distance - RADIUS_PX, 0) / 5)
    side = 1 + uneven * (0.8 * dx - 0.6 * dy) / np.maximum(distance, 1e-9)
    return (rise * side).astype(np.float32)


@pytest.mark.parametrize("uneven", [0.0, 0.4, 0.8])
@pytest.mark.parametrize("start", [(2.0, -3.0), (-3.0, 2.0), (0.0, 0.0)])
def test_uneven_light_does_not_pull_the_center(uneven: float, start: tuple[float, float]) -> None:
    center = (78.3, 61.6)
    first = (center[0] + start[0], center[1] + start[1])
    found = outline_of(ring(center, uneven), first, RADIUS_PX)
    assert found is not None
    assert np.hypot(*np.subtract(found.center_px, center)) < 0.15


def test_a_disc_cut_by_the_frame_is_centered_by_what_shows() -> None:
    center = (14.0, 60.0)
    found = outline_of(ring(center), (15.0, 58.5), RADIUS_PX)
    assert found is not None
    assert np.hypot(*np.subtract(found.center_px, center)) < 0.3


def test_too_small_an_arc_and_another_disc_give_no_center() -> None:
    assert outline_of(ring((-6.0, -4.0)), (-5.0, -4.0), RADIUS_PX) is None
    assert outline_of(ring((80.0, 60.0)), (94.0, 60.0), RADIUS_PX) is None
    assert outline_of(np.zeros((120, 160), np.float32), (80.0, 60.0), RADIUS_PX) is None


def test_outer_circles_that_lie_to_one_side_are_told() -> None:
    center = (78.3, 61.6)
    y, x = np.mgrid[: SIZE_PX[1], : SIZE_PX[0]].astype(np.float64)
    beyond = np.maximum(np.hypot(x - center[0], y - center[1]) - RADIUS_PX, 0)
    distance = np.hypot(x - 0.5 * beyond - center[0], y - center[1])
    drawn = np.minimum(distance / RADIUS_PX, 1) * np.exp(-np.maximum(distance - RADIUS_PX, 0) / 5)
    even = outline_of(ring(center), center, RADIUS_PX)
    turned = outline_of(drawn.astype(np.float32), center, RADIUS_PX)
    assert even is not None and even.spread < 0.005
    assert turned is not None and turned.spread > 0.02


def test_all_circles_of_a_disc_have_one_center_to_a_fiftieth_of_a_pixel() -> None:
    """Wherever it lies between the pixels, though rays are looked at every quarter of one."""
    for x, y in np.random.default_rng(0).uniform((70, 50), (90, 70), (12, 2)):
        found = outline_of(ring((x, y)), (x + 1, y - 1), RADIUS_PX)
        assert found is not None
        assert np.hypot(*np.subtract(found.center_px, (x, y))) < 0.02
        assert found.spread < 0.02 / RADIUS_PX


def test_a_bulge_of_a_ninth_of_the_outline_hardly_pulls_the_center() -> None:
    center = (78.3, 61.6)
    y, x = np.mgrid[: SIZE_PX[1], : SIZE_PX[0]]
    dx, dy = x - center[0], y - center[1]
    rim_px = RADIUS_PX + np.where(np.abs(np.arctan2(dy, dx)) < np.radians(20), 8, 0)
    distance = np.hypot(dx, dy)
    rise = np.minimum(distance / RADIUS_PX, 1) * np.exp(-np.maximum(distance - rim_px, 0) / 5)
    found = outline_of(rise.astype(np.float32), center, RADIUS_PX)
    assert found is not None
    assert np.hypot(*np.subtract(found.center_px, center)) < 0.5  # equal weights: 1.8
