# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the guide and the bill say of a design of one's own can be typed, set, cut and reached."""

import re
import shlex
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bom.bill import make_bill, read_parts
from bom.fit import parts_for
from cad.assembly import assembly_of
from cad.build import Model
from cad.counts import bill_counts
from cad.electronics.boards import boards
from cad.layout import Layout
from cad.optics import pad_center_x_mm, trace
from cad.parts import bought
from cad.parts.jigs import caliper_gap_mm
from cad.refusals import refuse_unbuildable
from cad.wires import ribbon_length_mm
from sensor.design import FINGER, STANDARD, Wedge
from sensor.design_file import load_design
from tests.cad.test_assembly import guide_of
from tests.cad.test_designs import changed

LONG = changed(changed(STANDARD, "housing", case_length_mm=120.0), "compartment", length_mm=70.0)
TALL = changed(changed(FINGER, "housing", roof_z_mm=45.0), "compartment", height_mm=12.5)


def fitted(press_mm: float, name: str = "mine") -> Wedge:
    return replace(changed(FINGER, "printing", press_clearance_mm=press_mm), name=name)


def snippet(guide: str) -> str:
    (found,) = re.findall(r"```toml\n(.*?)```", guide, re.DOTALL)
    return str(found)


@pytest.mark.parametrize("press", [0.0, 0.02, 0.05, 0.1, 0.15, 0.18, 0.2])
def test_the_guide_of_an_own_design_sets_a_fit_that_can_be_set_in_the_file_it_names(
    press: float, finger: Model, tmp_path: Path
) -> None:
    guide = guide_of(finger, fitted(press))
    (name,) = re.findall(r"set this in your design file, `(.+?)`:", guide)
    path = tmp_path / name
    path.write_text(f'base = "finger"\n\n{snippet(guide)}', encoding="utf-8")
    found = load_design(str(path))
    assert found.name == "mine"
    looser = found.printing.press_clearance_mm
    assert looser == pytest.approx(min(press + 0.05, 0.2))
    # Every fit that the comment names is one that a design may have, or is said not to be.
    comment = snippet(guide).partition("#")[2]
    tighter, loosest = (re.findall(rf"{dots},? (-?[\d.]+)(.*?)(?:;|$)", comment, re.MULTILINE)
                        for dots in ("one dot", "three dots"))  # fmt: skip
    for said, value in ((tighter, press - 0.05), (loosest, press + 0.05)):
        can = 0 <= round(value, 9) <= 0.2
        assert any("cannot be set" in words for _, words in said) != can
        assert all(float(number) == pytest.approx(value) for number, _ in said)
    assert "mine.toml" in guide and "write a design file" not in guide


def test_the_guide_of_a_known_design_shows_a_whole_file(
    finger: Model, standard: Model, tmp_path: Path
) -> None:
    for built in (finger, standard):
        guide = guide_of(built)
        (name,) = re.findall(r"write a design file, such as `(.+?)`:", guide)
        path = tmp_path / name
        path.write_text(snippet(guide), encoding="utf-8")
        refuse_unbuildable(load_design(str(path)))
        assert f"`wedge fabricate --design {name}`" in guide


@pytest.mark.parametrize("name", ["mine", "two words", "it's", "a & b", "$HOME", "50 %"])
def test_commands_of_the_guide_name_the_design_s_file_whatever_it_is_called(
    name: str, finger: Model
) -> None:
    guide = " ".join(guide_of(finger, fitted(0.1, name)).split())
    typed = [shlex.split(command) for command in re.findall(r"`(wedge [^`]*--design[^`]*)`", guide)]
    assert {words[1] for words in typed} == {"fabricate", "capture", "calibrate"}
    for words in typed:
        assert words[words.index("--design") + 1] == f"{name}.toml"


