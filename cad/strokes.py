# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Letters as open lines that a laser follows once: its software may know no font.

Each letter stands on a grid 4 wide and 6 high, as strokes of two-digit points, x then y.
"""

Point = tuple[float, float]

_STROKES = {
    "A": "00 03 26 43 40,03 43", "B": "00 06 36 45 44 33 42 41 30 00,03 33",
    "C": "45 36 16 05 01 10 30 41", "D": "00 06 26 44 42 20 00", "E": "46 06 00 40,03 33",
    "F": "46 06 00,03 33", "G": "45 36 16 05 01 10 30 41 43 23", "H": "00 06,40 46,03 43",
    "I": "16 36,26 20,10 30", "J": "46 41 30 10 01", "K": "00 06,46 03 40", "L": "06 00 40",
    "M": "00 06 23 46 40", "N": "00 06 40 46", "O": "10 01 05 16 36 45 41 30 10",
    "P": "00 06 36 45 44 33 03", "Q": "10 01 05 16 36 45 41 30 10,22 40",
    "R": "00 06 36 45 44 33 03,23 40", "S": "45 36 16 05 04 13 33 42 41 30 10 01",
    "T": "06 46,26 20", "U": "06 01 10 30 41 46", "V": "06 20 46", "W": "06 10 23 30 46",
    "X": "00 46,06 40", "Y": "06 23 46,23 20", "Z": "06 46 00 40",
    "0": "10 01 05 16 36 45 41 30 10,01 45", "1": "15 26 20,10 30", "2": "05 16 36 45 44 00 40",
    "3": "06 46 23 33 42 41 30 10 01", "4": "30 36 02 42", "5": "46 06 04 34 43 41 30 10 01",
    "6": "36 16 05 01 10 30 41 42 33 03", "7": "06 46 10", "8": "13 04 05 16 36 45 44 33 13 02 01"
    " 10 30 41 42 33", "9": "10 30 41 45 36 16 05 04 13 43", ".": "20 21", ",": "21 10",
    "-": "13 33", "_": "00 40", "=": "12 32,14 34", "+": "13 33,22 24", "/": "00 46", ":": "21 22,"
    "24 25", "(": "36 25 21 30", ")": "16 25 21 10", " ": "",
}  # fmt: skip
_WIDTH, _HEIGHT, _ADVANCE = 4.0, 6.0, 6.0


def strokes(text: str, place: Point, height: float) -> list[list[Point]]:
    """Open lines that write a text, its lower left corner at a place. Capitals only."""
    x0, y0 = place
    scale = height / _HEIGHT
    lines = []
    for index, letter in enumerate(text.upper()):
        for stroke in filter(None, _STROKES[letter].split(",")):
            lines.append(
                [
                    (x0 + (index * _ADVANCE + int(at[0])) * scale, y0 + int(at[1]) * scale)
                    for at in stroke.split()
                ]
            )
    return lines


def width_of(text: str, height: float) -> float:
    """Width of a text in mm."""
    return max(0.0, (len(text) - 1) * _ADVANCE + _WIDTH) * height / _HEIGHT
