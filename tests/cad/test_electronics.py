# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Resistors by Ohm's law, copper by its geometry, board files by another reader."""

import itertools
import math
import warnings
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bom.bill import make_bill, read_parts
from cad.electronics.boards import Board, Rectangle, boards
from cad.electronics.files import board_files, board_note
from cad.electronics.netlist import check_electronics, islands, net_faults, smallest_gap
from cad.electronics.resistors import E24, RATED_W, ballasts, next_e24
from cad.electronics.silkscreen import MASK_MARGIN, STROKE, printed_lines
from cad.electronics.wiring import ARRAY_WORDS, wiring_svg
from cad.strokes import strokes, width_of
from sensor.design import FINGER, STANDARD, Wedge

BOTH = pytest.mark.parametrize("design", [STANDARD, FINGER], ids=lambda design: design.name)


@given(st.floats(0.5, 1e5))
def test_e24_is_the_next_larger_of_the_series(ohm: float) -> None:
    value = next_e24(ohm)
    widest = 15 / 13  # the widest step of the series
    assert ohm * (1 - 1e-8) <= value <= ohm * widest * (1 + 1e-8)
    mantissa = value / 10 ** (math.floor(math.log10(value) + 1e-9) - 1)
    assert min(abs(mantissa - e) for e in E24) < 1e-6
    assert next_e24(value) == value


@given(st.floats(1.0, 9e4))
def test_a_resistors_label_is_its_value_and_is_on_the_bill(ohm: float) -> None:
    ballast = replace(ballasts(STANDARD)[0], ohm=next_e24(ohm))
    unit = "K" if "K" in ballast.label else "R"
    value = float(ballast.label.replace(unit, ".")) * (1000 if unit == "K" else 1)
    assert value == pytest.approx(ballast.ohm)
    assert len(ballast.label.rstrip("0")) <= 4
    (line,) = make_bill({f"resistor_{ballast.label}": 1}, read_parts())
    assert line.part.number == f"RC1206FR-07{ballast.label}L"


@pytest.mark.parametrize(
    ("ohm", "code"),
    [(1, "1R"), (1.5, "1R5"), (2, "2R"), (9.1, "9R1"), (56, "56R"), (1000, "1K"), (1200, "1K2")],
)
def test_a_resistors_number_is_written_as_its_data_sheet_has_it(ohm: float, code: str) -> None:
    # Yageo's RC1206: R or K stands for the point, and a last zero after it is left out.
    assert replace(ballasts(STANDARD)[0], ohm=ohm).label == code


@BOTH
def test_currents_obey_ohm_and_stay_below_what_was_asked(design: Wedge) -> None:
    for ballast in ballasts(design):
        drop = design.wiring.supply_v - ballast.forward_v
        assert ballast.total_current_ma * ballast.ohm / 1000 == pytest.approx(drop)
        assert 0.88 <= ballast.led_current_ma / design.wiring.led_current_ma <= 1 + 1e-9
        assert ballast.power_w == pytest.approx(drop**2 / ballast.ohm)


@BOTH
def test_copper_joins_each_net_and_nothing_else(design: Wedge) -> None:
    for board in boards(design):
        assert net_faults(board) == []
        assert len(islands(board)) == len(board.nets)
        assert smallest_gap(board) >= 0.15
        for copper in [pad.copper for pad in board.pads] + list(board.tracks):
            assert 0 < copper.x[0] < copper.x[1] < board.size[0]
            assert 0 < copper.y[0] < copper.y[1] < board.size[1]


def faults_with(board: Board, tracks: tuple[Rectangle, ...]) -> str:
    return "; ".join(net_faults(replace(board, tracks=tracks)))


def test_the_placement_names_the_package_that_the_design_has() -> None:
    narrow, small = (
        replace(STANDARD, lights=replace(STANDARD.lights, led_length_mm=x, led_width_mm=y))
        for x, y in ((3.5, 2.0), (1.6, 0.8))
    )
    for design, package in ((STANDARD, "3528"), (narrow, "3520"), (small, "1608")):
        for board in boards(design)[1:]:
            assert {component.package for component in board.components} == {package}


