# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The bill counts what it is given, buys whole packs, and hides no guess."""

import csv
import io
import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bom.bill import (
    COLUMNS,
    BoughtPart,
    Line,
    bill_csv,
    bill_markdown,
    distributor_csv,
    make_bill,
    read_part,
    read_parts,
    totals_text,
)
from sensor.errors import WedgeError

PARTS = read_parts()
COUNTS = {"camera": 1, "led_red": 7, "screw_m2x6": 6, "screw_m2x8": 4, "resistor_4R7": 2,
          "hdmi_cable": 1, "pla": 52.5}  # fmt: skip


def test_every_price_says_where_and_when_it_comes_from() -> None:
    assert {part.basis for part in PARTS} <= {"paper", "estimate"}
    (camera,) = [part for part in PARTS if part.basis == "paper"]
    assert (camera.id, camera.price_usd) == ("camera", 16.0)
    assert camera.price_words == "16.00 for 1 (paper, June 2021)"
    for part in PARTS:
        assert re.search(r"\((paper|estimate), [A-Z][a-z]+ 20\d\d\)$", part.price_words)
        assert part.supplier and part.alternative


@pytest.mark.parametrize(
    ("column", "value", "said"),
    [("date", "", "must have date"), ("date", "2026", "a date as 2026-11"),
     ("date", "2026-13", "a date as 2026-11"), ("date", "2026-00", "a date as 2026-11"),
     ("alternative", "", "must have alternative"), ("supplier", "", "must have supplier"),
     ("basis", "hearsay", "must be paper or estimate"),
     ("distributor_brand", "", "both distributor columns or neither"),
     ("made_for", "lights.led_width_mm", "made_for of led_red must be fields of the design"),
     ("made_for", "led_width_mm=2.8", "with their values, such as mirror.thickness_mm=1")],
)  # fmt: skip
def test_a_row_without_its_sources_is_refused(column: str, value: str, said: str) -> None:
    (led,) = [part for part in PARTS if part.id == "led_red"]
    row = {key: str(getattr(led, key)) for key in COLUMNS}
    with pytest.raises(WedgeError, match=said):
        read_part({**row, column: value})


def test_a_table_with_other_columns_or_an_id_twice_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    row = {key: str(getattr(PARTS[0], key)) for key in COLUMNS}
    for other in ({**row, "colour": "red"}, {key: row[key] for key in COLUMNS[:-1]}):
        with pytest.raises(WedgeError, match="must have the columns id, name"):
            read_part(other)
    monkeypatch.setattr("bom.bill.files", lambda _: tmp_path)
    (tmp_path / "data").mkdir()
    stream = io.StringIO()
    writer = csv.DictWriter(stream, COLUMNS)
    writer.writeheader()
    writer.writerows([row, row])
    (tmp_path / "data" / "parts.csv").write_text(stream.getvalue())
    with pytest.raises(WedgeError, match=f"names {PARTS[0].id} twice"):
        read_parts()


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
    part = BoughtPart("x", "", "", "", "", "", "", "", pack, 2.5, "estimate", "2026-11", "", "")
    (line,) = make_bill({"x": need}, [part])
    packs = line.packs(sensors)
    assert (packs - 1) * pack < need * sensors <= packs * pack
    assert line.cost_usd(sensors) == packs * 2.5


def test_three_times_a_tenth_is_no_more_than_three_tenths() -> None:
    part = BoughtPart("x", "", "", "", "", "", "", "", 0.3, 2.5, "estimate", "2026-11", "", "")
    assert Line(part, 0.1).packs(3) == 1
    assert Line(part, 0.11).packs(3) == 2
    assert Line(part, 0.1).distributor_quantity(30) == 3
    assert Line(part, 0.11).distributor_quantity(30) == 4


@pytest.mark.parametrize(
    ("unit", "quantity", "words"),
    [
        ("piece", 7, "7 pieces"),
        ("piece", 1, "1 piece"),
        ("m", 0.96, "0.96 m"),
        ("g", 31, "31 g"),
        ("ml", 4.8, "4.8 ml"),
    ],
)
def test_more_than_one_are_several(unit: str, quantity: float, words: str) -> None:
    part = BoughtPart("x", "", "", "", "", "", "", unit, 1, 2.5, "estimate", "2026-11", "", "")
    assert Line(part, quantity).quantity_words == words


def test_totals_are_the_sums_of_the_lines() -> None:
    lines = make_bill(COUNTS, PARTS)
    rows = list(csv.DictReader(io.StringIO(bill_csv(lines))))
    text = bill_markdown(lines, "a sensor")
    for sensors in (1, 10):
        total = sum(float(row[f"cost_for_{sensors}_usd"]) for row in rows)
        guess = total - sum(
            float(row[f"cost_for_{sensors}_usd"]) for row in rows if row["price_basis"] == "paper"
        )
        assert f": {total:.2f} USD, {total / sensors:.2f} each" in totals_text(lines, sensors)
        assert f"{guess:.2f} of it estimated" in text


def test_no_camera_is_ordered_whose_ribbon_the_ordered_adapter_does_not_take() -> None:
    """Of both only the adapter is numbered, as the heads that are sold have another ribbon."""
    rows = {part.id: part for part in PARTS}
    camera, board = rows["camera"], rows["csi_hdmi_board"]
    assert board.distributor_number in camera.alternative
    (wanted, other) = re.findall(r"(\d+)(?: contacts)?, ([\d.]+ mm) apart", camera.alternative)
    assert re.findall(r"(\d+) contacts, ([\d.]+ mm) apart", board.alternative) == [wanted]
    assert wanted != other
    lines = make_bill({"camera": 1, "csi_hdmi_board": 1}, PARTS)
    asked = csv.DictReader(io.StringIO(distributor_csv(lines)))
    assert {row["Customer Reference"] for row in asked} == {"csi_hdmi_board"}


def test_a_distributor_gets_quantities_of_numbered_parts_only() -> None:
    lines = make_bill({**COUNTS, "wire": 4.0}, PARTS)
    rows = list(csv.DictReader(io.StringIO(distributor_csv(lines, 10))))
    asked = {row["Customer Reference"]: row for row in rows}
    assert set(asked) == {"led_red", "resistor_4R7", "hdmi_cable", "wire"}
    assert asked["resistor_4R7"]["Manufacturer Part Number"] == "RC1206FR-074R7L"
    assert asked["hdmi_cable"]["Manufacturer Part Number"] == "P568-006"
    counts = {name: int(row["Quantity"]) for name, row in asked.items()}
    # 40 m of wire are two reels of 100 feet.
    assert counts == {"led_red": 70, "resistor_4R7": 20, "hdmi_cable": 10, "wire": 2}
    assert all(row["Manufacturer"] for row in rows)
