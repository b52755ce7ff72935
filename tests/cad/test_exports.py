# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Drawing, sheets, meshes, pages and pictures, each held against what it shows."""

import io
import math
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import ezdxf
import numpy as np
import pytest
import trimesh

from bom.bill import make_bill, read_parts
from bom.fit import parts_for
from cad.assembly import assembly_of
from cad.build import Model, manifest_of
from cad.counts import bill_counts
from cad.exports.drawing import drawing_of
from cad.exports.laser import Piece, Sheet, comb_dxf, laser_files, outline, sheet_dxf, sheets
from cad.exports.page import guide_html, page_html
from cad.exports.solids import stl_of
from cad.exports.views import _section, pulled_apart
from cad.motions import straight
from cad.optics import pad_grid, trace
from cad.result import Result
from sensor.design import FINGER, STANDARD, Wedge
from tests.cad.conftest import names_of

SVG = "{http://www.w3.org/2000/svg}"
BOTH = pytest.mark.parametrize("name", ["standard", "finger"])


def groups(built: Model) -> list[list[ElementTree.Element]]:
    """What is drawn of the section, and of the face."""
    page = ElementTree.fromstring(drawing_of(built.design, built.body_meshes))
    return [list(group) for group in page.iter(f"{SVG}g")]


def numbers(text: str) -> list[float]:
    return [float(number) for number in re.findall(r"-?\d+(?:\.\d+)?", text)]


def extent(path: ElementTree.Element) -> np.ndarray:
    """Lowest and highest x and y of a closed outline."""
    points = np.array(numbers(path.get("d", ""))).reshape(-1, 2)
    return np.stack([points.min(axis=0), points.max(axis=0)])


@BOTH
def test_every_line_of_the_drawing_is_as_long_as_its_text_says(
    name: str, request: pytest.FixtureRequest
) -> None:
    built: Model = request.getfixturevalue(name)
    checked = 0
    for group in groups(built):
        lines = [item for item in group if item.get("stroke") == "#06c" or item.tag == f"{SVG}text"]
        for line, text in zip(lines[::2], lines[1::2], strict=True):
            drawn, words = line.get("d", ""), text.text or ""
            said = numbers(re.sub(r"M\d", "", words))[0]
            if "A" in drawn:
                x, y, *_, end_x, end_y = numbers(drawn)
                length = math.degrees(math.atan2(y - end_y, end_x - x))  # the page's y points down
            else:
                x, y, end = numbers(drawn)[:3]
                length = abs(end - (x if "H" in drawn else y))
            assert length == pytest.approx(said, abs=0.05), words
            checked += 1
    assert checked == 14


@BOTH
def test_thicknesses_are_drawn_beside_what_they_measure(
    name: str, request: pytest.FixtureRequest
) -> None:
    section, _ = groups(request.getfixturevalue(name))
    upright = [numbers(item.get("d", "")) for item in section if "V" in item.get("d", "")]
    farther, nearer = sorted(upright)[:2]
    acrylic, gel = (extent(section[index])[:, 1] for index in (3, 4))
    assert sorted(nearer[1:3]) == pytest.approx(acrylic.tolist(), abs=1e-2)
    assert sorted(farther[1:3]) == pytest.approx(gel.tolist(), abs=1e-2)


@BOTH
def test_the_drawing_s_bodies_stand_upright_and_the_gel_lies_on_top(
    name: str, request: pytest.FixtureRequest
) -> None:
    built: Model = request.getfixturevalue(name)
    design, (section, face) = built.design, groups(built)
    shown = [[item for item in group if item.get("fill", "none")[0] == "#"] for group in (
        section, face)]  # fmt: skip
    bodies = [[item for item in group if item.tag == f"{SVG}path"] for group in shown]
    parts = ("case", "camera_holder", "mirror", "acrylic", "gel", "camera")
    for part, path in zip(parts, bodies[0], strict=True):
        low, high = built.body_meshes[part].bounds
        cut = extent(path)
        assert cut[:, 0] == pytest.approx([low[0], high[0]], abs=0.5), part
        assert cut[:, 1] == pytest.approx([-high[2], -low[2]], abs=0.5), part
    for part, path in zip(("case", "acrylic", "gel"), bodies[1], strict=True):
        low, high = built.body_meshes[part].bounds
        assert extent(path) == pytest.approx(np.stack([low[:2], high[:2]]), abs=2e-3), part
    assert design.name in drawing_of(design, built.body_meshes).decode()


