# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What a board house takes: Gerber RS-274X with X2 attributes, Excellon drill, placement."""

from collections.abc import Iterable, Iterator

from cad.electronics.boards import EDGE, Board, Rectangle
from cad.electronics.silkscreen import MASK_MARGIN, STROKE, Line, printed_lines

_OUTLINE = 0.1


def board_files(board: Board) -> Iterator[tuple[str, bytes]]:
    """(path, content) of every fabrication file of a board: layers in a folder, tables beside it.

    A house takes the folder, whose names tell the layers to whoever opens it as a whole.
    """
    pads = [pad.copper for pad in board.pads]
    through = [pad.copper for pad in board.pads if pad.drill]
    surface = [pad.copper for pad in board.pads if not pad.drill]
    layer = f"{board.name}/{board.name}"
    open_ = [pad.grown(MASK_MARGIN) for pad in pads]
    open_below = [pad.grown(MASK_MARGIN) for pad in through]
    yield f"{layer}-F_Cu.gtl", _gerber("Copper,L1,Top", [*pads, *board.tracks])
    yield f"{layer}-F_Mask.gts", _gerber("Soldermask,Top", open_, negative=True)
    yield f"{layer}-F_Paste.gtp", _gerber("Paste,Top", surface)
    yield f"{layer}-F_Silkscreen.gto", _drawn("Legend,Top", STROKE, printed_lines(board))
    yield f"{layer}-B_Mask.gbs", _gerber("Soldermask,Bot", open_below, negative=True)
    yield f"{layer}-Edge_Cuts.gm1", _outline(board)
    if through:
        yield f"{layer}-B_Cu.gbl", _gerber("Copper,L2,Bot", through)
        yield f"{layer}-PTH.drl", _drill(board)
    yield f"{board.name}-placement.csv", _placement(board)
    yield f"{board.name}-bill.csv", _bill(board)


def _gerber(function: str, rectangles: Iterable[Rectangle], negative: bool = False) -> bytes:
    """One layer of flashed rectangles, coordinates in nanometres."""
    flashes = list(rectangles)
    sizes = sorted({(round(f.size[0], 6), round(f.size[1], 6)) for f in flashes})
    codes = {size: 10 + index for index, size in enumerate(sizes)}
    lines = _head(function, negative)
    lines += [f"%ADD{code}R,{size[0]:.6f}X{size[1]:.6f}*%" for size, code in codes.items()]
    for size, code in codes.items():
        lines.append(f"D{code}*")
        for flash in flashes:
            if (round(flash.size[0], 6), round(flash.size[1], 6)) == size:
                lines.append(f"{_point(*flash.middle)}D03*")
    return _ended(lines)


def _outline(board: Board) -> bytes:
    width, height = board.size
    corners = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height), (0.0, 0.0)]
    return _drawn("Profile,NP", _OUTLINE, [corners])


def _drawn(function: str, width: float, drawn: Iterable[Line]) -> bytes:
    """One layer of open lines."""
    lines = [*_head(function, False), f"%ADD10C,{width:.6f}*%", "D10*", "G01*"]
    for line in drawn:
        lines += [f"{_point(*point)}D0{1 if index else 2}*" for index, point in enumerate(line)]
    return _ended(lines)


def _head(function: str, negative: bool) -> list[str]:
    return [
        "%TF.GenerationSoftware,GelSight Wedge,wedge fabricate*%",
        f"%TF.FileFunction,{function}*%",
        f"%TF.FilePolarity,{'Negative' if negative else 'Positive'}*%",
        "%FSLAX46Y46*%",
        "%MOMM*%",
        "%LPD*%",
    ]


def _ended(lines: list[str]) -> bytes:
    return ("\n".join([*lines, "M02*"]) + "\n").encode("ascii")


def _point(x: float, y: float) -> str:
    return f"X{round(x * 1e6)}Y{round(y * 1e6)}"


def _drill(board: Board) -> bytes:
    holes = [(pad.drill, pad.copper.middle) for pad in board.pads if pad.drill]
    sizes = sorted({size for size, _ in holes})
    lines = ["M48", "METRIC,TZ", "FMAT,2"]
    lines += [f"T{index + 1}C{size:.3f}" for index, size in enumerate(sizes)]
    lines += ["%", "G05"]
    for index, size in enumerate(sizes):
        lines.append(f"T{index + 1}")
        lines += [f"X{x:.3f}Y{y:.3f}" for own, (x, y) in holes if own == size]
    return ("\n".join([*lines, "T0", "M30"]) + "\n").encode("ascii")


def _placement(board: Board) -> bytes:
    lines = ["Designator,Val,Package,Mid X,Mid Y,Rotation,Layer"]
    for component in board.components:
        x, y = component.middle
        lines.append(
            f"{component.reference},{component.value},{component.package},"
            f"{x:.3f}mm,{y:.3f}mm,{component.rotation_deg:g},top"
        )
    return ("\n".join(lines) + "\n").encode("ascii")


def _bill(board: Board) -> bytes:
    """One line for each kind of component."""
    kinds: dict[tuple[str, str], list[str]] = {}
    for component in board.components:
        kinds.setdefault((component.value, component.package), []).append(component.reference)
    lines = ["Comment,Designator,Footprint,Quantity"]
    for (value, package), references in kinds.items():
        lines.append(f'{value},"{",".join(references)}",{package},{len(references)}')
    return ("\n".join(lines) + "\n").encode("ascii")


def board_note(board: Board) -> str:
    """What to order, in one line."""
    width, height = board.size
    layers = 2 if any(pad.drill for pad in board.pads) else 1
    return (
        f"{board.name}: {width:.2f} x {height:.2f} mm, {board.thickness:g} mm {board.material},"
        f" {layers} copper layer{'s' if layers > 1 else ''}, copper {EDGE:g} mm from the edge"
    )