def test_a_cut_track_and_a_bridge_are_found() -> None:
    board = boards(STANDARD)[0]
    for index in range(len(board.tracks)):
        left = board.tracks[:index] + board.tracks[index + 1 :]
        assert "pieces" in faults_with(board, left) or "joins nothing" in faults_with(board, left)
    whole = Rectangle((1.0, board.size[0] - 1), (6.9, 7.1))
    assert "copper joins" in faults_with(board, (*board.tracks, whole))
    assert "J1.1 has no pad" in net_faults(replace(board, pads=board.pads[1:]))


def refused(design: Wedge, made: list[Board]) -> list[str]:
    return [f"{r.check} {r.subject}" for r in check_electronics(design, made) if not r.passed]


def test_a_board_with_any_fault_fails_its_check() -> None:
    made = boards(STANDARD)
    assert refused(STANDARD, made) == []
    board = made[0]
    alone = Rectangle((0.3, 0.5), (14.2, 14.5))
    assert faults_with(board, (*board.tracks, alone)) == "copper joins nothing"
    for tracks in (board.tracks[1:], (*board.tracks, alone)):
        broken = replace(board, tracks=tracks)
        assert "netlist resistor_board" in refused(STANDARD, [broken, *made[1:]])
    hole = next(pad.copper for pad in board.pads if (pad.component, pad.pin) == ("J1", "1"))
    near = Rectangle((hole.x[1] + 0.1, hole.x[1] + 0.5), hole.y)
    tight = replace(board, tracks=(*board.tracks, near))
    assert smallest_gap(tight) == pytest.approx(0.1)
    assert "copper resistor_board" in refused(STANDARD, [tight, *made[1:]])


