# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""One graph drives bill, guide, insertion and pictures: it must be whole and in order."""

import math
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from bom.bill import read_parts
from bom.fit import parts_for
from cad.build import Model, manifest_of, model
from cad.exports.drawing import drawing_of
from cad.exports.page import guide_html, page_html
from cad.guide import guide_text
from cad.guide_words import design_words
from cad.mesh import DEFLECTION_MM
from cad.optics import pad_grid, trace
from cad.parts.case import MARK_DEPTH
from cad.parts.coupons import camera_coupon
from cad.parts.jigs import BALL_RADIUS, ball_jig
from cad.result import Result
from cad.tables import fastener
from sensor.design import FINGER, STANDARD, Channel, Wedge
from simulation.scene import sides
from tests.cad.conftest import ROOT, names_of


def guide_of(built: Model, design: Wedge | None = None, failed: Sequence[str] = ()) -> str:
    manifest = manifest_of(built, [])
    order = [("a ball", "1 piece")]
    design, names = design or built.design, names_of(built)
    return guide_text(design, built.assembly, built.boards, manifest, names, order, failed)


def step_of(text: str, title: str) -> str:
    """What the guide says of a step, by the words that its title begins with."""
    (said,) = re.findall(rf"### Step \d+: {title}(.*?)(?=\n##|\Z)", text, re.DOTALL)
    return said


def screw_holes(design: Wedge) -> list[float]:
    """Diameters of the round holes of the camera's coupon, without its dots."""
    faces = camera_coupon(design).faces("%CYLINDER").Faces()
    return sorted(d for d in (round(face.BoundingBox().ylen, 3) for face in faces) if d > 1)


def side_of(built: Model, color: str) -> np.ndarray:
    """From the acrylic's middle to an array's, in the body's frame."""
    low, high = built.body_meshes[f"{color}_leds"].bounds
    start, end = built.body_meshes["acrylic"].bounds
    return np.asarray((low + high - start - end) / 2)


def test_every_body_goes_in_once_and_ends_in_the_sensor(finger: Model, standard: Model) -> None:
    for built in (finger, standard):
        assembly = built.assembly
        placed = Counter(name for step in assembly.steps for name in step.bodies)
        assert placed == Counter(list(assembly.bodies)) == Counter(list(built.bodies))
        last = assembly.steps[-1]
        in_sensor = {*assembly.group_before(last, "sensor"), *assembly.moving(last)}
        assert in_sensor == set(assembly.bodies)


def test_a_step_moves_what_stands_nowhere_yet(finger: Model) -> None:
    for step in finger.assembly.steps:
        assert not set(finger.assembly.moving(step)) & set(finger.assembly.standing(step))
        assert finger.assembly.moving(step)


def test_lights_follow_the_design(standard: Model) -> None:
    lights = standard.design.lights
    counts = {
        board.name: sum(c.part.startswith("led_") for c in board.components)
        for board in standard.boards
    }
    assert counts == {
        "resistor_board": 0,
        "led_array_red": lights.red_side_leds,
        "led_array_blue": lights.blue_side_leds,
        "led_array_green": lights.green_base_leds,
    }
    bill = manifest_of(standard, [])["bill"]
    for color in ("red", "green", "blue"):
        assert bill[f"led_{color}"] == counts[f"led_array_{color}"]


def test_the_guide_tells_every_step_and_counts_every_body(finger: Model) -> None:
    text = guide_of(finger)
    taken: Counter[str] = Counter()
    called = dict[str, str]()
    for line in text.splitlines():
        if re.match(r"Take \d", line):
            for item in line.removeprefix("Take ").removesuffix(".").split("; "):
                found = re.fullmatch(r"(\d+) × (.+) \(`(.+)`\)", item)
                assert found, item
                taken[found[3]] += int(found[1])
                called[found[3]] = found[2]
    assert taken == Counter(finger.assembly.counts())
    assert called["case"] == "Case" and called["mirror"] == "Mirror, cut"
    assert called["csi_hdmi_board"] == "CSI-to-HDMI adapter, a pair of boards"
    assert called["screw_m2x6"] == "Screw ISO 4762 M2x6, steel"
    assert not [name for name in called.values() if "_" in name]
    assert "| a ball | 1 piece |" in text
    assert text.count("\n### Step ") == len(finger.assembly.steps)
    assert finger.design.sha256[:8] in text