def cuts_of(content: bytes) -> list[np.ndarray]:
    space = ezdxf.read(io.StringIO(content.decode())).modelspace()
    return [np.array([(x, y) for x, y, *_ in cut]) for cut in space.query('*[layer=="CUT"]')]


@pytest.mark.parametrize("kerf", [0.0, 0.4])
def test_many_pieces_lie_side_by_side_on_a_sheet_and_none_on_another(kerf: float) -> None:
    pieces = (Piece("a", 30.0, 5.0, 9), Piece("b", 70.0, 12.0, 3))
    cuts = cuts_of(sheet_dxf(Sheet("diffuser", 0.5, kerf or None, pieces), kerf))
    assert len(cuts) == 12
    boxes = [(cut.min(axis=0), cut.max(axis=0)) for cut in cuts]
    for index, (low, high) in enumerate(boxes):
        assert (low > -1e-9).all() and high[0] <= 100
        piece = pieces[index // 9]
        assert high - low == pytest.approx([piece.length + kerf, piece.width + kerf])
        for other_low, other_high in boxes[:index]:
            assert ((other_low > high) | (other_high < low)).any()


@pytest.mark.parametrize("design", [STANDARD, FINGER], ids=lambda design: design.name)
@pytest.mark.parametrize("scale", [0.8, 1.0, 1.4, 2.2, 2.7])
def test_a_sheet_holds_as_many_pieces_as_the_bill_says_and_the_comb(
    design: Wedge, scale: float
) -> None:
    acrylic, mirror = (
        replace(part, length_mm=part.length_mm * scale, width_mm=part.width_mm * scale)
        for part in (design.acrylic, design.mirror)
    )
    scaled = replace(design, acrylic=acrylic, mirror=mirror, gel=replace(
        design.gel, pad_length_mm=5.0, pad_width_mm=4.0), lights=replace(
        design.lights, red_side_leds=1, blue_side_leds=1, green_base_leds=1))  # fmt: skip
    rows = {part.id: part for part in parts_for(scaled, read_parts())}
    prices = {part.id: part.price_usd for part in read_parts()}
    for sheet in sheets(scaled)[:2]:
        (piece,), kerf = sheet.pieces, sheet.kerf_mm or 0.0
        comb = np.ptp(np.concatenate(cuts_of(comb_dxf(sheet))), axis=0)
        (side,) = {
            float(side) for side in re.findall(r"(\d+) x (\d+) mm x", rows[piece.id].name)[0]
        }
        assert rows[piece.id].price_usd == prices[piece.id] * (side / 100) ** 2
        for more, fits in ((0, True), (1, False)):
            many = replace(piece, quantity=int(rows[piece.id].pack_size) + more)
            cuts = cuts_of(sheet_dxf(replace(sheet, pieces=(many,)), kerf))
            far = np.concatenate(cuts).max(axis=0)
            room = far[0] <= side and far[1] + 4 + comb[1] <= side
            assert room == fits, piece.id


@pytest.mark.parametrize("lights", [(7, 5, 7), (0, 5, 0), (7, 0, 0)], ids=str)
def test_the_strips_of_a_film_are_bought_as_one_roll(lights: tuple[int, int, int]) -> None:
    red, green, blue = lights
    changed = {"red_side_leds": red, "green_base_leds": green, "blue_side_leds": blue}
    design = replace(STANDARD, lights=replace(STANDARD.lights, **changed))
    cut = Counter({sheet.material: sum(p.quantity for p in sheet.pieces)
                   for sheet in sheets(design)})  # fmt: skip
    counts = bill_counts(design, assembly_of(design).counts(), [], [])
    films = {key: counts[key] for key in ("gray_filter", "diffuser")}
    lines = make_bill(films, parts_for(design, read_parts()))
    assert {line.part.id: line.quantity for line in lines} == {key: cut[key] for key in films}
    assert all(line.cost_usd(1) > 0 for line in lines)


@pytest.mark.parametrize("lights", [(7, 0, 7), (7, 5, 0)], ids=str)
def test_films_are_cut_for_every_row_of_lights_and_no_other(lights: tuple[int, int, int]) -> None:
    red, green, blue = lights
    changed = {"red_side_leds": red, "green_base_leds": green, "blue_side_leds": blue}
    design = replace(STANDARD, lights=replace(STANDARD.lights, **changed))
    assembly = assembly_of(design)
    counts = assembly.counts()
    cut = {piece.id: piece.quantity for sheet in sheets(design) for piece in sheet.pieces}
    assert cut == {name: counts.get(name, 0) for name in cut}
    assert {name for name in counts if re.match("gray_filter|diffuser", name)} <= set(cut)
    assert sum(cut.values()) == 2 + 2 * sum(count > 0 for count in lights)


def test_a_laser_without_kerf_has_one_file_a_sheet_and_the_kerf_is_halved_on_each_side() -> None:
    def named(acrylic: float) -> list[str]:
        laser = replace(FINGER.laser, acrylic_kerf_mm=acrylic)
        return [name for name, _ in laser_files(replace(FINGER, laser=laser)) if "acrylic" in name]

    assert len(named(0.0)) == 2 and len(named(0.2)) == 3
    piece = Piece("mirror", 20.0, 10.0, 1)
    (cut,) = cuts_of(sheet_dxf(Sheet("mirror", 1.0, 0.2, (piece,)), 0.2))
    assert np.ptp(cut, axis=0) == pytest.approx([20.2, 10.2])
    assert np.ptp([vertex[:2] for vertex in outline(piece)], axis=0) == pytest.approx([20, 10])


def test_an_stl_s_normals_point_out_of_its_body() -> None:
    content = stl_of(trimesh.creation.box((2.0, 4.0, 6.0)))
    rows = np.frombuffer(content[84:], [("n", "<f4", 3), ("p", "<f4", (3, 3)), ("a", "<u2")])
    first, second = rows["p"][:, 1] - rows["p"][:, 0], rows["p"][:, 2] - rows["p"][:, 0]
    across = np.cross(first, second)
    assert rows["n"] == pytest.approx(across / np.linalg.norm(across, axis=1)[:, None])
    assert (np.einsum("ij,ij->i", rows["n"], rows["p"].mean(axis=1)) > 0).all()


def test_the_page_links_the_files_of_a_folder_together_and_no_script(finger: Model) -> None:
    paths = [
        "bill/bill.csv",
        "laser/mirror.dxf",
        "bill/bill.md",
        "guide.md",
        "view/assembly.glb",
        "view/model.js",
        "view/viewer.js",
    ]
    page = page_html(FINGER, manifest_of(finger, []), names_of(finger), [], paths)
    lines = re.findall(r'<p class="files">(.*?)</p>', page)
    linked = [re.findall(r'href="([^"]+)"', line) for line in lines]
    assert linked == [
        ["guide.md"], ["bill/bill.csv", "bill/bill.md"], ["laser/mirror.dxf"],
        ["step/assembly.step"], ["view/assembly.glb"],
    ]  # fmt: skip


@BOTH
def test_the_page_calls_every_part_by_a_name_and_none_by_its_id(
    name: str, request: pytest.FixtureRequest
) -> None:
    built: Model = request.getfixturevalue(name)
    manifest = manifest_of(built, [])
    page = page_html(built.design, manifest, names_of(built), [], [])
    named = re.findall("<tr><td>([^<]*)<td>\\d", page)
    assert len(named) == len(set(named)) == len(manifest["parts"])
    assert not [part for part in named if "_" in part or part[0].islower()]


def test_the_page_says_what_every_picture_shows_and_no_quantity_is_none(
    finger: Model, fabricated: tuple[Path, Path]
) -> None:
    names, page = names_of(finger), (fabricated[0] / "index.html").read_text()
    said = dict(re.findall(r'src="([^"]+)" alt="([^"]*)"', page))
    assert said.keys() > {"drawing.svg", "electronics/wiring.svg", "pictures/exploded.png"}
    assert len(set(said.values())) == len(said)
    for number, step in enumerate(finger.assembly.steps, start=1):
        assert said[f"pictures/step_{number:02d}.png"] == f"Step {number}: {step.title}"
    for part in finger.printed:
        assert said[f"pictures/part_{part}.png"] == names[part]
    assert not [words for words in said.values() if "_" in words or words[0].islower()]
    counted = re.findall("<tr><td>[^<]*<td>([^<]*)<td>", page)
    assert len(counted) >= len(finger.printed) and "0" not in counted


@pytest.mark.parametrize(("failed", "said"), [(0, None), (1, "1 check failed"),
                                              (2, "2 checks failed")])  # fmt: skip
def test_the_page_marks_what_failed_and_nothing_else(
    failed: int, said: str | None, finger: Model
) -> None:
    results = [
        Result("walls", f"part {index}", 0.5 if index < failed else 1.0, "mm", 0.8, "at least")
        for index in range(3)
    ]
    page = page_html(FINGER, manifest_of(finger, results), names_of(finger), [], [])
    assert page.count('class="bad"') == failed
    told = re.sub("<[^>]*>", "", page)
    assert (said in told) if said else "Do not build" not in told


def test_words_from_outside_are_text_on_the_pages(finger: Model) -> None:
    manifest = manifest_of(finger, [Result("<i>", "<i>", 1.0, "<i>", 0.8, "at least", "<i>")])
    manifest["parts"][0] |= {"material": "<i>"}
    part = manifest["parts"][0]["id"]
    names = names_of(finger) | {part: "<i>a"}
    paths = [f"part_{part}.png", "step_01.png", "<i>.csv"]
    page = page_html(replace(FINGER, name="<i>@HASH@"), manifest, names, ["<i>b"], paths)
    assert "<i>" not in page and page.count("&lt;i&gt;a") == 3 and "&lt;i&gt;b" in page
    assert 'data-name="&lt;i&gt;@HASH@"' in page
    guide = guide_html("# A <i>\n\nTake <script>care</script>.\n")
    assert "<i>" not in guide and "&lt;script&gt;care" in guide


@BOTH
def test_bodies_are_pulled_apart_along_their_way_out(
    name: str, request: pytest.FixtureRequest
) -> None:
    assembly = request.getfixturevalue(name).assembly
    apart, checked = pulled_apart(assembly), 0
    for step in assembly.steps:
        for body in assembly.moving(step):
            if (standing := assembly.standing(step)) and (way := assembly.way(step, body)):
                assert (apart[body] - apart[standing[0]]) @ straight(way) > 0, body
                checked += 1
    assert checked > 20 and not apart["case"].any()


def test_the_section_shows_the_far_half(finger: Model) -> None:
    items = list(_section(FINGER, finger.assembly, finger.body_meshes))
    bodies, light = [x for x in items if x.edges], [x for x in items if not x.edges]
    assert len(light) == 5 and len(bodies) > 10
    assert min(item.mesh.bounds[0, 1] for item in bodies) >= -1e-9
    # In front of what is cut: the pictures are drawn from y < 0.
    assert max(item.mesh.bounds[1, 1] for item in light) < 0


@pytest.mark.parametrize("design", [STANDARD, FINGER], ids=lambda design: design.name)
def test_the_light_in_the_pictures_is_bent_between_gel_and_acrylic(design: Wedge) -> None:
    paths = trace(design, pad_grid(design, 5))
    for skin, entry, glass in zip(paths.skin, paths.gel, paths.acrylic, strict=True):
        assert entry[2] == -design.acrylic.thickness_mm
        sines = [
            index * np.linalg.norm(way[:2]) / np.linalg.norm(way)
            for index, way in (
                (design.gel.refractive_index, entry - skin),
                (design.acrylic.refractive_index, glass - entry),
            )
        ]
        assert sines[0] == pytest.approx(sines[1], abs=1e-6)