def test_a_resistor_that_lets_too_much_through_fails_its_check(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    hot = replace(STANDARD, wiring=replace(STANDARD.wiring, supply_v=12.0))
    assert any(ballast.power_w > RATED_W for ballast in ballasts(hot))
    assert {name.split()[0] for name in refused(hot, boards(hot))} == {"resistor"}
    small = [replace(ballast, ohm=0.9 * ballast.ohm) for ballast in ballasts(STANDARD)]
    monkeypatch.setattr("cad.electronics.netlist.ballasts", lambda _: small)
    assert "resistor blue LED current" in refused(STANDARD, [])


@BOTH
def test_a_wire_goes_through_its_hole_and_solder_around_it(design: Wedge) -> None:
    holes = [pad for board in boards(design) for pad in board.pads if pad.drill]
    assert holes
    for pad in holes:
        assert pad.drill and pad.drill >= design.wiring.wire_diameter_mm
        assert (min(pad.copper.size) - pad.drill) / 2 >= 0.3


def test_corners_are_apart_by_their_diagonal() -> None:
    assert Rectangle((0, 1), (0, 1)).distance(Rectangle((4, 5), (5, 6))) == 5


def test_the_array_fits_beside_the_acrylic() -> None:
    for design in (STANDARD, FINGER):
        for board in boards(design)[1:]:
            assert board.size[1] < design.acrylic.thickness_mm
            pitches = {
                round(b.middle[0] - a.middle[0], 6)
                for a, b in zip(board.components, board.components[1:], strict=False)
            }
            assert pitches == {design.wiring.led_pitch_mm}


def written(board: Board, out: Path) -> Path:
    """The folder of a board's layers, beside which its tables lie."""
    for name, content in board_files(board):
        (out / name).parent.mkdir(exist_ok=True)
        (out / name).write_bytes(content)
    return out / board.name


@BOTH
def test_another_reader_takes_each_board_s_folder_as_a_whole(design: Wedge, tmp_path: Path) -> None:
    gerbonara = pytest.importorskip("gerbonara")
    for board in boards(design):
        folder = written(board, tmp_path)
        stack = gerbonara.LayerStack.open(folder)
        uses = {"copper", "mask", "silk", "paste"}
        assert {use for side, use in stack.graphic_layers if side == "top"} == uses
        assert ("mechanical", "outline") in stack.graphic_layers
        assert bool([*stack.drill_layers]) is any(pad.drill for pad in board.pads)
        assert {path.name for path in tmp_path.glob("*.csv")} >= {
            f"{board.name}-placement.csv", f"{board.name}-bill.csv"
        }  # fmt: skip


@pytest.mark.parametrize("led_length_mm", [3.5, 2.4, 2.0])
def test_print_stays_off_the_solder_and_on_the_board(led_length_mm: float) -> None:
    lights = replace(STANDARD.lights, led_length_mm=led_length_mm)
    found = boards(replace(STANDARD, lights=lights))
    found += [
        shifted(board, share * board.size[0] * along, share * board.size[1] * (1 - along))
        for board in found
        for share in (-0.5, 0.5)
        for along in (0, 1)
    ]
    for board in [*found, *boards(FINGER)]:
        opened = [pad.copper.grown(MASK_MARGIN) for pad in board.pads]
        for line in printed_lines(board):
            for (x0, y0), (x1, y1) in itertools.pairwise(line):
                for part in np.linspace(0, 1, 20):
                    x, y = x0 + part * (x1 - x0), y0 + part * (y1 - y0)
                    dot = Rectangle((x, x), (y, y))
                    assert min(dot.distance(pad) for pad in opened) > STROKE / 2 - 1e-9
                    for at, side in zip((x, y), board.size, strict=True):
                        assert STROKE / 2 < at < side - STROKE / 2


def shifted(board: Board, dx: float, dy: float) -> Board:
    """The same board, its parts moved on it."""

    def moved(copper: Rectangle) -> Rectangle:
        (x0, x1), (y0, y1) = copper.x, copper.y
        return Rectangle((x0 + dx, x1 + dx), (y0 + dy, y1 + dy))

    pads = (replace(pad, copper=moved(pad.copper)) for pad in board.pads)
    parts = (replace(x, middle=(x.middle[0] + dx, x.middle[1] + dy)) for x in board.components)
    return replace(board, pads=tuple(pads), components=tuple(parts))


def places_of(board: Board, letter: str) -> list[np.ndarray]:
    """The middles of a letter's prints."""
    lines, wanted = printed_lines(board), strokes(letter, (0, 0), 1.0)
    found = []
    for start in range(len(lines)):
        some = lines[start : start + len(wanted)]
        if [len(line) for line in some] == [len(line) for line in wanted]:
            corner = np.subtract(some[0][0], wanted[0][0])
            same = zip(some, wanted, strict=True)
            if all(np.allclose(line - corner, stroke) for line, stroke in same):
                found.append(corner + np.array((width_of(letter, 1.0) / 2, 0.5)))
    return found


@BOTH
def test_letters_stand_beside_the_pads_of_their_nets(design: Wedge) -> None:
    resistors, *arrays = boards(design)
    for board in arrays:
        for letter, count in (("K", len(board.components) + 1), ("A", 1)):
            places = places_of(board, letter)
            assert len(places) == count
            for x, y in places:  # the next pad toward the tail
                row = [pad for pad in board.pads if pad.copper.y[0] < y < pad.copper.y[1]]
                after = [pad for pad in row if pad.copper.x[0] > x]
                assert min(after, key=lambda pad: pad.copper.x[0]).pin == letter
    net_of = {pin: net for net, pins in resistors.nets.items() for pin in pins}
    holes = [pad for pad in resistors.pads if pad.drill]
    (plus,) = places_of(resistors, "+")
    column = [at for at in places_of(resistors, "-") if np.isclose(at[0], plus[0])]
    (minus,) = (at for at in column if not np.isclose(at[1], plus[1]))
    cathodes = places_of(resistors, "K")
    assert len(cathodes) == len(arrays)
    for places, net in (([plus], "supply"), ([minus, *cathodes], "GND")):
        for at in places:
            near = min(holes, key=lambda pad: math.dist(pad.copper.middle, at))
            assert net_of[near.component, near.pin] == net
    middles = {(pad.component, pad.pin): pad.copper.middle for pad in resistors.pads}
    for part in resistors.components:
        (at,) = places_of(resistors, part.reference)
        assert min(resistors.components, key=lambda x: math.dist(x.middle, at)) is part
        # A 1206 is 1.6 mm wide: its name is not under it.
        assert at[0] - width_of(part.reference, 1.0) / 2 > part.middle[0] + 0.8
    for board in arrays:
        color = board.components[0].value
        ((x, _),) = places_of(resistors, color)
        (anode,) = (pin for pin in resistors.nets[f"{color}_A"] if pin[0] == "J2")
        cathode = ("J2", str(int(anode[1]) + 1))
        assert x == pytest.approx((middles[anode][0] + middles[cathode][0]) / 2)


@BOTH
def test_print_says_where_cathodes_are(design: Wedge) -> None:
    for board in boards(design)[1:]:
        bars = [line for line in printed_lines(board) if np.ptp([y for _, y in line]) == 0]
        pads = {(pad.component, pad.pin): pad.copper for pad in board.pads}
        for led in board.components:
            cathode = pads[led.reference, "K"]
            beside = [y for (x0, y), (x1, _) in bars if (x0, x1) == cathode.x]
            assert min(beside) < cathode.y[0] and max(beside) > cathode.y[1]
            assert cathode.middle[0] > pads[led.reference, "A"].middle[0]
        # Two bars and the K (of two lines) of each LED; A and K (two lines each) at the tail.
        assert len(printed_lines(board)) == 4 * len(board.components) + 4


@BOTH
def test_the_placement_turns_each_part_from_pin_1_on_the_left(design: Wedge) -> None:
    """IPC-7351: pin 1, a diode's cathode, is on the left of the footprint that is not turned."""
    for board in boards(design):
        tables = {name: content.decode() for name, content in board_files(board)}
        rows = tables[f"{board.name}-placement.csv"].splitlines()[1:]
        pads = {(pad.component, pad.pin): pad.copper.middle for pad in board.pads}
        for name, *_, turn, _ in (row.split(",") for row in rows):
            first, last = ("K", "A") if (name, "K") in pads else ("1", "2")
            (x1, y1), (x2, y2) = pads[name, first], pads[name, last]
            left = math.degrees(math.atan2(y1 - y2, x1 - x2)) - 180
            assert (float(turn) - left) % 360 == pytest.approx(0, abs=1e-6)


@BOTH
def test_another_reader_finds_the_same_copper_and_holes(design: Wedge, tmp_path: Path) -> None:
    gerbonara = pytest.importorskip("gerbonara")
    for board in boards(design):
        folder = written(board, tmp_path)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            copper = gerbonara.GerberFile.open(folder / f"{board.name}-F_Cu.gtl")
            edge = gerbonara.GerberFile.open(folder / f"{board.name}-Edge_Cuts.gm1")
        found = np.array([(o.x, o.y, o.aperture.w, o.aperture.h) for o in copper.objects])
        drawn = [pad.copper for pad in board.pads] + list(board.tracks)
        wanted = np.array([(*copper.middle, *copper.size) for copper in drawn])
        nearest = np.abs(found[:, None] - wanted[None]).max(axis=-1)
        assert found.shape == wanted.shape
        assert nearest.min(axis=0).max() < 2e-6
        assert nearest.min(axis=1).max() < 2e-6
        (x0, y0), (x1, y1) = edge.bounding_box()
        assert (x1 - x0 - 0.1, y1 - y0 - 0.1) == pytest.approx(board.size, abs=1e-5)
        holes = [pad for pad in board.pads if pad.drill]
        if holes:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                drill = gerbonara.ExcellonFile.open(folder / f"{board.name}-PTH.drl")
            drilled = sorted(
                (round(o.x, 3), round(o.y, 3), o.aperture.diameter) for o in drill.objects
            )
            assert drilled == sorted(
                (round(p.copper.middle[0], 3), round(p.copper.middle[1], 3), p.drill) for p in holes
            )


@BOTH
def test_tables_and_layers_hold_every_part_once(design: Wedge) -> None:
    for board in boards(design):
        files = {
            name.partition(f"{board.name}-")[2]: content.decode()
            for name, content in board_files(board)
        }
        _, *rows = (line.split(",") for line in files["placement.csv"].splitlines())
        places = {name: (x, y) for name, _, _, x, y, *_ in rows}
        assert places == {
            part.reference: tuple(f"{at:.3f}mm" for at in part.middle) for part in board.components
        }
        _, *kinds = files["bill.csv"].splitlines()
        assert sum(int(kind.rsplit(",", 1)[1]) for kind in kinds) == len(board.components)
        holes = sum(pad.drill is not None for pad in board.pads)
        for layer, count in (
            ("F_Mask.gts", len(board.pads)),
            ("B_Mask.gbs", holes),
            ("F_Paste.gtp", len(board.pads) - holes),
        ):
            assert files[layer].count("D03*") == count
            assert ("Negative" in files[layer]) is ("Mask" in layer)
            assert f",{'Top' if layer[0] == 'F' else 'Bot'}*" in files[layer]
        assert files["F_Silkscreen.gto"].count("D02*") == len(printed_lines(board))
        assert ("B_Cu.gbl" in files) is (" 2 copper layers" in board_note(board))
        assert files.get("B_Cu.gbl", "").count("D03*") == holes


@BOTH
def test_the_words_of_the_wiring_picture_hold_on_the_boards(design: Wedge) -> None:
    resistors, *arrays = boards(design)
    middle = {(pad.component, pad.pin): pad.copper.middle for pad in resistors.pads}
    assert middle["J1", "1"][1] < middle["J1", "2"][1] < resistors.size[1] / 2
    assert middle["J1", "1"][0] > max(x for (part, _), (x, _) in middle.items() if part == "J2")
    assert middle["J2", "1"] == min(place for (part, _), place in middle.items() if part == "J2")
    assert middle["J2", "1"][1] > max(y for (part, _), (_, y) in middle.items() if part != "J2")
    for board in arrays:
        tail = {pad.pin: pad.copper.middle for pad in board.pads if pad.component == "J1"}
        assert tail["A"][1] > tail["K"][1]
        assert min(x for x, _ in tail.values()) > max(c.middle[0] for c in board.components)
    assert "cathode" in ARRAY_WORDS and ARRAY_WORDS.endswith("toward the tail.")


def test_the_wiring_picture_names_every_resistor() -> None:
    text = wiring_svg(STANDARD).decode()
    assert all(f" {ballast.label}<" in text for ballast in ballasts(STANDARD))
    found = ballasts(STANDARD)
    for index, ballast in enumerate(found):
        side = "base" if ballast.color == "green" else f"{ballast.color} side"
        assert f"{side}: {ballast.leds} LEDs" in text
        each, whole = ballast.led_current_ma, ballast.total_current_ma
        assert f"{each:.1f} mA each, {whole:.0f} mA in all" in text
        for pin, end in enumerate(("anode", "cathode"), start=2 * index + 1):
            assert f">J2.{pin}  {end}<" in text
    assert text.count('width="11" height="9"') == sum(ballast.leds for ballast in found)
    board = boards(STANDARD)[0]
    for net, said in (("supply", "3.3 V to"), ("GND", "GND to")):
        (pin,) = (pin for part, pin in board.nets[net] if part == "J1")
        assert f">{said} J1.{pin}<" in text


def test_many_leds_stay_in_their_box_of_the_wiring_picture() -> None:
    lights = replace(STANDARD.lights, led_length_mm=1.0, red_side_leds=30)
    many = replace(STANDARD, lights=lights)
    drawn = ElementTree.fromstring(wiring_svg(many)).iter("{http://www.w3.org/2000/svg}rect")
    boxes = [(int(rect.get("x", 0)), int(rect.get("width", 0))) for rect in drawn]
    (right,) = {x + wide for x, wide in boxes if x == 560}
    assert max(x + wide for x, wide in boxes if wide == 11) < right
