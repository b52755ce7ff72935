# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""One graph drives bill, guide, insertion and pictures: it must be whole and in order."""

import re
from collections import Counter

from cad.build import Model, manifest_of
from cad.guide import guide_text


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
    manifest = manifest_of(finger, [])
    names = {part["id"]: part["id"] for part in manifest["parts"]}
    parts = [{**part, "title": part["id"]} for part in manifest["parts"]]
    text = guide_text(
        finger.design, finger.assembly, finger.boards, parts, names, [("a ball", "1 piece")]
    )
    taken: Counter[str] = Counter()
    for line in text.splitlines():
        if re.match(r"Take \d", line):
            for item in line.removeprefix("Take ").removesuffix(".").split("; "):
                count, part = item.split(" × ")
                taken[part] += int(count)
    assert taken == Counter(finger.assembly.counts())
    assert "| a ball | 1 piece |" in text
    assert text.count("\n### Step ") == len(finger.assembly.steps)
    assert finger.design.sha256[:8] in text
