# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Tools have the faces that they are called by, and fit every pad at both depths."""

from multiprocessing.reduction import ForkingPickler

import numpy as np
import pytest

from sensor.design import FINGER, STANDARD
from simulation.dataset import presses_of
from simulation.tools import DEPTHS_MM, STEP, TOOLS, tools

PAD_MM = (30.0, 20.0)  # a unit is 1.5 mm
UNIT_MM = 1.5
ALONG_MM = np.arange(-6, 6, 0.02) + 0.01
X, Y = np.meshgrid(ALONG_MM, ALONG_MM)


def common_area(radius: float, other: float, apart: float) -> float:
    """Of two discs, by the sectors and triangles that their common chord leaves."""
    half = np.arccos((apart**2 + radius**2 - other**2) / (2 * apart * radius))
    turn = np.arccos((apart**2 + other**2 - radius**2) / (2 * apart * other))
    sectors = radius**2 * half + other**2 * turn
    return float(sectors - apart * radius * np.sin(half))


FACES = {
    "disc": np.pi * 2**2,
    "peg": np.pi * 0.8**2,
    "square": 3.2**2,
    "triangle": 3 * np.sqrt(3) * 1.2**2,
    "hexagon": 2 * np.sqrt(3) * 1.8**2,
    "bar": 6 * 1.2,
    "cross": 2 * 6 * 1.2 - 1.2**2,
    "ring": np.pi * (2.5**2 - 1.5**2),
    "sector": 0.75 * np.pi * 2.2**2,
    "moon": np.pi * 2.2**2 - common_area(2.2, 1.7, 1.3),
    "step": np.pi,
    "pins": 9 * np.pi * 0.5**2,
    "grooves": 4 * 0.6 * 4.8,
    "frustum": 2**2,
}
"""Areas of lowest faces, in squared units."""


def height(name: str) -> np.ndarray:
    return tools(PAD_MM)[f"{name}_deep"].profile(X, Y)


@pytest.mark.parametrize("name", FACES)
def test_a_lowest_face_has_its_area_in_closed_form(name) -> None:
    lowest = height(name) == 0
    area_mm2 = lowest.sum() * 0.02**2
    assert area_mm2 == pytest.approx(FACES[name] * UNIT_MM**2, rel=0.03)


@pytest.mark.parametrize("name", TOOLS)
def test_a_tool_begins_at_zero_and_ends_where_it_says(name) -> None:
    found = height(name)
    under = np.isfinite(found)
    half_mm = tools(PAD_MM)[f"{name}_deep"].size_mm[0] / 2
    assert not np.isnan(found).any()
    assert 0 <= found.min() < 0.02
    assert np.maximum(np.abs(X), np.abs(Y))[under].max() == pytest.approx(half_mm, abs=0.04)


def test_round_and_stepped_undersides_rise_as_said() -> None:
    assert np.unique(height("step")).tolist() == pytest.approx([0, STEP * UNIT_MM, np.inf])
    for name, slope in (("frustum", 1.0), ("cone", 0.6)):
        profile = height(name)[len(ALONG_MM) // 2]
        outside = np.isfinite(profile) & (ALONG_MM > 2)
        assert np.allclose(np.diff(profile[outside]) / 0.02, slope, rtol=1e-4)
    assert np.unique(height("grooves")).tolist() == pytest.approx([0, UNIT_MM, np.inf])
    middle = len(ALONG_MM) // 2
    dome = np.abs(ALONG_MM) < 1.7 * UNIT_MM
    ball = 3 * UNIT_MM - np.sqrt((3 * UNIT_MM) ** 2 - ALONG_MM[dome] ** 2)
    assert np.allclose(height("dome")[middle][dome], ball, atol=0.01)
    wave = height("wave")[middle]
    under = np.isfinite(wave)
    touching = ALONG_MM[wave < 1e-3]
    crests = touching[np.diff(touching, prepend=-np.inf) > 0.1]
    assert len(crests) == 3 and np.allclose(np.diff(crests), 1.6 * UNIT_MM, atol=0.03)
    assert wave[under].max() == pytest.approx(0.4 * UNIT_MM, abs=1e-3)
    roller = height("roller")[:, len(ALONG_MM) // 2]
    inside = np.abs(ALONG_MM) < 2.9
    circle = 3 - np.sqrt(9 - ALONG_MM[inside] ** 2)
    assert np.allclose(roller[inside], circle, atol=0.01)


@pytest.mark.parametrize("pad_mm", [(30.0, 20.0), (12.0, 8.0), (5.0, 6.0)])
def test_tools_are_as_large_as_suits_the_pad(pad_mm) -> None:
    made = tools(pad_mm).values()
    assert all(max(tool.size_mm) <= min(pad_mm) for tool in made)
    assert max(max(tool.size_mm) for tool in made) >= min(0.6 * min(pad_mm), 9.0) - 1e-9


@pytest.mark.parametrize("design", [STANDARD, FINGER])
def test_every_tool_can_be_pressed_at_both_depths(design) -> None:
    presses = presses_of(design, "tools", count=2, seed=0)
    assert len(presses) == len(TOOLS) * len(DEPTHS_MM)
    assert {press.depth_mm for press in presses} == set(DEPTHS_MM.values())
    ForkingPickler.dumps(presses)  # they are rendered by other processes
    (one,) = presses_of(design, "disc_deep", count=2, seed=0)
    assert one.name == "disc_deep" and one.depth_mm == DEPTHS_MM["deep"]
