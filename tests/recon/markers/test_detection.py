# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import numpy as np
import pytest
from scipy.spatial import KDTree

from recon.markers.detection import find_markers, unexpected_dots
from tests.dotted import HEIGHT, WIDTH, dotted, grid_px, pad
from validation.dots import COUNTED_FRAMES, hand_counted, score_detection


def matched(markers, places, within_px):
    """For each true place the index of the dot found there, -1 for none."""
    away, found = KDTree(markers.position_px).query(places)
    return np.where(away < within_px, found, -1)


@pytest.mark.parametrize("spacing_px", [13.0, 20.0, 31.0])
@pytest.mark.parametrize("share", [0.13, 0.2])
def test_every_dot_is_found_and_none_invented_whatever_size_and_spacing(spacing_px, share):
    places = grid_px(spacing_px)
    markers = find_markers(dotted(places, share * spacing_px))
    found = matched(markers, places, 1.0)
    assert (found >= 0).all() and len(markers) == len(places)
    assert markers.spacing_px == pytest.approx(spacing_px, rel=0.02)
    assert markers.diameter_px == pytest.approx(2 * share * spacing_px, rel=0.2)
    error = markers.position_px[found] - places
    assert np.sqrt((error**2).mean()) < 0.1


@pytest.mark.parametrize("height", [180, 223, 240])
def test_dots_a_tenth_as_wide_as_the_frame_are_found(height):
    size, radius_px = (4 * height // 3, height), height / 20
    places = grid_px(3.2 * radius_px, size=size, margin_px=radius_px + 2)
    markers = find_markers(dotted(places, radius_px, pad(size)))
    assert (matched(markers, places, 1.0) >= 0).all() and len(markers) == len(places)
    assert markers.diameter_px == pytest.approx(2 * radius_px, rel=0.1)


@pytest.mark.parametrize("turn_deg", [0.0, 12.0, 30.0, 45.0])
@pytest.mark.parametrize("bend", [-0.15, 0.0, 0.15])
def test_neighbours_have_neighbouring_cells_on_turned_and_bent_grids(turn_deg, bend):
    places = grid_px(20.0, turn_deg, bend)
    markers = find_markers(dotted(places))
    assert len(markers) == len(places)
    cells = {tuple(cell): i for i, cell in enumerate(markers.cell.tolist())}
    assert len(cells) == len(markers)
    steps = [
        np.linalg.norm(markers.position_px[cells[row, column + 1]] - markers.position_px[i])
        for (row, column), i in cells.items()
        if (row, column + 1) in cells
    ]
    assert len(steps) > 0.7 * len(markers)
    assert 14 < min(steps) and max(steps) < 27


def test_missing_dots_leave_holes_and_specks_off_the_grid_are_not_dots():
    places = grid_px(20.0)
    rng = np.random.default_rng(1)
    kept = places[rng.random(len(places)) > 0.12]
    specks = places[rng.choice(len(places), 4, replace=False)] + [9.0, 10.0]
    markers = find_markers(dotted(np.concatenate([kept, specks])))
    assert (matched(markers, kept, 1.0) >= 0).all()
    assert len(markers) == len(kept)


@pytest.mark.parametrize(
    ("row", "turned"), [(1, False), (3, False), (5, False), (1, True), (5, True)]
)
def test_a_line_of_dots_that_is_missing_takes_no_other_dots_along(row, turned):
    places = grid_px(20.0)
    along = places[:, 0 if turned else 1]
    kept = places[abs(along - np.unique(along.round(6))[row]) > 1]
    markers = find_markers(dotted(kept))
    assert (matched(markers, kept, 1.0) >= 0).all() and len(markers) == len(kept)


@pytest.mark.parametrize("ratio", [1.8, 2.4, 3.0])
@pytest.mark.parametrize("turned", [False, True])
def test_rows_may_be_farther_apart_than_the_dots_in_them(ratio, turned):
    places = grid_px(12.0)
    middle, axis = np.array([WIDTH, HEIGHT]) / 2, 0 if turned else 1
    places[:, axis] = middle[axis] + ratio * (places[:, axis] - middle[axis])
    places = places[(places > 8).all(1) & (places < [WIDTH - 9, HEIGHT - 9]).all(1)]
    markers = find_markers(dotted(places))
    assert (matched(markers, places, 1.0) >= 0).all() and len(markers) == len(places)
    assert markers.spacing_px == pytest.approx(12, rel=0.02)


def test_dots_that_a_smear_joins_are_two():
    places = grid_px(20.0)
    image = dotted(places)
    (x, y), (x_next, _) = places[20], places[21]
    assert x_next - x == pytest.approx(20.0)
    image[round(y), round(x) : round(x_next)] *= 0.4
    markers = find_markers(image)
    assert (matched(markers, places, 2.5) >= 0).all() and len(markers) == len(places)


def test_dots_in_dark_corners_are_found():
    places = grid_px(20.0)
    markers = find_markers(dotted(places, image=pad(vignette=0.9), noise=0.002))
    assert (matched(markers, places, 1.0) >= 0).all() and len(markers) == len(places)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("specks", [0, 40])
def test_a_gel_without_a_grid_of_dots_has_no_markers(seed, specks):
    dirt = np.random.default_rng(seed).uniform(5, [WIDTH - 5, HEIGHT - 5], (specks, 2))
    assert find_markers(dotted(dirt, seed=seed)) is None


@pytest.mark.parametrize("mm_per_px", [(0.1, 0.1), (0.1, 0.15), (0.2, 0.1)])
def test_the_spacing_of_a_square_grid_is_told_in_mm_whatever_the_shape_of_pixels(mm_per_px):
    spacing_mm, size = 2.0, (240, 180)
    steps = np.divide(spacing_mm, mm_per_px)
    columns, rows = (
        np.arange(12.0, side - 12, step) for side, step in zip(size, steps, strict=True)
    )
    places = np.stack(np.meshgrid(columns, rows), -1).reshape(-1, 2)
    markers = find_markers(dotted(places, 2.5))
    assert markers is not None and len(markers) == len(places)
    assert markers.card(mm_per_px)["spacing_mm"] == pytest.approx(spacing_mm, rel=0.01)


@pytest.mark.parametrize("mm_per_px", [(0.1, 0.4), (0.4, 0.1), (0.2, 0.2)])
def test_a_dot_s_diameter_in_mm_is_that_of_the_disc_of_equal_area(mm_per_px):
    markers = find_markers(dotted(grid_px(20.0), 3.0))
    assert markers.card(mm_per_px)["diameter_mm"] == round(0.2 * markers.diameter_px, 4)


@pytest.mark.parametrize("light", [0.8, 1.0, 1.2])
@pytest.mark.parametrize(("spacing_px", "darkness"), [(9.0, 0.8), (13.0, 0.2), (31.0, 0.12)])
def test_dots_that_the_blank_frame_has_not_are_told_in_any_light(light, spacing_px, darkness):
    places, none = grid_px(spacing_px), np.zeros((0, 2))
    blank, radius_px = dotted(none), 0.2 * spacing_px
    image = light * dotted(places, radius_px, darkness=darkness, seed=1)
    assert unexpected_dots(image, blank).startswith(f"{len(places)} dots, but the blank frame")
    assert unexpected_dots(light * dotted(none, seed=2), blank) == ""
    aside = places[places[:, 0] < 0.45 * WIDTH]  # as a dotted thing's
    assert unexpected_dots(dotted(aside, radius_px, seed=3), blank) == ""


def test_frames_too_small_for_a_grid_have_none():
    assert find_markers(np.full((5, 7, 3), 0.4, np.float32)) is None
    assert find_markers(np.zeros((60, 80, 3), np.float32)) is None


@pytest.mark.parametrize("name", COUNTED_FRAMES)
def test_on_real_gels_the_dots_counted_by_eye_are_found(name):
    counted = hand_counted(name)
    if counted is None:
        pytest.skip(f"{name} is not on this machine")
    score = score_detection(*counted)
    assert score.found >= 0.98 * score.whole
    assert score.false <= 0.01 * score.whole
