# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Sheets to be cut: closed outlines on CUT, stroked labels on ENGRAVE and NOTE, in mm.

Acrylic and mirror come twice: nominal, for a laser that makes up for its kerf itself, and grown by
half the kerf of the design's ``laser`` table. Films come nominal only: most are vinyl, whose fumes
in a laser are hydrogen chloride, so a knife cuts them.
"""

import io
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass

from ezdxf import units
from ezdxf._options import options
from ezdxf.document import Drawing
from ezdxf.filemanagement import new
from ezdxf.layouts.layout import Modelspace

from bom.fit import CUT_GAP_MM, SHEETS_MM, sheet_of
from cad.layout import Layout
from cad.strokes import strokes
from sensor.design import Wedge

Vertex = tuple[float, float, float]
"""x, y and the bulge of the edge that follows: tan(angle / 4) of its arc, 0 for a line."""

_LETTER = 2.0
"""Height of what is written."""
_COMB_TOOTH, _COMB_TEETH, _COMB_ROW = 10.0, 10, 5


@dataclass(frozen=True)
class Piece:
    """One outline and how many the sensor needs, around its own middle."""

    id: str
    length: float
    width: float
    quantity: int
    notches: tuple[float, float, float] | None = None
    """Of the acrylic: place from the tip end, from the side edge outward, and radius."""


@dataclass(frozen=True)
class Sheet:
    """All pieces that one material is cut into."""

    material: str
    thickness_mm: float
    kerf_mm: float | None
    """Of the laser; None where a knife cuts."""
    pieces: tuple[Piece, ...]
    side_mm: int = SHEETS_MM[0]
    """Of the sheet."""

    @property
    def name(self) -> str:
        """Material, thickness and number of pieces, as in the file's name and engraved."""
        count = sum(piece.quantity for piece in self.pieces)
        return f"{self.material}_{self.thickness_mm:g}mm_x{count}"


def sheets(design: Wedge) -> list[Sheet]:
    """The sheets of a design."""
    place, laser = Layout(design), design.laser
    acrylic, mirror = design.acrylic, design.mirror
    (pin_x, pin_y), _ = place.pin_places
    notch = (pin_x - place.acrylic_x0, -pin_y - place.acrylic_half, place.pin_hole_radius)
    block = Piece("acrylic", acrylic.length_mm, acrylic.width_mm, 1, notch)
    glass = Piece("mirror", mirror.length_mm, mirror.width_mm, 1)
    made = [
        Sheet(name, thickness, kerf, (piece,), sheet_of(design, name)[0])
        for name, thickness, kerf, piece in (
            ("acrylic", acrylic.thickness_mm, laser.acrylic_kerf_mm, block),
            ("mirror", mirror.thickness_mm, laser.mirror_kerf_mm, glass),
        )
    ]
    colors = [row.color for row in place.light_rows()]
    sides = sum(color != "green" for color in colors)
    strips = {"side": sides, "base": len(colors) - sides}
    for film, thickness in place.films.items():
        pieces = [
            Piece(f"{film}_{where}", end - start, acrylic.thickness_mm, strips[where])
            for where, (start, end) in place.film_ranges.items()
            if strips[where]
        ]
        made.append(Sheet(film, round(thickness, 3), None, tuple(pieces)))
    return made


def outline(piece: Piece, grow: float = 0.0) -> list[Vertex]:
    """The piece's closed outline, anticlockwise, moved outward by ``grow``."""
    x, y = piece.length / 2 + grow, piece.width / 2 + grow
    if piece.notches is None:
        return [(-x, -y, 0.0), (x, -y, 0.0), (x, y, 0.0), (-x, y, 0.0)]
    along, outward, radius = piece.notches
    middle = (-piece.length / 2 + along, piece.width / 2 + outward)
    radius -= grow
    reach = math.sqrt(radius**2 - (middle[1] - y) ** 2)
    end = (middle[0] + reach, y)
    if radius > middle[0] + x:  # the notch cuts off the corner
        start = (-x, middle[1] - math.sqrt(radius**2 - (middle[0] + x) ** 2))
        corner = []
    else:  # once grown, a sliver of the tip's edge remains beside it
        start = (middle[0] - reach, y)
        corner = [(-x, y, 0.0)]
    turn = _angle(middle, end) - _angle(middle, start)
    bulge = math.tan((turn % (2 * math.pi)) / 4)
    return [
        *[(px, -py, 0.0) for px, py, _ in corner],
        (start[0], -start[1], -bulge),
        (end[0], -y, 0.0),
        (x, -y, 0.0),
        (x, y, 0.0),
        (end[0], y, -bulge),
        (start[0], start[1], 0.0),
        *corner,
    ]


