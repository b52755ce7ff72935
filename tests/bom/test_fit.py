# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The bill's rows are the design's: its sizes, and no product of another size."""

import csv
import io
from dataclasses import replace
from typing import Any

import pytest

from bom.bill import BoughtPart, distributor_csv, make_bill, read_parts
from bom.fit import parts_for
from sensor.design import FINGER, STANDARD, Wedge

LEDS = ("led_red", "led_green", "led_blue")


def changed(group: str, **values: Any) -> Wedge:
    return replace(STANDARD, **{group: replace(getattr(STANDARD, group), **values)})


def rows(design: Wedge) -> dict[str, BoughtPart]:
    return {part.id: part for part in parts_for(design, read_parts())}


@pytest.mark.parametrize("design", [STANDARD, FINGER], ids=lambda design: design.name)
def test_the_known_designs_take_the_table_s_products(design: Wedge) -> None:
    table = {part.id: part for part in read_parts()}
    for key, row in rows(design).items():
        assert (row.brand, row.number) == (table[key].brand, table[key].number)
        assert row.distributor_number == table[key].distributor_number
        assert "{" not in "".join(map(str, vars(row).values()))
    assert rows(design)["led_red"].name == "LED of 3.5 x 2.8 x 1.9 mm, red, without lens"


SIZED = {
    "mirror": ("mirror", {"thickness_mm": 1.5}, "x 1.5 mm"),
    "acrylic": ("acrylic", {"thickness_mm": 3.75}, "x 3.75 mm"),
    "camera": ("camera", {"diagonal_view_deg": 112.0}, "a view of 112°"),
    "wire": ("wiring", {"wire_diameter_mm": 0.7}, "Wire, 0.7 mm"),
    "led_green": ("lights", {"led_width_mm": 2.0}, "LED of 3.5 x 2 x 1.9 mm, green"),
}


@pytest.mark.parametrize(("part", "case"), SIZED.items(), ids=SIZED)
def test_a_row_has_the_design_s_size_in_its_name(
    part: str, case: tuple[str, dict[str, float], str]
) -> None:
    group, values, words = case
    assert words in rows(changed(group, **values))[part].name
    assert words not in rows(STANDARD)[part].name


MISFITS = {
    "a narrow lens": ("camera", {"diagonal_view_deg": 112.0}, ("camera",)),
    "a wide head": ("camera", {"head_size_mm": 9.5}, ("camera",)),
    "a thin barrel": ("camera", {"barrel_diameter_mm": 6.0}, ("camera",)),
    "a pale filter": ("lights", {"gray_filter_transmission": 0.8}, ("gray_filter",)),
    "a thick wire": ("wiring", {"wire_diameter_mm": 0.7}, ("wire",)),
    "narrow LEDs": ("lights", {"led_width_mm": 2.0}, LEDS),
    "flat LEDs": ("lights", {"led_height_mm": 1.4}, LEDS),
}


@pytest.mark.parametrize(("group", "values", "parts"), MISFITS.values(), ids=MISFITS)
def test_a_product_of_another_size_is_not_ordered_and_the_row_says_why(
    group: str, values: dict[str, float], parts: tuple[str, ...]
) -> None:
    table, found = rows(STANDARD), rows(changed(group, **values))
    ((field, value),) = values.items()
    known = getattr(getattr(STANDARD, group), field)
    for key in parts:
        reason = found[key].alternative
        assert reason.startswith("not ") and table[key].number in reason
        why, _, instead = reason.partition("; ")
        assert why.endswith(f": its {group}.{field} is {known:g}, not {value:g}")
        assert (found[key].brand, found[key].number) == ("any", "of this size")
        assert (found[key].basis, found[key].date) == ("estimate", "2026-11")
        if key == "camera":  # what any head must be stays
            assert "OV5647" in found[key].name and "15 contacts" in instead
        else:
            assert instead.split()[0] == table[key].alternative.split()[0]
    assert {key: row for key, row in found.items() if key not in parts} == {
        key: row for key, row in table.items() if key not in parts
    }
    counts = dict.fromkeys((*LEDS, "wire", "hdmi_cable"), 1)
    ordered = csv.DictReader(io.StringIO(distributor_csv(make_bill(counts, list(found.values())))))
    assert {row["Customer Reference"] for row in ordered} == counts.keys() - set(parts)
