# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Does the copper join the pins of each net, and only those? Found from its geometry."""

from itertools import combinations

from cad.electronics.boards import Board
from cad.electronics.resistors import RATED_W, ballasts
from cad.result import Result
from sensor.design import Wedge

SMALLEST_GAP = 0.15
"""What any board house can etch, in mm."""


def islands(board: Board) -> list[set[int]]:
    """Pieces of copper that touch, as indices into the pads and then the tracks."""
    copper = [pad.copper for pad in board.pads] + list(board.tracks)
    parent = list(range(len(copper)))

    def root(index: int) -> int:
        while parent[index] != index:
            index = parent[index]
        return index

    for first, second in combinations(range(len(copper)), 2):
        if copper[first].touches(copper[second]):
            parent[root(first)] = root(second)
    groups: dict[int, set[int]] = {}
    for index in range(len(copper)):
        groups.setdefault(root(index), set()).add(index)
    return list(groups.values())


def net_faults(board: Board) -> list[str]:
    """Nets in pieces, nets that are joined, and pins that no net names; empty for a good board."""
    faults = []
    net_of = {pin: net for net, pins in board.nets.items() for pin in pins}
    reached: dict[str, int] = {}
    for island in islands(board):
        pins = [(board.pads[i].component, board.pads[i].pin) for i in island if i < len(board.pads)]
        nets = {net_of.get(pin, f"no net at {pin[0]}.{pin[1]}") for pin in pins}
        if len(nets) != 1:
            faults.append("copper joins " + (" and ".join(sorted(nets)) or "nothing"))
        for net in nets:
            reached[net] = reached.get(net, 0) + 1
    faults += [f"{net} is in {count} pieces" for net, count in reached.items() if count > 1]
    placed = {(pad.component, pad.pin) for pad in board.pads}
    faults += [f"{c}.{p} has no pad" for c, p in sorted(net_of.keys() - placed)]
    return faults


def smallest_gap(board: Board) -> float:
    """Smallest distance between two islands, in mm."""
    copper = [pad.copper for pad in board.pads] + list(board.tracks)
    return min(
        copper[a].distance(copper[b])
        for first, second in combinations(islands(board), 2)
        for a in first
        for b in second
    )


def check_electronics(design: Wedge, boards: list[Board]) -> list[Result]:
    """Netlist and gaps of every board, current and heat of every resistor."""
    results = []
    for board in boards:
        faults = net_faults(board)
        results += [
            Result("netlist", board.name, len(faults), "faults", 0, "at most",
                   "; ".join(faults) or f"{len(board.pads)} pads, {len(board.nets)} nets"),
            Result("copper", board.name, smallest_gap(board), "mm", SMALLEST_GAP, "at least",
                   "between nets"),
        ]  # fmt: skip
    asked = design.wiring.led_current_ma
    for ballast in ballasts(design):
        results += [
            Result("resistor", f"{ballast.color} {ballast.label}", ballast.power_w, "W", RATED_W,
                   "at most", f"{ballast.total_current_ma:.1f} mA for {ballast.leds} LEDs"),
            Result("resistor", f"{ballast.color} LED current", ballast.led_current_ma, "mA",
                   asked + 1e-9, "at most", f"designed for {asked:g} mA"),
        ]  # fmt: skip
    return results
