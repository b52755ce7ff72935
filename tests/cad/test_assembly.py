# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""One graph drives bill, guide, insertion and pictures: it must be whole and in order."""

import math
import re
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from bom.bill import make_bill, read_parts
from bom.fit import parts_for
from cad.build import Model, manifest_of
from cad.guide import guide_text
from sensor.design import FINGER, Channel, Wedge
from simulation.scene import sides


def guide_of(built: Model, design: Wedge | None = None) -> str:
    manifest = manifest_of(built, [])
    lines = make_bill(manifest["bill"], parts_for(built.design, read_parts()))
    names = {line.part.id: line.part.name for line in lines}
    order = [("a ball", "1 piece")]
    return guide_text(
        design or built.design, built.assembly, built.boards, manifest["parts"], names, order
    )


def side_of(built: Model, colour: str) -> np.ndarray:
    """From the acrylic's middle to an array's, in the body's frame."""
    low, high = built.body_meshes[f"{colour}_leds"].bounds
    start, end = built.body_meshes["acrylic"].bounds
    return np.asarray((low + high - start - end) / 2)


def test_every_body_goes_in_once_and_ends_in_the_sensor(finger: Model, standard: Model) -> None:
    for built in (finger, standard):
        assembly = built.assembly
        placed = Counter(name for step in assembly.steps for name in step.bodies)
        assert placed == Counter(list(assembly.bodies)) == Counter(list(built.bodies))
        last = assembly.steps[-1]
        in_sensor = {*assembly.group_before(last, "sensor"), *assembly.moving(last)}
        assert in_sensor == set(assembly.bodies)


def test_a_step_moves_what_stands_nowhere_yet(finger: Model) -> None:
    for step in finger.assembly.steps:
        assert not set(finger.assembly.moving(step)) & set(finger.assembly.standing(step))
        assert finger.assembly.moving(step)


def test_lights_follow_the_design(standard: Model) -> None:
    lights = standard.design.lights
    counts = {
        board.name: sum(c.part.startswith("led_") for c in board.components)
        for board in standard.boards
    }
    assert counts == {
        "resistor_board": 0,
        "led_array_red": lights.red_side_leds,
        "led_array_blue": lights.blue_side_leds,
        "led_array_green": lights.green_base_leds,
    }


def test_the_guide_tells_every_step_and_counts_every_body(finger: Model) -> None:
    text = guide_of(finger)
    taken: Counter[str] = Counter()
    called = dict[str, str]()
    for line in text.splitlines():
        if re.match(r"Take \d", line):
            for item in line.removeprefix("Take ").removesuffix(".").split("; "):
                found = re.fullmatch(r"(\d+) × (.+) \(`(.+)`\)", item)
                assert found, item
                taken[found[3]] += int(found[1])
                called[found[3]] = found[2]
    assert taken == Counter(finger.assembly.counts())
    assert called["case"] == "Case" and called["mirror"] == "Mirror, cut"
    assert called["csi_hdmi_board"] == "CSI-to-HDMI adapter, a pair of boards"
    assert called["screw_m2x6"] == "Screw ISO 4762 M2x6, steel"
    assert not [name for name in called.values() if "_" in name]
    assert "| a ball | 1 piece |" in text
    assert text.count("\n### Step ") == len(finger.assembly.steps)
    assert finger.design.sha256[:8] in text


def test_the_guide_sends_red_and_blue_to_the_sides_where_they_are(finger: Model) -> None:
    """From the tip one looks along x; with the gel down z is up, and right is their product."""
    right = np.cross([1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    text = guide_of(finger)
    for colour in ("red", "blue"):
        said = re.search(rf"{colour}(?: goes)? to the (left|right)", text, re.IGNORECASE)
        assert said and said[1] == ("right" if side_of(finger, colour) @ right > 0 else "left")


@pytest.mark.parametrize("name", ["standard", "finger"])
def test_lights_sit_where_the_gel_frame_and_the_twin_have_them(
    name: str, request: pytest.FixtureRequest
) -> None:
    """The gel frame's x runs to the tip and its z out of the gel: two signs of the body's turn."""
    built: Model = request.getfixturevalue(name)
    channels: dict[str, Channel] = {"red": "R", "green": "G", "blue": "B"}
    in_the_twin = {side.colour: np.array(side.centre_mm) for side in sides(built.design)}
    for colour, channel in channels.items():
        offset = side_of(built, colour)[:2] * [-1.0, 1.0]
        side = np.where(np.abs(offset) == np.abs(offset).max(), np.sign(offset), 0.0)
        azimuth = math.radians(built.design.lights.azimuths_deg[channel])
        assert side == pytest.approx([math.cos(azimuth), math.sin(azimuth)], abs=1e-9)
        twin = in_the_twin[channel]
        assert side == pytest.approx(twin / np.linalg.norm(twin), abs=1e-9)


def test_the_guide_says_the_voltage_of_the_design(finger: Model) -> None:
    five = replace(FINGER, wiring=replace(FINGER.wiring, supply_v=5.0))
    assert "supply wires to 3.3 V and" in guide_of(finger)
    assert "supply wires to 5 V and" in guide_of(finger, five)


def test_the_guide_of_a_flat_gel_names_no_curved_mold(finger: Model) -> None:
    flat = replace(FINGER, gel=replace(FINGER.gel, curved=False))
    assert "cavity of `mold_curved` (or `mold_flat`)" in guide_of(finger)
    assert "cavity of `mold_flat` up" in guide_of(finger, flat)
