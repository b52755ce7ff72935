# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The bound that a refusal names is a way on: who sets it is not refused for the same again."""

import re
from collections.abc import Iterator
from dataclasses import fields
from itertools import pairwise, product
from typing import Any

import numpy as np
import pytest

from cad.layout import Layout
from cad.refusals import refuse_unbuildable
from sensor.design import FINGER, STANDARD, Wedge
from sensor.errors import WedgeError
from tests.cad.test_designs import IMPOSSIBLE, REASONS, changed

NAMED = re.compile(r"(\w+)\.(\w+) = \S+ must be at (?:least|most) (-?[\d.]+\b)(, but)?.*?: (.*)")
MOST = 12
"""More refusals one after the other are a circle."""
SINGLE: list[tuple[Wedge, str, dict[str, Any]]]
SINGLE = [(design, group, values) for design, group, values in REASONS.values()]
SINGLE += [(STANDARD, group, values) for _, group, values in IMPOSSIBLE.values()]


def refusal_of(design: Wedge) -> str:
    """What a design is refused with; empty for one that is taken."""
    try:
        refuse_unbuildable(design)
    except WedgeError as refusal:
        return str(refusal)
    return ""


def followed(design: Wedge) -> Iterator[tuple[str, str, float]]:
    """Sentence, field and bound of each refusal of one who does what they say.

    Until one names no bound, or says that none helps: its bound is NaN. At most ``MOST``.
    """
    for _ in range(MOST):
        said = refusal_of(design)
        if not said:
            return
        found = NAMED.fullmatch(said)
        if not found or found[4]:
            yield said, "", np.nan
            return
        group, name, bound = found[1], found[2], float(found[3])
        yield said, f"{group}.{name}", bound
        whole = isinstance(getattr(getattr(design, group), name), int)
        try:
            design = changed(design, group, **{name: int(bound) if whole else bound})
        except WedgeError:  # no design of any kind may have it
            return


def why(said: str) -> str:
    """Of a refusal, what is wrong."""
    return said.partition(": ")[2]


@pytest.mark.parametrize(("design", "group", "values"), SINGLE, ids=[*REASONS, *IMPOSSIBLE])
def test_a_named_bound_is_enough_for_its_reason(
    design: Wedge, group: str, values: dict[str, Any]
) -> None:
    reasons = [why(said) for said, _, _ in followed(changed(design, group, **values))]
    assert len(set(reasons)) == len(reasons)


@pytest.mark.parametrize("seed", range(60))
def test_who_does_what_refusals_say_gets_to_an_end(seed: int) -> None:
    """A design that is taken, or one of which no bound helps: none is sent round in circles."""
    random = np.random.default_rng(seed)
    design = (STANDARD, FINGER)[seed % 2]
    for _ in range(random.integers(1, 5)):
        group = str(random.choice([item.name for item in fields(design) if item.name != "name"]))
        part = getattr(design, group)
        values = {item.name: getattr(part, item.name) for item in fields(part)}
        name = str(random.choice([key for key in values if isinstance(values[key], float)]))
        try:
            moved = round(values[name] * random.uniform(0.7, 1.4), 3)
            design = changed(design, group, **{name: moved})
        except WedgeError:
            continue
    refusals = [(field, why(said)) for said, field, _ in followed(design)]
    assert len(refusals) < MOST
    assert all(refusal != following for refusal, following in pairwise(refusals))


def test_wire_channels_beside_the_acrylic_s_ribs_are_widened_by_higher_leds() -> None:
    """The ribs stand out by 0.9 mm and the pressed gap; film and backing take 0.6 mm."""
    for height, press in product((1.0, 1.1, 1.19, 1.3), (0.05, 0.15)):
        design = changed(changed(STANDARD, "lights", led_height_mm=height), "printing",
                         press_clearance_mm=press)  # fmt: skip
        wide = height + 0.6 - 0.9 - press
        assert Layout(design).channel_y[1] - Layout(design).channel_y[0] == pytest.approx(wide)
        refused = refusal_of(design).startswith(f"lights.led_height_mm = {height:g} must")
        assert refused == (wide < 0.8)


