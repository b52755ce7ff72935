# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The bill of materials: bought parts as data, quantities counted from the assembly.

Nothing here says how many of a part a sensor needs: that comes as ``counts``, from the bodies of
the assembly and the components of its boards.
"""

import csv
import io
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from importlib.resources import files
from typing import Any

from sensor.errors import WedgeError

COLUMNS = (
    "id", "name", "brand", "number", "supplier", "distributor_brand", "distributor_number", "unit",
    "pack_size", "price_usd", "basis", "date", "alternative", "made_for",
)  # fmt: skip
UNCOUNTED = ("m", "g", "ml")
_DATE = "%Y-%m"
_SIZE = r"\w+\.\w+=\d+(\.\d+)?"


@dataclass(frozen=True)
class BoughtPart:
    """One row of the parts table."""

    id: str
    name: str
    brand: str
    number: str
    supplier: str
    distributor_brand: str
    distributor_number: str
    """What electronics distributors sell for it; empty where they sell nothing of the kind."""
    unit: str
    pack_size: float
    price_usd: float
    basis: str
    """Where the price comes from: ``paper`` or ``estimate``."""
    date: str
    """Year and month of the price, or of the guess, as 2026-11."""
    alternative: str
    made_for: str
    """Sizes of the design that the product fits, as ``mirror.thickness_mm=1``; empty for any."""

    @property
    def price_words(self) -> str:
        """The price with its source: ``16.00 for 1 (paper, June 2021)``."""
        month = datetime.strptime(self.date, _DATE).strftime("%B %Y")
        return f"{self.price_usd:.2f} for {self.pack_size:g} ({self.basis}, {month})"

    @property
    def made_for_sizes(self) -> list[tuple[str, float]]:
        """Each field of the design that the product depends on, and the value it is made for."""
        pairs = [item.partition("=") for item in self.made_for.split()]
        return [(field, float(size)) for field, _, size in pairs]


@dataclass(frozen=True)
class Line:
    """One line of a bill: a part and how much of it one sensor takes."""

    part: BoughtPart
    quantity: float

    @property
    def quantity_words(self) -> str:
        """How much one sensor takes: ``7 pieces``, ``0.96 m``."""
        unit = self.part.unit
        is_counted = unit not in UNCOUNTED and self.quantity != 1
        return f"{self.quantity:g} {unit}{'s' * is_counted}"

    def packs(self, sensors: int) -> int:
        """Packs to buy for a number of sensors."""
        return math.ceil(self.quantity * sensors / self.part.pack_size - 1e-9)

    def distributor_quantity(self, sensors: int) -> int:
        """What a distributor counts: pieces, or reels of what is sold by the metre."""
        if self.part.unit == "m":
            return self.packs(sensors)
        return math.ceil(self.quantity * sensors - 1e-9)

    def cost_usd(self, sensors: int) -> float:
        """Price of those packs."""
        return self.packs(sensors) * self.part.price_usd


def read_parts() -> list[BoughtPart]:
    """The table of bought parts; ``bom.fit`` fills a design's sizes into its words.

    Raises:
        WedgeError: a column is missing or unknown, an id comes twice, a field is empty, or a price
            has no basis or no date.
    """
    text = files("bom").joinpath("data", "parts.csv").read_text(encoding="utf-8")
    rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    parts = [read_part(row) for row in rows]
    ids = [part.id for part in parts]
    twice = sorted({part for part in ids if ids.count(part) > 1})
    if twice:
        raise WedgeError(f"bom/data/parts.csv names {', '.join(twice)} twice: keep one row.")
    return parts


def read_part(row: Mapping[str, str]) -> BoughtPart:
    """One row of the table.

    Raises:
        WedgeError: as ``read_parts``.
    """
    if tuple(row) != COLUMNS:
        raise WedgeError(f"bom/data/parts.csv must have the columns {', '.join(COLUMNS)}.")
    if row["basis"] not in ("paper", "estimate"):
        raise WedgeError(f"bom/data/parts.csv: the basis of {row['id']} must be paper or estimate.")
    free = ("distributor_brand", "distributor_number", "made_for")
    empty = [key for key in COLUMNS if not row[key] and key not in free]
    if empty or not re.fullmatch(r"20\d\d-(0[1-9]|1[0-2])", row["date"]):
        raise WedgeError(
            f"bom/data/parts.csv: {row['id']} must have {', '.join(empty) or 'a date as 2026-11'}."
        )
    if bool(row["distributor_brand"]) != bool(row["distributor_number"]):
        raise WedgeError(
            f"bom/data/parts.csv: {row['id']} must have both distributor columns or neither."
        )
    if not re.fullmatch(rf"({_SIZE}( {_SIZE})*)?", row["made_for"]):
        raise WedgeError(
            f"bom/data/parts.csv: made_for of {row['id']} must be fields of the design with their"
            " values, such as mirror.thickness_mm=1."
        )
    values: dict[str, Any] = dict(row)
    for key in ("pack_size", "price_usd"):
        values[key] = float(row[key])
    return BoughtPart(**values)


def make_bill(counts: Mapping[str, float], parts: Sequence[BoughtPart]) -> list[Line]:
    """The lines for the counted parts, in the order of the table.

    Raises:
        WedgeError: a counted part is not in the table.
    """
    lines = []
    left = dict(counts)
    for part in parts:
        for part_id in [known for known in left if _matches(part.id, known)]:
            lines.append(Line(_named(part, part_id), left.pop(part_id)))
    if left:
        raise WedgeError(
            f"the bill has no row for {', '.join(sorted(left))}: add it to bom/data/parts.csv."
        )
    return lines


def _matches(pattern: str, part_id: str) -> bool:
    stem = pattern.removesuffix("*")
    if stem == pattern:
        return part_id == pattern
    return part_id.startswith(stem) and bool(re.fullmatch(r"m?\d[\dKRx.]*", part_id[len(stem) :]))


def _named(part: BoughtPart, part_id: str) -> BoughtPart:
    """A row of a family with the member's own size in its name and number."""
    if "*" not in part.id:
        return part
    size = part_id.removeprefix(part.id.removesuffix("*"))
    size = size.upper().replace("X", "x") if size.startswith("m") else size
    values = {key: getattr(part, key) for key in COLUMNS}
    values |= {
        "id": part_id,
        "name": part.name.replace("*", size),
        "number": part.number.replace("*", size),
        "distributor_number": part.distributor_number.replace("*", size),
    }
    return BoughtPart(**values)