def test_the_guide_sends_red_and_blue_to_the_sides_where_they_are(finger: Model) -> None:
    """From the tip one looks along x; with the gel down z is up, and right is their product."""
    right = np.cross([1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
    text = guide_of(finger)
    for color in ("red", "blue"):
        said = re.search(rf"{color}(?: goes)? to the (left|right)", text, re.IGNORECASE)
        assert said and said[1] == ("right" if side_of(finger, color) @ right > 0 else "left")


@pytest.mark.parametrize("name", ["standard", "finger"])
def test_lights_sit_where_the_gel_frame_and_the_twin_have_them(
    name: str, request: pytest.FixtureRequest
) -> None:
    """The gel frame's x runs to the tip and its z out of the gel: two signs of the body's turn."""
    built: Model = request.getfixturevalue(name)
    channels: dict[str, Channel] = {"red": "R", "green": "G", "blue": "B"}
    in_the_twin = {side.color: np.array(side.center_mm) for side in sides(built.design)}
    for color, channel in channels.items():
        offset = side_of(built, color)[:2] * [-1.0, 1.0]
        side = np.where(np.abs(offset) == np.abs(offset).max(), np.sign(offset), 0.0)
        azimuth = math.radians(built.design.lights.azimuths_deg[channel])
        assert side == pytest.approx([math.cos(azimuth), math.sin(azimuth)], abs=1e-9)
        twin = in_the_twin[channel]
        assert side == pytest.approx(twin / np.linalg.norm(twin), abs=1e-9)


def test_the_guide_says_the_voltage_of_the_design(finger: Model) -> None:
    five = replace(FINGER, wiring=replace(FINGER.wiring, supply_v=5.0))
    assert "supply wires to 3.3 V and" in guide_of(finger)
    assert "supply wires to 5 V of a supply of your own" in guide_of(finger, five)
    assert "own signals and the lights' supply of 3.3 V, not an HDMI" in guide_of(finger)
    assert "own signals, not an HDMI picture" in guide_of(finger, five)
    assert "Connect the Pi's power supply. All" in guide_of(finger)
    assert "Connect the Pi's power supply, and the one for the lights." in guide_of(finger, five)
    bill = manifest_of(replace(finger, design=five), [])["bill"]
    assert bill["light_supply"] == 1 and "light_supply" not in manifest_of(finger, [])["bill"]
    (supply,) = [part for part in parts_for(five, read_parts()) if part.id == "light_supply"]
    assert "supply of 5 V" in supply.name


def test_the_guide_has_measured_what_may_not_fit_before_anything_is_printed(finger: Model) -> None:
    said = " ".join(guide_of(finger).partition("## 1.")[0].split())
    posts = r"two (\d+) mm apart in front, two (\d+) mm .* and (\d+) mm from row"
    one, two, three = map(float, re.findall(posts, said)[0])
    room = float(re.findall(r"has room for ([\d.]+) mm", said)[0])
    holes = [
        edge.arcCenter()
        for edge in finger.bodies["csi_hdmi_board"].Edges()
        if edge.geomType() == "CIRCLE"
    ]
    front, back = min(hole.x for hole in holes), max(hole.x for hole in holes)
    assert back - front == pytest.approx(three)
    for row, apart in ((front, one), (back, two)):
        across = [hole.y for hole in holes if abs(hole.x - row) < 1e-6]
        assert max(across) - min(across) == pytest.approx(apart)
    array = finger.bodies["red_leds"].BoundingBox(tolerance=1e-4)
    assert 0 < room - array.ylen < 0.2  # for the tape


def test_the_guide_says_how_many_contacts_ribbon_and_socket_have(finger: Model) -> None:
    said = " ".join(guide_of(finger).partition("## 1.")[0].split())
    assert "22 contacts, 0.5 mm apart" in said and "B0091 takes 15" in said


def test_whatever_says_how_wide_a_sensor_is_says_how_large_all_its_bodies_are(
    finger: Model, standard: Model
) -> None:
    page = (ROOT / "docs" / "howto" / "build.md").read_text()
    for built in (finger, standard):
        manifest, width = manifest_of(built, []), built.design.outer_width_mm
        corners = np.array([mesh.bounds for mesh in built.body_meshes.values()])
        size = corners[:, 1].max(axis=0) - corners[:, 0].min(axis=0)
        assert manifest["bounding_box_mm"] == pytest.approx(size, abs=DEFLECTION_MM)
        words = " x ".join(f"{float(f'{side:.1f}'):g}" for side in size)
        assert f"is {width:g} mm wide" in guide_of(built) and f"{words} mm" in guide_of(built)
        shown = page_html(built.design, manifest, names_of(built), [], [])
        assert f"is {width:g} mm wide" in shown and f"{words} mm" in shown
        assert words in drawing_of(built.design, built.body_meshes).decode()
        assert f"{width:g} mm wide, overall {words} mm" in page


def test_silicone_is_mixed_when_the_paint_it_is_poured_onto_has_set(finger: Model) -> None:
    said = guide_of(finger).partition("## 5.")[2].partition("## 6.")[0]
    acts = ("Sand the cavity", "let it set", "Mix the silicone", "degas", "Fill the cavity")
    places = [said.index(act) for act in acts]
    assert places == sorted(places)


def test_no_solvent_comes_near_the_acrylic_s_edges(finger: Model) -> None:
    said = step_of(guide_of(finger), "Glue the gel to the acrylic")
    assert "dish soap" in said and "no alcohol or other solvent" in said


def test_the_guide_of_fewer_lights_and_films_names_no_others() -> None:
    lights = replace(
        FINGER.lights, blue_side_leds=0, green_base_leds=0, gray_filter_transmission=1.0
    )
    text = guide_of(model(replace(FINGER, lights=lights)))
    _, rest = text.split("## 1.", 1)
    assert not re.search(r"\b(blue|green|gray filter)\b", rest, re.IGNORECASE)
    assert "red goes to the left; none goes to the tip" in rest
    assert "Never put diffuser into it" in rest and "red from one side, none" in rest


def test_without_films_the_guide_warns_of_none(finger: Model) -> None:
    bare = replace(
        FINGER.lights, film_thickness_mm=0.0, gray_filter_transmission=1.0, diffuser=False
    )
    words = design_words(replace(FINGER, lights=bare), finger.assembly)
    assert "film" not in words["film_warning"] + words["film_fault"]
    assert "film" in design_words(FINGER, finger.assembly)["film_fault"]


def test_the_guide_has_the_camera_focused_where_the_skin_will_be(finger: Model) -> None:
    text = guide_of(finger)
    said = step_of(text, "Press the camera into its holder")
    (focus,) = re.findall(r"small print (\d+) mm in front", said)
    assert said.index("small print") < said.index("press the head in")
    # On the axis the light goes to the mirror, down through glass and gel, which look thinner.
    paths = trace(FINGER, pad_grid(FINGER, 3))
    middle = float(paths.air_mm[4])
    apparent = middle + FINGER.acrylic.thickness_mm / 1.49 + FINGER.gel.thickness_mm / 1.41
    assert float(focus) == pytest.approx(apparent, abs=1.5)
    (fault,) = re.findall(r"\| the picture is blurred \|(.*)\|", text)
    numbers = [int(number) for number in re.findall(r"\d+", fault)]
    ids = [finger.assembly.steps[number - 1].id for number in numbers]
    assert ids == ["cover_screws", "resistor_board", "rear_screws", "camera_into_case", "camera"]


def test_wires_and_ribbon_are_joined_before_the_board_that_covers_them(finger: Model) -> None:
    said = step_of(guide_of(finger), "Solder, plug in").lower()
    acts = ("solder the wires", "plug the ribbon", "wrap", "lay it")
    places = [said.index(act) for act in acts]
    assert places == sorted(places)


def test_guide_and_bill_have_the_gripper_s_screws_and_the_pins_length(standard: Model) -> None:
    text, bill = guide_of(standard), manifest_of(standard, [])["bill"]
    for part, screw in (("adapter_wsg50", "M4"), ("adapter_lab", "M3")):
        size = fastener(screw)
        faces = standard.printed[part].faces("%CYLINDER").Faces()
        holes = [f for f in faces if abs(f.BoundingBox().ylen - size.clearance_mm) < 1e-3]
        said = step_of(text, "Screw the gripper adapter down")
        (count, left) = re.findall(rf"(\d) × {screw}x8 \(([\d.]+) mm of plate", said)[0]
        assert int(count) == len(holes)
        assert {round(hole.BoundingBox().zlen, 1) for hole in holes} == {float(left)}
        if part == "adapter_wsg50":
            assert bill["screw_m4x8"] == len(holes)
    pin = round(standard.bodies["pin_1"].BoundingBox().zlen, 2)
    assert f"Cut two pins of {pin:.1f} mm" in text
    names = [part.name for part in parts_for(STANDARD, read_parts())]
    assert any(f"pins, {pin:g} mm each" in name for name in names)
    assert bill["insulating_tape"] == 1 and "insulating tape" in text


def test_the_digits_in_the_roof_are_compared_before_a_part_covers_them(
    finger: Model, standard: Model
) -> None:
    for built in (finger, standard):
        said = " ".join(step_of(guide_of(built), "Start with the printed case").split())
        assert f"{built.design.sha256[:8]}: step " in said
        (number,) = re.findall(r"step (\d+) covers them", said)
        (cover,) = built.assembly.steps[int(number) - 1].bodies
        low, high = built.body_meshes[cover].bounds[:, :2]
        floor = built.design.housing.roof_z_mm - MARK_DEPTH
        faces = built.bodies["case"].Faces()
        digits = [face.Center() for face in faces if abs(face.Center().z - floor) < 1e-6]
        assert digits
        assert all(np.all((low < (at.x, at.y)) & ((at.x, at.y) < high)) for at in digits)


def test_the_guide_names_what_sets_the_coupon_s_screw_holes(finger: Model) -> None:
    text = " ".join(guide_of(finger).split())
    (said,) = re.findall(r"The screw holes come in one size.*?\. ", text)
    asked = {
        "printing.press_clearance_mm": 0.15,
        "printing.sliding_clearance_mm": 0.1,
        "fastening.screw": "M2.5",
        "fastening.pin_diameter_mm": 1.0,
        "camera.head_size_mm": 9.0,
    }
    moves = set()
    for field, value in asked.items():
        group, name = field.split(".")
        part = replace(getattr(FINGER, group), **{name: value})
        if screw_holes(replace(FINGER, **{group: part})) != screw_holes(FINGER):
            moves.add(field)
    assert set(re.findall(r"`(\w+\.\w+)`", said)) == moves


def test_a_ball_that_its_socket_does_not_hold_is_glued(finger: Model) -> None:
    for press in (0.0, 0.05, 0.2):
        fit = replace(FINGER.printing, press_clearance_mm=press)
        rim = ball_jig(replace(FINGER, printing=fit)).faces(">Z").innerWires()[0].BoundingBox()
        assert rim.xlen > 2 * BALL_RADIUS
    said = " ".join(guide_of(finger).split())
    assert "fix the ball in its socket with a drop of glue" in said and "snaps" not in said


def test_a_folder_whose_checks_failed_says_so_at_its_top(finger: Model) -> None:
    good = manifest_of(finger, [Result("walls", "case", 1.0, "mm", 0.8, "at least")])
    bad = manifest_of(finger, [Result("walls", "case", 0.5, "mm", 0.8, "at least")])
    assert "Do not build" not in page_html(FINGER, good, names_of(finger), [], [])
    assert "Do not build" not in guide_of(finger)
    warned = page_html(FINGER, bad, names_of(finger), [], [])
    assert warned.index("1 check failed") < warned.index("wedge-view")
    assert 'id="checks"' in warned
    guide = guide_of(finger, failed=["walls case"])
    assert guide.index("1 check failed** (walls case)") < guide.index("for design ")
    assert "<blockquote>" in guide_html(guide)


def test_the_guide_of_a_flat_gel_names_no_curved_mold(finger: Model) -> None:
    flat = replace(FINGER, gel=replace(FINGER.gel, curved=False))
    assert "cavity of `mold_curved` (or `mold_flat`)" in guide_of(finger)
    assert "cavity of `mold_flat` and" in guide_of(finger, flat)


def test_the_guide_tells_the_frame_s_size_and_what_the_server_cannot_send(finger: Model) -> None:
    told = guide_of(finger).replace("\n", " ")
    assert "a frame of 640 × 480 pixels" in told
    assert "pixels only" not in told and "--design finger --out" in told
    camera = replace(FINGER.camera, width_px=800, height_px=600)
    other = replace(FINGER, name="own", camera=camera)
    told = guide_of(finger, other).replace("\n", " ")
    assert "a frame of 800 × 600 pixels" in told
    assert "pixels only" in told and "--design own.toml --out" in told