@pytest.mark.parametrize(("width", "height"), [(640, 480), (480, 640), (500, 500)])
def test_the_side_of_the_picture_along_the_finger_is_the_optics(
    width: int, height: int, finger: Model
) -> None:
    design = replace(changed(FINGER, "camera", width_px=width, height_px=height), name="own")
    x = pad_center_x_mm(design)
    here, there = trace(design, np.array([[x, 0.0], [x + 1.0, 0.0]])).pixels
    along = int(np.argmax(np.abs(there - here)))
    sizes = (width, height)
    word = {1: "long", 0: "horizontal", -1: "short"}[int(np.sign(sizes[along] - sizes[1 - along]))]
    guide = " ".join(guide_of(finger, design).split())
    assert (
        re.findall(r"(?:along|picture's) (?:the )?(?:picture's )?(\w+) side\b", guide) == [word] * 3
    )


def pads() -> list[Wedge]:
    """Pads of all sizes on acrylic that carries them."""
    random = np.random.default_rng(0)
    sizes = [(5.0, 4.0), (8.0, 4.6), *np.round(random.uniform([5, 4], [34, 25], (12, 2)), 2)]
    return [changed(STANDARD, "gel", pad_length_mm=float(x), pad_width_mm=float(y))
            for x, y in sizes]  # fmt: skip


def test_the_caliper_s_jaws_find_room_on_the_pad(finger: Model) -> None:
    assert caliper_gap_mm(STANDARD) == caliper_gap_mm(FINGER) == 5
    for design in pads():
        gap = caliper_gap_mm(design)
        assert gap * 2 == int(gap * 2) and 2 <= gap <= 5
        # 1 mm of each jaw at least lies in the jig's slots, which are as long as the pad.
        assert (min(design.pad_size_mm) - gap) / 2 >= 1
        guide = " ".join(guide_of(finger, replace(design, name="own")).split())
        assert f"--caliper-mm {gap:g} --out" in guide and f"set a caliper to {gap:g} mm" in guide


def counted(design: Wedge) -> dict[str, float]:
    parts: list[dict[str, Any]] = [
        {"id": "gel", "volume_mm3": bought.gel(design).Volume(), "quantity": 1}
    ]
    return bill_counts(design, assembly_of(design).counts(), boards(design), parts)


@pytest.mark.parametrize("design", [STANDARD, FINGER, LONG, TALL], ids=["s", "f", "long", "tall"])
def test_wires_and_ribbon_reach_from_end_to_end(design: Wedge) -> None:
    place = Layout(design)
    arrays = [bought.led_array(design, row.color).BoundingBox() for row in place.light_rows()]
    board = bought.resistor_board(design).BoundingBox()
    tail, far = np.array([max(box.xmax for box in arrays), place.outer_half, place.bottom]), [
        board.xmax, 0.0, board.zmin]  # fmt: skip
    each_m = (counted(design)["wire"] - 2 * 0.12) / (2 * len(arrays))
    straight, square = np.linalg.norm(far - tail), np.abs(far - tail).sum()
    assert straight + 49 < 1000 * each_m < max(120.1, square + 61)
    if design in (STANDARD, FINGER):
        assert each_m == pytest.approx(0.12)
    head, adapter = bought.camera(design).BoundingBox(), bought.csi_hdmi_board(design).BoundingBox()
    start = np.array([head.xmax, design.camera.pupil_z_mm])
    end = np.array([adapter.xmin + bought.SOCKET[0], adapter.zmin + bought.BOARD[2]])
    spare = ribbon_length_mm(place) - np.abs(end - start).sum()
    assert np.linalg.norm(end - start) + 19 < ribbon_length_mm(place) and -5 < spare < 40


def test_silicone_is_bought_by_the_gel_s_volume() -> None:
    thick = changed(changed(STANDARD, "gel", curved=False, thickness_mm=10.0), "acrylic",
                    thickness_mm=4.5)  # fmt: skip
    for design in (STANDARD, FINGER, thick):
        need = bought.gel(design).Volume() / 1000
        (line,) = make_bill({"gel": counted(design)["gel"]}, parts_for(design, read_parts()))
        assert need * 1.5 < line.quantity < need * 2 + 0.1 and line.part.unit == "ml"
        assert line.packs(1) == 1
        assert 100 * (line.packs(10) - 1) < 10 * line.quantity <= 100 * line.packs(10)
        assert (line.packs(10) > 1) == (design is thick)