def _angle(middle: tuple[float, float], point: tuple[float, float]) -> float:
    return math.atan2(point[1] - middle[1], point[0] - middle[0])


def laser_files(design: Wedge) -> Iterator[tuple[str, bytes]]:
    """(name, DXF) of every sheet; for a laser also with its kerf, and a comb to measure that."""
    for sheet in sheets(design):
        yield f"{sheet.name}_nominal.dxf", sheet_dxf(sheet, 0.0)
        if sheet.kerf_mm is None:
            continue
        if sheet.kerf_mm:
            name = f"{sheet.name}_kerf{sheet.kerf_mm:g}.dxf"
            yield name, sheet_dxf(sheet, sheet.kerf_mm)
        comb = f"kerf_comb_{sheet.material}_{sheet.thickness_mm:g}mm"
        yield f"{comb}.dxf", comb_dxf(sheet)


def sheet_dxf(sheet: Sheet, kerf_mm: float) -> bytes:
    """One sheet: each kind of piece in rows of its own, with thickness and quantity below them."""
    document, space = _new_document()
    laser = "the laser must add its kerf" if sheet.kerf_mm is not None else "never by laser"
    cut = f"kerf {kerf_mm:g} mm added" if kerf_mm else f"nominal: {laser}"
    _write(space, "NOTE", f"{sheet.name}, {cut}, unit mm", (0, -8))
    y = 0.0
    for piece in sheet.pieces:
        # On the sheet, not on the piece: the camera looks through every face of the acrylic.
        label = f"{piece.id} {sheet.thickness_mm:g} mm x{piece.quantity}"
        _write(space, "ENGRAVE", label, (0, y))
        x, y = 0.0, y + _LETTER + CUT_GAP_MM
        wide, deep = piece.length + kerf_mm, piece.width + kerf_mm
        for _ in range(piece.quantity):
            if x and x + wide > sheet.side_mm:
                x, y = 0.0, y + deep + CUT_GAP_MM
            middle = (x + wide / 2, y + deep / 2)
            moved = [
                (px + middle[0], py + middle[1], bulge)
                for px, py, bulge in outline(piece, kerf_mm / 2)
            ]
            space.add_lwpolyline(moved, format="xyb", close=True, dxfattribs={"layer": "CUT"})
            x += wide + CUT_GAP_MM
        y += deep + CUT_GAP_MM
    return _bytes(document)


def comb_dxf(sheet: Sheet) -> bytes:
    """Ten squares of 10 mm: cut, push together, measure; kerf = (100 mm - length) / 10."""
    document, space = _new_document()
    note = f"push the {_COMB_TEETH} squares together: kerf = (100 - length in mm) / {_COMB_TEETH}"
    _write(space, "NOTE", f"{sheet.material} {sheet.thickness_mm:g} mm, {note}", (0, -8))
    for tooth in range(_COMB_TEETH):
        row, place = divmod(tooth, _COMB_ROW)
        x, y = place * (_COMB_TOOTH + CUT_GAP_MM), row * (_COMB_TOOTH + CUT_GAP_MM)
        far, top = x + _COMB_TOOTH, y + _COMB_TOOTH
        square = [(x, y), (far, y), (far, top), (x, top)]
        space.add_lwpolyline(square, close=True, dxfattribs={"layer": "CUT"})
    return _bytes(document)


def _new_document() -> tuple[Drawing, Modelspace]:
    options.write_fixed_meta_data_for_testing = True  # else each file holds its own date
    document = new("R2010", units=units.MM)
    for layer, color in {"CUT": 1, "ENGRAVE": 5, "NOTE": 8}.items():
        document.layers.add(layer, color=color)
    return document, document.modelspace()


def _write(space: Modelspace, layer: str, text: str, place: tuple[float, float]) -> None:
    """A text as open lines, since a laser's software may know no font."""
    for line in strokes(text, place, _LETTER):
        space.add_lwpolyline(line, dxfattribs={"layer": layer})


def _bytes(document: Drawing) -> bytes:
    stream = io.StringIO()
    document.write(stream)
    return _CLASSES.sub(_sorted_classes, stream.getvalue()).encode("utf-8")


_CLASSES = re.compile(r"(  2\nCLASSES\n)(.*?)(  0\nENDSEC)", re.DOTALL)


def _sorted_classes(section: re.Match[str]) -> str:
    """The section's records in order; ezdxf writes them in that of a set."""
    head, body, end = section.groups()
    records = sorted(f"  0\nCLASS{record}" for record in body.split("  0\nCLASS")[1:])
    return head + "".join(records) + end