def bill_csv(lines: Sequence[Line]) -> str:
    """The bill as a table for spreadsheets."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(
        ["id", "quantity", "unit", *COLUMNS[1:7], "pack_size", "price_usd", "price_basis",
         "price_date", "packs_for_1", "cost_for_1_usd", "packs_for_10", "cost_for_10_usd",
         "alternative"]
    )  # fmt: skip
    for line in lines:
        part = line.part
        writer.writerow(
            [part.id, f"{line.quantity:g}", part.unit, part.name, part.brand, part.number,
             part.supplier, part.distributor_brand, part.distributor_number,
             f"{part.pack_size:g}", f"{part.price_usd:.2f}", part.basis, part.date,
             line.packs(1), f"{line.cost_usd(1):.2f}", line.packs(10), f"{line.cost_usd(10):.2f}",
             part.alternative]
        )  # fmt: skip
    return stream.getvalue()


def bill_markdown(lines: Sequence[Line], title: str) -> str:
    """The bill to read, with the totals."""
    rows = [
        f"# Bill of materials, {title}",
        "",
        "Quantities are counted from the assembly and its boards. Prices marked *estimate* are our"
        " guesses of that month, not looked up: check them before you order. Brands and numbers are"
        " the paper's if it names them; the last column but one is what `distributor.csv` orders"
        " instead.",
        "",
        "| part | quantity | brand and number | supplier | price of a pack, USD |"
        " distributor's part | alternative |",
        "|---|---|---|---|---|---|---|",
    ]
    for line in lines:
        part = line.part
        other = f"{part.distributor_brand} {part.distributor_number}".strip() or "-"
        rows.append(
            f"| {part.name} | {line.quantity_words} | {part.brand} {part.number} |"
            f" {part.supplier} | {part.price_words} | {other} | {part.alternative} |"
        )
    rows += ["", *(totals_text(lines, sensors) for sensors in (1, 10)), ""]
    return "\n".join(rows)


def totals_text(lines: Sequence[Line], sensors: int) -> str:
    """What whole packs cost for a number of sensors, and how much of that is estimated."""
    total = sum(line.cost_usd(sensors) for line in lines)
    guess = sum(line.cost_usd(sensors) for line in lines if line.part.basis == "estimate")
    one = "sensor" if sensors == 1 else "sensors"
    return (
        f"For {sensors} {one}, in whole packs: {total:.2f} USD, {total / sensors:.2f} each;"
        f" {guess:.2f} of it estimated.\n"
    )


def distributor_csv(lines: Sequence[Line], sensors: int = 1) -> str:
    """Quantity, manufacturer and its number, reference, as distributors' order pages take them."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["Quantity", "Manufacturer Part Number", "Manufacturer", "Customer Reference"])
    for line in lines:
        part = line.part
        if part.distributor_number:
            count = line.distributor_quantity(sensors)
            writer.writerow([count, part.distributor_number, part.distributor_brand, part.id])
    return stream.getvalue()
