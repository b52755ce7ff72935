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
from importlib.resources import files
from typing import Any

from sensor.errors import WedgeError

COLUMNS = (
    "id", "name", "brand", "number", "supplier", "unit", "pack_size", "price_usd", "basis", "date",
    "alternative",
)  # fmt: skip


@dataclass(frozen=True)
class BoughtPart:
    """One row of the parts table."""

    id: str
    name: str
    brand: str
    number: str
    supplier: str
    unit: str
    pack_size: float
    price_usd: float
    basis: str
    """Where the price comes from: ``paper`` or ``estimate``."""
    date: str
    alternative: str


@dataclass(frozen=True)
class Line:
    """One line of a bill: a part and how much of it one sensor takes."""

    part: BoughtPart
    quantity: float

    def packs(self, sensors: int) -> int:
        """Packs to buy for a number of sensors."""
        return math.ceil(self.quantity * sensors / self.part.pack_size - 1e-9)

    def cost_usd(self, sensors: int) -> float:
        """Price of those packs."""
        return self.packs(sensors) * self.part.price_usd


def read_parts() -> list[BoughtPart]:
    """The table of bought parts.

    Raises:
        WedgeError: a column is missing or unknown, an id comes twice, or a price has no basis.
    """
    text = files("bom").joinpath("data", "parts.csv").read_text(encoding="utf-8")
    rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    parts = [_part(row) for row in rows]
    ids = [part.id for part in parts]
    twice = sorted({part for part in ids if ids.count(part) > 1})
    if twice:
        raise WedgeError(f"bom/data/parts.csv names {', '.join(twice)} twice: keep one row.")
    return parts


def _part(row: Mapping[str, str]) -> BoughtPart:
    if tuple(row) != COLUMNS:
        raise WedgeError(f"bom/data/parts.csv must have the columns {', '.join(COLUMNS)}.")
    if row["basis"] not in ("paper", "estimate"):
        raise WedgeError(f"bom/data/parts.csv: the basis of {row['id']} must be paper or estimate.")
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
    return part_id.startswith(stem) and bool(re.fullmatch(r"m?\d[\dRx.]*", part_id[len(stem) :]))


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
    }
    return BoughtPart(**values)


def bill_csv(lines: Sequence[Line]) -> str:
    """The bill as a table for spreadsheets."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(
        ["id", "quantity", "unit", *COLUMNS[1:5], "pack_size", "price_usd", "price_basis",
         "price_date", "packs_for_1", "cost_for_1_usd", "packs_for_10", "cost_for_10_usd",
         "alternative"]
    )  # fmt: skip
    for line in lines:
        part = line.part
        writer.writerow(
            [part.id, f"{line.quantity:g}", part.unit, part.name, part.brand, part.number,
             part.supplier, f"{part.pack_size:g}", f"{part.price_usd:.2f}", part.basis, part.date,
             line.packs(1), f"{line.cost_usd(1):.2f}", line.packs(10), f"{line.cost_usd(10):.2f}",
             part.alternative]
        )  # fmt: skip
    return stream.getvalue()


def bill_markdown(lines: Sequence[Line], title: str) -> str:
    """The bill to read, with the totals."""
    rows = [
        f"# Bill of materials, {title}",
        "",
        "Quantities are counted from the assembly and its boards. Prices marked *estimate* were"
        " looked up nowhere: check them before you order.",
        "",
        "| part | quantity | brand and number | supplier | price of a pack, USD | instead |",
        "|---|---|---|---|---|---|",
    ]
    for line in lines:
        part = line.part
        pack = f"{part.price_usd:.2f} for {part.pack_size:g}, {part.basis}"
        rows.append(
            f"| {part.name} | {line.quantity:g} {part.unit} | {part.brand} {part.number} |"
            f" {part.supplier} | {pack} | {part.alternative} |"
        )
    rows += ["", *(totals_text(lines, sensors) for sensors in (1, 10)), ""]
    return "\n".join(rows)


def totals_text(lines: Sequence[Line], sensors: int) -> str:
    """What whole packs cost for a number of sensors, and how much of that is estimated."""
    total = sum(line.cost_usd(sensors) for line in lines)
    guess = sum(line.cost_usd(sensors) for line in lines if line.part.basis == "estimate")
    one = "sensor" if sensors == 1 else "sensors"
    return (
        f"For {sensors} {one}, whole packs: {total:.2f} USD, {total / sensors:.2f} each;"
        f" {guess:.2f} of it estimated.\n"
    )


def distributor_csv(lines: Sequence[Line], sensors: int = 1) -> str:
    """Quantity, manufacturer's number and reference, as distributors' order pages take them."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["Quantity", "Manufacturer Part Number", "Customer Reference"])
    for line in lines:
        if line.part.supplier == "electronics distributor" and line.part.brand != "any":
            count = math.ceil(line.quantity * sensors)
            writer.writerow([count, line.part.number, line.part.id])
    return stream.getvalue()
