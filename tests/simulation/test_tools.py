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
    roller = height("roller")[:, len(ALONG_MM) // 2]
    inside = np.abs(ALONG_MM) < 2.9
    circle = 3 - np.sqrt(9 - ALONG_MM[inside] ** 2)
    assert np.allclose(roller[inside], circle, atol=0.01)


@pytest.mark.parametrize("design", [STANDARD, FINGER])
def test_every_tool_can_be_pressed_at_both_depths(design) -> None:
    presses = presses_of(design, "tools", count=2, seed=0)
    assert len(presses) == len(TOOLS) * len(DEPTHS_MM)
    assert {press.depth_mm for press in presses} == set(DEPTHS_MM.values())
    ForkingPickler.dumps(presses)  # they are rendered by other processes
    (one,) = presses_of(design, "disc_deep", count=2, seed=0)
    assert one.name == "disc_deep" and one.depth_mm == DEPTHS_MM["deep"]
