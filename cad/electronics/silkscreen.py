# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What is printed on a board: where cathodes, anodes, connectors and resistors are."""

from collections.abc import Iterator
from itertools import pairwise

from cad.electronics.boards import Board, Component, Pad
from cad.strokes import Point, strokes, width_of

Line = list[Point]

STROKE = 0.15
"""Width of a printed line, in mm."""
MASK_MARGIN = 0.05
"""By which the solder mask's openings are larger than the pads; ink stays out of them."""
_LETTER, _SPACE = 1.0, 0.3


def printed_lines(board: Board) -> list[Line]:
    """All printed lines, in mm; a mark that would reach a pad or the board's edge is left out."""
    marks = _marks_of_array(board) if board.name.startswith("led_array") else _marks_of_wires(board)
    return [line for mark in marks if _is_clear(board, mark) for line in mark]


def _marks_of_array(board: Board) -> Iterator[list[Line]]:
    """A bar above and below each LED's cathode, K before it, and A and K before the tail's pads."""
    pads = {(pad.component, pad.pin): pad.copper for pad in board.pads}
    for led in board.components:
        cathode, height = pads[led.reference, "K"], board.size[1]
        rail = (height - cathode.size[1]) / 4
        yield [[(x, y) for x in cathode.x] for y in (rail, height - rail)]
        yield _before(cathode.x[0], cathode.middle[1], "K")
    for pin in ("A", "K"):
        tail = pads["J1", pin]
        yield _before(tail.x[0], tail.middle[1], pin)


def _marks_of_wires(board: Board) -> Iterator[list[Line]]:
    """Names beside connectors and resistors, and at each hole what is soldered in."""
    pads = {(pad.component, pad.pin): pad for pad in board.pads}
    for resistor in board.components:
        x, y = resistor.middle
        yield strokes(resistor.reference, (x + 1.2, y - _LETTER / 2), _LETTER)
    for pin, sign in (("1", "+"), ("2", "-")):
        hole = pads["J1", pin].copper
        yield strokes(sign, (hole.x[1] + _SPACE, hole.middle[1] - _LETTER / 2), _LETTER)
    above = pads["J1", "2"].copper
    yield _centered(above.middle[0], above.y[1] + _SPACE, "J1")
    first = pads["J2", "1"].copper
    yield _before(first.x[0], first.middle[1], "J2")
    for resistor in board.components:
        yield from _marks_of_row(board, resistor, pads)


def _marks_of_row(
    board: Board, resistor: Component, pads: dict[tuple[str, str], Pad]
) -> Iterator[list[Line]]:
    """The array's colour under its two holes, A and K above them."""
    net = next(net for net, pins in board.nets.items() if (resistor.reference, "2") in pins)
    anode = next(pin for part, pin in board.nets[net] if part == "J2")
    holes = [pads["J2", pin].copper for pin in (anode, str(int(anode) + 1))]
    for hole, letter in zip(holes, "AK", strict=True):
        yield _centered(hole.middle[0], hole.y[1] + _SPACE, letter)
    middle = (holes[0].middle[0] + holes[1].middle[0]) / 2
    yield _centered(middle, holes[0].y[0] - _SPACE - _LETTER, net.removesuffix("_A"))


def _before(x: float, middle: float, text: str) -> list[Line]:
    start = x - _SPACE - width_of(text, _LETTER)
    return strokes(text, (start, middle - _LETTER / 2), _LETTER)


def _centered(middle: float, y: float, text: str) -> list[Line]:
    return strokes(text, (middle - width_of(text, _LETTER) / 2, y), _LETTER)


def _is_clear(board: Board, mark: list[Line]) -> bool:
    xs, ys = zip(*(point for line in mark for point in line), strict=True)
    if min(*xs, *ys) < STROKE or max(xs) > board.size[0] - STROKE:
        return False
    opened = [pad.copper.grown(MASK_MARGIN + STROKE / 2) for pad in board.pads]
    return max(ys) <= board.size[1] - STROKE and not any(
        _crosses(pad.x, pad.y, line) for pad in opened for line in mark
    )


def _crosses(x: Point, y: Point, line: Line) -> bool:
    """Whether the box of any of a line's pieces shares area with a rectangle."""
    return any(
        min(a[0], b[0]) < x[1]
        and max(a[0], b[0]) > x[0]
        and min(a[1], b[1]) < y[1]
        and max(a[1], b[1]) > y[0]
        for a, b in pairwise(line)
    )
