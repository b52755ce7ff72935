# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Colours for the bodies of a STEP file, written after OCCT has written the shapes.

OCCT itself writes the styles of an assembly in an order that depends on addresses in memory, so
that no two files are the same.
"""

import re
from collections.abc import Callable, Mapping, Sequence

Color = tuple[float, float, float]

_ENTITY = re.compile(r"#(\d+)\s*=\s*(.*?);\s*?\n", re.DOTALL)


def with_colors(text: str, color_of: Callable[[str], Color]) -> str:
    """The file with each product's solids in its colour, as AP214 styles them.

    Args:
        text: a STEP file of an assembly.
        color_of: red, green and blue in 0 to 1 by the product's name.

    Raises:
        ValueError: the file holds no solid that belongs to a named product.
    """
    entities = {int(number): body for number, body in _ENTITY.findall(text)}
    following = max(entities) + 1
    lines: list[str] = []
    items: list[int] = []
    solids = _solids(entities)
    for name, solid, _ in solids:
        lines += _style(following, solid, color_of(name))
        items.append(following + 7)
        following += 8
    if not items:
        raise ValueError("no solid of a named product in this STEP file")
    listed = ",".join(f"#{item}" for item in items)
    kind = "MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION"
    lines.append(f"#{following}={kind}('',({listed}),{solids[0][2]});")
    head, _, tail = text.rpartition("ENDSEC;")
    return f"{head}{''.join(line + chr(10) for line in lines)}ENDSEC;{tail}"


def _style(first: int, solid: str, color: Color) -> list[str]:
    """Eight entities, from the colour to the item that it paints."""
    red, green, blue = (f"{value:.6f}" for value in color)
    chain = [
        f"COLOUR_RGB('',{red},{green},{blue})",
        f"FILL_AREA_STYLE_COLOUR('',#{first})",
        f"FILL_AREA_STYLE('',(#{first + 1}))",
        f"SURFACE_STYLE_FILL_AREA(#{first + 2})",
        f"SURFACE_SIDE_STYLE('',(#{first + 3}))",
        f"SURFACE_STYLE_USAGE(.BOTH.,#{first + 4})",
        f"PRESENTATION_STYLE_ASSIGNMENT((#{first + 5}))",
        f"STYLED_ITEM('color',(#{first + 6}),{solid})",
    ]
    return [f"#{first + index}={entity};" for index, entity in enumerate(chain)]


def _solids(entities: Mapping[int, str]) -> Sequence[tuple[str, str, str]]:
    """(name of the product, its solid, context of its shape), in the order of the file."""
    found = []
    for body in entities.values():
        if not body.startswith("SHAPE_DEFINITION_REPRESENTATION"):
            continue
        definition, shape = _references(body)
        representation = entities[shape]
        if not representation.startswith("ADVANCED_BREP_SHAPE_REPRESENTATION"):
            continue
        *held, context = _references(representation)
        name = _name(entities, definition)
        found += [
            (name, f"#{item}", f"#{context}")
            for item in held
            if entities[item].startswith("MANIFOLD_SOLID_BREP")
        ]
    return found


def _name(entities: Mapping[int, str], definition: int) -> str:
    """Name of the product: from its shape over its definition and formation."""
    body = entities[definition]
    while not body.startswith("PRODUCT("):
        body = entities[_references(body)[0]]
    return body.partition("'")[2].partition("'")[0]


def _references(body: str) -> list[int]:
    return [int(number) for number in re.findall(r"#(\d+)", body)]
