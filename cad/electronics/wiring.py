# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The wiring picture: supply, resistor board and arrays, with every wire in its colour."""

from html import escape
from textwrap import wrap

from cad.electronics.resistors import ballasts, takes_adapters_supply
from sensor.design import Wedge

_INK = {"red": "#d33", "green": "#2a2", "blue": "#36d"}
BOARD_WORDS = (
    "Resistor board, components toward you, J1 at the lower right: J1.1 is the lower hole of J1; J2"
    " runs along the top, with J2.1 at the left."
)
ARRAY_WORDS = (
    "LED array, LEDs toward you, tail to the right: the upper pad is the anode (A), the lower one"
    " the cathode (K). Each LED's cathode, between the printed bars, is toward the tail."
)


def wiring_svg(design: Wedge) -> bytes:
    """A diagram of who is wired to whom, not to scale."""
    found = ballasts(design)
    own = None if takes_adapters_supply(design) else "your own supply"
    source = "the CSI-to-HDMI adapter" if own is None else "a supply of your own"
    words = [*wrap(BOARD_WORDS, 115), *wrap(ARRAY_WORDS, 115)]
    foot = 10 + 18 * len(words)
    height = 100 + foot + 84 * len(found)
    ground = height - foot - 16
    drawn = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<svg xmlns="http://www.w3.org/2000/svg" width="820" height="{height}"'
        f' viewBox="0 0 820 {height}"'
        ' font-family="sans-serif" font-size="13">',
        f'<rect width="820" height="{height}" fill="#fff"/>',
        f'<text x="20" y="26" font-size="16">Wiring, {escape(design.name)}:'
        f" {design.wiring.supply_v:g} V from {source}</text>",
        _box(20, 60, 130, height - foot - 60, "#eee", "adapter" if own is None else own),
        _box(240, 60, 190, height - foot - 60, "#e3efe3", "resistor board"),
        *_wire(150, 90, 240, 90, "#c00", f"{design.wiring.supply_v:g} V to J1.1"),
        *_wire(150, ground, 240, ground, "#222", "GND to J1.2"),
    ]
    for index, ballast in enumerate(found):
        y = 110 + 84 * index
        ink = _INK[ballast.color]
        side = "base" if ballast.color == "green" else f"{ballast.color} side"
        drawn += [
            f'<rect x="290" y="{y - 9}" width="58" height="18" fill="#fff" stroke="#555"/>',
            f'<text x="319" y="{y + 5}" text-anchor="middle">R{index + 1} {ballast.label}</text>',
            f'<path d="M256,{y}H290M348,{y}H430" stroke="#c00" stroke-width="1.5" fill="none"/>',
            f'<path d="M410,{y + 34}H430" stroke="#222" stroke-width="1.5" fill="none"/>',
            f'<circle cx="256" cy="{y}" r="3.5" fill="#c00"/>',
            f'<circle cx="410" cy="{y + 34}" r="3.5" fill="#222"/>',
            *_wire(430, y, 560, y, ink, f"J2.{2 * index + 1}  anode"),
            *_wire(430, y + 34, 560, y + 34, "#222", f"J2.{2 * index + 2}  cathode"),
            _box(560, y - 20, 235, 70, "#f6f6f6", ""),
            f'<text x="572" y="{y}">{side}: {ballast.leds} LEDs in parallel</text>',
            f'<text x="572" y="{y + 18}">{ballast.led_current_ma:.1f} mA each,'
            f" {ballast.total_current_ma:.0f} mA in all</text>",
            *(
                f'<rect x="{572 + 14 * led}" y="{y + 26}" width="11" height="9" fill="{ink}"/>'
                for led in range(min(ballast.leds, 15))
            ),
        ]
    last = 110 + 84 * (len(found) - 1)
    drawn += [
        f'<path d="M240,90H256V{last}" stroke="#c00" stroke-width="1.5" fill="none"/>',
        f'<path d="M240,{ground}H410V144" stroke="#222" stroke-width="1.5" fill="none"/>',
        *(
            f'<text x="20" y="{height - foot + 20 + 18 * line}">{escape(text, quote=False)}</text>'
            for line, text in enumerate(words)
        ),
    ]
    return ("\n".join([*drawn, "</svg>"]) + "\n").encode()


def _box(x: int, y: int, width: int, height: int, fill: str, title: str) -> str:
    return (
        f'<rect x="{x}" y="{y}" width="{width}" height="{height}" fill="{fill}" stroke="#555"/>'
        f'<text x="{x + 8}" y="{y + 16}">{title}</text>'
    )


def _wire(x0: int, y0: int, x1: int, y1: int, ink: str, text: str) -> list[str]:
    return [
        f'<path d="M{x0},{y0}L{x1},{y1}" stroke="{ink}" stroke-width="2.5" fill="none"/>',
        f'<text x="{x0 + 6}" y="{y0 - 5}" font-size="11">{text}</text>',
    ]