def test_wire_channels_beside_the_camera_s_tunnel_are_widened_by_a_wider_acrylic() -> None:
    """A head of 21 mm stands in a tunnel wider than the acrylic."""
    design = changed(STANDARD, "camera", head_size_mm=21.0, pupil_z_mm=11.0, pupil_x_mm=45.0)
    design = changed(design, "gel", pad_width_mm=12.0)
    design = changed(design, "acrylic", width_mm=21.0)
    design = changed(design, "housing", wall_mm=2.0, case_length_mm=60.0, roof_z_mm=27.0)
    bounds = {field: bound for _, field, bound in followed(design)}
    fits = changed(design, "acrylic", width_mm=bounds["acrylic.width_mm"])
    inner, outer = Layout(fits).channel_y
    assert outer - inner == pytest.approx(0.8, abs=1e-3)


SEEN = {
    "between the ledges": changed(changed(STANDARD, "gel", pad_length_mm=33.0), "mirror",
                                  width_mm=22.6),
    "past the ledge and the baffle": changed(FINGER, "gel", pad_length_mm=13.8),
    "below the mirror's foot": changed(STANDARD, "acrylic", length_mm=34.5),
}  # fmt: skip


@pytest.mark.parametrize("design", SEEN.values(), ids=SEEN)
def test_a_bound_without_a_closed_form_is_the_largest_value(design: Wedge) -> None:
    said, field, bound = next(followed(design))
    group, _, name = field.partition(".")
    for more, refused in ((0.0, False), (0.003, True)):
        above = refusal_of(changed(design, group, **{name: bound + more}))
        assert (why(said) in above) == refused


FAR = changed(changed(STANDARD, "camera", pupil_x_mm=46.0, pupil_z_mm=11.0), "acrylic",
              width_mm=32.0)  # fmt: skip
IN_VAIN = {
    "thick screws, too near": (
        changed(FINGER, "fastening", screw="M2.5", boss_pitch_mm=13.0),
        "fastening.boss_pitch_mm", "a thicker wall or thinner screws",
    ),
    "thick screws, too far apart": (
        changed(FINGER, "fastening", screw="M2.5", boss_pitch_mm=15.0),
        "fastening.boss_pitch_mm", "a thicker wall or thinner screws",
    ),
    "thin screws, too near": (
        changed(changed(FINGER, "camera", head_size_mm=9.8), "fastening", boss_pitch_mm=8.0),
        "fastening.boss_pitch_mm", "a thicker wall, or a smaller camera head",
    ),
    "a mirror too short to see all, too long for its window": (
        changed(FAR, "housing", roof_z_mm=27.0, case_length_mm=56.0),
        "mirror.length_mm", "a shorter pad or a longer acrylic",
    ),
    "a lens deep in its holder": (
        changed(changed(STANDARD, "camera", pupil_x_mm=47.4), "housing", case_length_mm=86.0,
                roof_z_mm=31.0),
        "camera.barrel_diameter_mm", "a larger head, or move camera.pupil_x_mm toward the tip",
    ),
    "a camera's head between floor and mirror": (
        changed(FINGER, "camera", head_size_mm=27.0),
        "camera.pupil_z_mm", "move the camera back",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("design", "field", "way"), IN_VAIN.values(), ids=IN_VAIN)
def test_bounds_that_cannot_both_be_kept_are_named_together_with_a_way_out(
    design: Wedge, field: str, way: str
) -> None:
    *_, (said, _, _) = followed(design)
    other = r"but may (?:not )?be (?:below )?([\d.]+) "
    found = re.match(rf"{field} = \S+ must be at (least|most) ([\d.]+), {other}", said)
    assert found and way in said, said
    assert (float(found[2]) > float(found[3])) == (found[1] == "least")
    assert found[2] != found[3]
