# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The bill counts what it is given, buys whole packs, and hides no guess."""

import csv
import io
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bom.bill import (
    BoughtPart,
    bill_csv,
    bill_markdown,
    distributor_csv,
    make_bill,
    read_parts,
    totals_text,
)
from sensor.errors import WedgeError

PARTS = read_parts()
COUNTS = {"camera": 1, "led_red": 7, "screw_m2x6": 6, "screw_m2x8": 4, "resistor_4R7": 2,
          "header_6": 1, "pla": 52.5}  # fmt: skip


def test_every_price_says_where_it_comes_from() -> None:
    assert {part.basis for part in PARTS} <= {"paper", "estimate"}
    (camera,) = [part for part in PARTS if part.basis == "paper"]
    assert (camera.id, camera.price_usd) == ("camera", 16.0)


def test_the_paper_s_products_are_named() -> None:
    text = " ".join(f"{part.brand} {part.number} {part.alternative}" for part in PARTS)
    for product in ("Chanzon 3528", "VViViD Air-Tint", "3635-70", "XP-565", "Print-On Silicone Ink",
                    "Sil-Poxy", "A-564", "Tegaderm"):  # fmt: skip
        assert product in text


def test_quantities_are_those_of_the_counts() -> None:
    rows = list(csv.DictReader(io.StringIO(bill_csv(make_bill(COUNTS, PARTS)))))
    assert {row["id"]: float(row["quantity"]) for row in rows} == COUNTS
    names = {row["id"]: row["number"] for row in rows}
    assert names["screw_m2x6"] == "ISO 4762 M2x6"
    assert names["resistor_4R7"] == "RC1206FR-074R7L"


def test_a_part_without_a_row_is_refused() -> None:
    for unknown in ("flux_capacitor", "screw_", "resistor_board_2"):
        with pytest.raises(WedgeError, match=f"no row for {unknown}"):
            make_bill({**COUNTS, unknown: 1}, PARTS)


@given(st.integers(1, 60), st.integers(1, 40), st.integers(1, 100))
def test_packs_are_whole_and_enough_and_no_more(need: int, sensors: int, pack: int) -> None:
    part = BoughtPart("x", "", "", "", "", "", pack, 2.5, "estimate", "", "")
    (line,) = make_bill({"x": need}, [part])
    packs = line.packs(sensors)
    assert (packs - 1) * pack < need * sensors <= packs * pack
    assert line.cost_usd(sensors) == packs * 2.5


def test_totals_are_the_sums_of_the_lines() -> None:
    lines = make_bill(COUNTS, PARTS)
    rows = list(csv.DictReader(io.StringIO(bill_csv(lines))))
    text = bill_markdown(lines, "a sensor")
    for sensors in (1, 10):
        total = sum(float(row[f"cost_for_{sensors}_usd"]) for row in rows)
        guess = total - sum(
            float(row[f"cost_for_{sensors}_usd"]) for row in rows if row["price_basis"] == "paper"
        )
        assert f"{total:.2f} USD" in totals_text(lines, sensors)
        assert f"{guess:.2f} of it estimated" in text


def test_a_distributor_gets_quantities_of_numbered_parts_only() -> None:
    rows = list(csv.DictReader(io.StringIO(distributor_csv(make_bill(COUNTS, PARTS), 10))))
    assert rows == [
        {
            "Quantity": str(math.ceil(20)),
            "Manufacturer Part Number": "RC1206FR-074R7L",
            "Customer Reference": "resistor_4R7",
        }
    ]
