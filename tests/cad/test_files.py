# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The files, opened by readers that others wrote, and the same bytes from two processes."""

import csv
import filecmp
import hashlib
import io
import json
import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import cadquery as cq
import ezdxf
import numpy as np
import pytest
import trimesh
from ezdxf import path as dxf_path
from ezdxf.document import Drawing

from bom.bill import UNCOUNTED
from cad.build import Model, manifest_of
from cad.catalogue import PRINTED
from cad.electronics.wiring import wiring_svg
from cad.exports.drawing import drawing_of
from cad.exports.laser import outline, sheet_dxf, sheets
from cad.exports.solids import step_of_assembly
from cad.exports.step_colors import with_colors
from cad.exports.views import color_of
from cad.golden import differences, golden_of, read_golden
from cad.manifest import with_hashes
from cad.mesh import DEFLECTION_MM
from cad.strokes import strokes, width_of
from sensor.design import FINGER, STANDARD
from tests.cad.conftest import area_mm2, pieces_by_id
from validation.report.fabrication import fabrication_section

Folders = tuple[Path, Path]
ROOT = Path(__file__).resolve().parents[2]


def listed(folder: Path) -> list[str]:
    return sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file())


def test_two_processes_write_the_same_bytes(fabricated: Folders) -> None:
    first, second = fabricated
    names = listed(first)
    assert names == listed(second)
    assert filecmp.cmpfiles(first, second, names, shallow=False) == (names, [], [])
    kinds = {name.rpartition(".")[2] for name in names}
    assert kinds >= {"stl", "step", "3mf", "dxf", "glb", "png", "svg", "json", "csv", "md", "html"}


def test_a_second_file_of_a_process_is_the_first(finger: Model) -> None:
    colors = {name: color_of(body.part) for name, body in finger.assembly.bodies.items()}
    first, second = (step_of_assembly(finger.bodies, "wedge", colors) for _ in range(2))
    assert first == second
    numbers = re.findall(rb"OCCURRENCE\('(\d+)'", first)
    assert [int(number) for number in numbers] == list(range(1, len(finger.bodies) + 1))


def test_the_manifest_names_every_file_by_its_hash(fabricated: Folders) -> None:
    folder, _ = fabricated
    manifest = json.loads((folder / "manifest.json").read_text())
    names = [name for name in listed(folder) if name != "manifest.json"]
    assert sorted(manifest["files"]) == names
    for name, digest in manifest["files"].items():
        assert hashlib.sha256((folder / name).read_bytes()).hexdigest() == digest
    assert with_hashes({}, folder / "print")["files"].keys() == {
        name.removeprefix("print/") for name in names if name.startswith("print/")
    }


@pytest.mark.parametrize("part", [part.id for part in PRINTED])
def test_stl_and_3mf_are_the_part(part: str, finger: Model, fabricated: Folders) -> None:
    folder, _ = fabricated
    volume = finger.printed[part].Volume()
    mesh = trimesh.load_mesh(folder / "print" / f"{part}.stl")
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert mesh.body_count == 1
    assert mesh.volume == pytest.approx(volume, rel=2e-3)
    assert mesh.bounds[0] == pytest.approx([0, 0, 0], abs=DEFLECTION_MM)

    lib3mf = pytest.importorskip("lib3mf", reason="has no wheel for Linux on ARM")
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.ReadFromFile(str(folder / "print" / f"{part}.3mf"))
    assert reader.GetWarningCount() == 0
    assert model.GetUnit() == lib3mf.ModelUnit.MilliMeter
    objects = model.GetMeshObjects()
    assert objects.MoveNext()
    body = objects.GetCurrentMeshObject()
    assert body.IsManifoldAndOriented()
    assert body.GetTriangleCount() == len(mesh.faces)
    assert not objects.MoveNext()


def test_step_files_hold_the_solids(finger: Model, fabricated: Folders) -> None:
    folder, _ = fabricated
    for part in ("case", "mold_curved"):
        solid = cq.importers.importStep(str(folder / "step" / f"{part}.step"))
        assert solid.solids().size() == 1
        assert solid.val().Volume() == pytest.approx(finger.printed[part].Volume(), rel=1e-6)
    whole = cq.importers.importStep(str(folder / "step" / "assembly.step"))
    assert whole.solids().size() == len(finger.bodies)
    total = sum(solid.Volume() for solid in finger.bodies.values())
    assert sum(solid.Volume() for solid in whole.solids().vals()) == pytest.approx(total, rel=1e-6)


def test_the_step_assembly_names_and_paints_its_bodies(finger: Model, fabricated: Folders) -> None:
    whole = cq.Assembly.importStep(str(fabricated[0] / "step" / "assembly.step"))
    painted = {
        child.name: child.color.toTuple()[:3] for child in whole.objects.values() if child.color
    }
    wanted = {name: color_of(body.part) for name, body in finger.assembly.bodies.items()}
    assert set(painted) == set(wanted)
    for name, color in wanted.items():
        assert painted[name] == pytest.approx(color, abs=2e-3), name


def test_a_file_without_solids_takes_no_colours() -> None:
    with pytest.raises(ValueError, match="no solid"):
        with_colors("DATA;\n#1=PRODUCT('a','a','',());\nENDSEC;\n", lambda name: (0, 0, 0))


def test_the_glb_holds_every_body(finger: Model, fabricated: Folders) -> None:
    scene = trimesh.load_scene(fabricated[0] / "view" / "assembly.glb")
    assert set(scene.geometry) == set(finger.bodies)


def test_the_glb_is_in_metres_with_y_up(finger: Model, fabricated: Folders) -> None:
    scene = trimesh.load_scene(fabricated[0] / "view" / "assembly.glb")
    for name, mesh in finger.body_meshes.items():
        matrix, geometry = scene.graph[name]
        x, y, z = mesh.vertices.T
        placed = trimesh.transform_points(scene.geometry[geometry].vertices, matrix)
        wanted = np.column_stack([x, z, -y]) / 1000
        assert placed.min(axis=0) == pytest.approx(wanted.min(axis=0), abs=1e-8)
        assert placed.max(axis=0) == pytest.approx(wanted.max(axis=0), abs=1e-8)


NAMES = ["R&D", 'a <b> "c"', "it's", "Größe 2", "𝄞;#1"]


@pytest.mark.parametrize("name", NAMES)
def test_any_name_is_text_in_drawings_and_solids(name: str, finger: Model, tmp_path: Path) -> None:
    named = replace(FINGER, name=name)
    for content in (wiring_svg(named), drawing_of(named, finger.body_meshes)):
        said = "".join(ElementTree.fromstring(content).itertext())
        assert name in said
    bodies = {"pin": finger.bodies["pin_1"]}
    path = tmp_path / "assembly.step"
    path.write_bytes(step_of_assembly(bodies, name, {"pin": (1.0, 0.0, 0.0)}))
    assert cq.Assembly.importStep(str(path)).name == name
    assert re.search(r"FILE_NAME\('(?:[^']|'')*','2021", path.read_text(encoding="ascii"))


def outline_area(entity: ezdxf.entities.LWPolyline) -> float:
    """Area by the shoelace formula over a fine flattening: not by our own formula."""
    points = np.array([(p.x, p.y) for p in dxf_path.make_path(entity).flattening(1e-5)])
    x, y = points.T
    return float(abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2)


def marks_on_pieces(document: Drawing) -> int:
    """Engraved or noted points inside, or within half a millimetre of, the box of an outline."""
    space = document.modelspace()
    boxes = [
        (np.min(points, axis=0) - 0.5, np.max(points, axis=0) + 0.5)
        for cut in space.query('LWPOLYLINE[layer=="CUT"]')
        for points in [np.array([(x, y) for x, y, *_ in cut])]
    ]
    marks = [(x, y) for e in space.query('*[layer!="CUT"]') for x, y, *_ in e]
    return sum(bool(((low < m) & (m < high)).all()) for m in np.array(marks) for low, high in boxes)


def test_a_mark_on_a_piece_is_found(finger: Model) -> None:
    sheet = sheets(finger.design)[0]
    document = ezdxf.read(io.StringIO(sheet_dxf(sheet, 0.0).decode()))
    assert marks_on_pieces(document) == 0
    first = document.modelspace().query('LWPOLYLINE[layer=="CUT"]')[0]
    x, y = np.mean([(x, y) for x, y, *_ in first], axis=0)
    document.modelspace().add_lwpolyline([(x, y), (x + 1, y)], dxfattribs={"layer": "ENGRAVE"})
    assert marks_on_pieces(document) == 2


def test_letters_are_drawn_differently_and_as_wide_as_they_say() -> None:
    letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.,-_=+/:()"
    drawn = [str(strokes(letter, (0, 0), 6.0)) for letter in letters]
    assert len(set(drawn)) == len(letters)
    points = np.concatenate([np.array(line) for line in strokes("H8H", (1.0, 2.0), 3.0)])
    assert np.ptp(points, axis=0) == pytest.approx([width_of("H8H", 3.0), 3.0])
    assert points.min(axis=0) == pytest.approx([1.0, 2.0])


def test_laser_sheets_hold_the_parts_outlines(finger: Model, fabricated: Folders) -> None:
    pieces = pieces_by_id(finger.design)
    for sheet in sheets(finger.design):
        variants = {"nominal": 0.0} | ({f"kerf{k:g}": k} if (k := sheet.kerf_mm) else {})
        for suffix, kerf in variants.items():
            document = ezdxf.readfile(fabricated[0] / "laser" / f"{sheet.name}_{suffix}.dxf")
            assert not document.audit().errors
            assert document.units == ezdxf.units.MM
            cuts = list(document.modelspace().query('LWPOLYLINE[layer=="CUT"]'))
            assert all(cut.closed for cut in cuts)
            assert {e.dxf.layer for e in document.modelspace()} == {"CUT", "ENGRAVE", "NOTE"}
            assert {e.dxftype() for e in document.modelspace()} == {"LWPOLYLINE"}
            assert not marks_on_pieces(document)
            # What is engraved is what the font writes of every piece, and nothing else.
            labels = [f"{p.id} {sheet.thickness_mm:g} mm x{p.quantity}" for p in sheet.pieces]
            lines = sum(len(strokes(label, (0, 0), 2.0)) for label in labels)
            assert len(document.modelspace().query('*[layer=="ENGRAVE"]')) == lines
            wanted = [
                area_mm2(outline(pieces[piece.id], kerf / 2))
                for piece in sheet.pieces
                for _ in range(piece.quantity)
            ]
            assert [outline_area(cut) for cut in cuts] == pytest.approx(wanted, rel=1e-6)
            assert f"_x{len(cuts)}" in sheet.name


def test_films_are_for_a_knife_and_what_a_laser_cuts_fits_its_sheet(fabricated: Folders) -> None:
    files = sorted((fabricated[0] / "laser").glob("*.dxf"))
    films = [path.name for path in files if re.search("gray_filter|diffuser", path.name)]
    assert films and all(re.fullmatch(r"[a-z_]+_[\d.]+mm_x\d_nominal.dxf", name) for name in films)
    guide = (fabricated[0] / "guide.md").read_text(encoding="utf-8")
    assert "Never put gray filter or diffuser into it" in guide
    rows = [line for line in guide.splitlines() if re.match(r"\| (gray_filter|diffuser) ", line)]
    assert rows and all("knife" in row and "laser" not in row for row in rows)
    with (fabricated[0] / "bill" / "bill.csv").open(encoding="utf-8", newline="") as file:
        names = {row["id"]: row["name"] for row in csv.DictReader(file)}
    for path in files:
        material = "mirror" if "mirror" in path.name else "acrylic"
        sides = re.findall(r"(\d+) x (\d+) mm x", names[material])[0]
        space = ezdxf.readfile(path).modelspace()
        cuts = [np.array([(x, y) for x, y, *_ in cut]) for cut in space.query('*[layer=="CUT"]')]
        extent = np.ptp(np.concatenate(cuts), axis=0)
        assert (extent < [float(side) for side in sides]).all(), path.name
    combs = [path for path in files if path.name.startswith("kerf_comb")]
    assert [path.name.split("_")[2] for path in combs] == ["acrylic", "mirror"]
    assert all(len(ezdxf.readfile(p).modelspace().query('*[layer=="CUT"]')) == 10 for p in combs)


def test_the_acrylics_outline_is_its_solids(finger: Model, standard: Model) -> None:
    for built in (finger, standard):
        volume = built.bodies["acrylic"].Volume()
        piece = pieces_by_id(built.design)["acrylic"]
        thickness = built.design.acrylic.thickness_mm
        assert area_mm2(outline(piece)) * thickness == pytest.approx(volume, rel=1e-9)


@pytest.mark.parametrize("grow", [0.02, 0.09, 0.2])
def test_a_grown_outline_is_the_kerf_wider_everywhere(finger: Model, grow: float) -> None:
    piece = pieces_by_id(finger.design)["acrylic"]
    points = np.array([(x, y) for x, y, _ in outline(piece, grow)])
    assert np.ptp(points, axis=0) == pytest.approx(
        [piece.length + 2 * grow, piece.width + 2 * grow]
    )
    # Steiner: a band of width grow along the outline, but for corners and arcs of that order.
    more = area_mm2(outline(piece, grow)) - area_mm2(outline(piece))
    assert more == pytest.approx(2 * (piece.length + piece.width) * grow, rel=0.1)


def test_pictures_show_something(fabricated: Folders) -> None:
    from PIL import Image

    for path in (fabricated[0] / "pictures").glob("*.png"):
        pixels = np.asarray(Image.open(path).convert("RGB"))
        inked = (pixels != 255).any(axis=-1)
        assert 0.02 < inked.mean() < 0.9, path.name
        edge = np.concatenate([inked[0], inked[-1], inked[:, 0], inked[:, -1]])
        assert not edge.any(), f"{path.name} is cut off"


def test_pages_point_at_files_that_exist(fabricated: Folders) -> None:
    folder, _ = fabricated
    page = (folder / "index.html").read_text(encoding="utf-8")
    guide = (folder / "guide.md").read_text(encoding="utf-8")
    links = re.findall(r'(?:src|href)="([^"]+)"', page) + re.findall(r"\]\(([^)]+)\)", guide)
    assert len(links) > 60
    shown = (folder / "guide.html").read_text(encoding="utf-8")
    links_shown = re.findall(r'(?:src|href)="([^"]+)"', shown)
    assert set(links_shown) == {"index.html", *re.findall(r"\]\(([^)]+)\)", guide)}
    assert shown.count("<table>") == len(re.findall(r"^\|-", guide, re.MULTILINE))
    assert [link for link in links if not (folder / link).is_file()] == []
    assert "http" not in re.sub(r"http://www\.w3\.org\S*", "", page)


CONSUMABLES = {
    "epoxy": "epoxy", "double-sided tape": "double_tape", "black tape": "black_tape",
    "2000 grit": "abrasive", "in insulating tape": "insulating_tape",
    "tegaderm": "cover_tape", "silicone adhesive": "gel_glue",
    "print-on silicone ink": "gel_paint", "with the thinner": "gel_thinner",
    "dish soap": "degreaser", "lint-free": "degreaser", "xp-565": "gel",
    "second board": "csi_hdmi_board",
    "plug the hdmi cable into": "hdmi_cable", "the microsd card": "microsd_card",
    "the pi's power supply": "pi_power_supply", "camera server": "raspberry_pi",
}  # fmt: skip


def test_guide_and_bill_ask_for_the_same(fabricated: Folders) -> None:
    folder = fabricated[0]
    with (folder / "bill" / "bill.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    guide = (folder / "guide.md").read_text(encoding="utf-8")
    table = guide.partition("## What to order")[2].partition("## 1.")[0]
    ordered = [
        tuple(cell.strip() for cell in line.strip("|").split("|"))
        for line in table.splitlines()
        if line.startswith("| ") and not line.startswith("| part")
    ]
    wanted = [(row["name"], row["quantity"], row["unit"]) for row in rows]
    assert [(name, *words.split(" ", 1)) for name, words in ordered] == [
        (name, count, unit if unit in UNCOUNTED or count == "1" else f"{unit}s")
        for name, count, unit in wanted
    ]
    with (folder / "bill" / "distributor.csv").open(encoding="utf-8", newline="") as file:
        sold = {row["Customer Reference"]: row for row in csv.DictReader(file)}
    electronic = {"csi_hdmi_board", "hdmi_cable", "raspberry_pi", "wire"}
    electronic |= {row["id"] for row in rows if re.match(r"led_[a-z]+$|resistor_\d", row["id"])}
    assert set(sold) == electronic
    bought = {row["id"] for row in rows}
    steps = guide.replace(table, "").lower()
    for word, part in CONSUMABLES.items():
        assert word in steps and part in bought, word
    pieces = {row["id"]: row["quantity"] for row in rows if row["unit"] != "m"}
    assert all(row["Quantity"] == pieces.get(key, "1") for key, row in sold.items())


def test_the_guide_ends_at_pages_that_exist_with_the_colours_set_before_the_presses(
    fabricated: Folders,
) -> None:
    guide = (fabricated[0] / "guide.md").read_text(encoding="utf-8")
    pages = re.findall(r"`(docs/[^`]+)`", guide)
    assert {"docs/howto/pi.md", "docs/howto/calibrate.md"} <= {*pages}
    assert [page for page in pages if not (ROOT / page).is_file()] == []
    commands = ["rpicam-hello", "`wedge tune", "`wedge capture", "`wedge calibrate"]
    places = [guide.index(command) for command in commands]
    assert places == sorted(places)


@pytest.mark.parametrize("name", ["finger"])
def test_the_design_measures_what_was_kept(name: str, fabricated: Folders) -> None:
    manifest = json.loads((fabricated[0] / "manifest.json").read_text())
    kept = read_golden(name, manifest["design_sha256"])
    assert kept is not None
    assert differences(golden_of(manifest), kept) == []


def test_a_change_is_told_in_words() -> None:
    kept = read_golden("standard", STANDARD.sha256)
    assert kept is not None
    now = json.loads(json.dumps(kept))
    case = next(part for part in now["parts"] if part["id"] == "case")
    case["volume_mm3"] *= 1.031
    case["bounding_box_mm"][0] += 1
    now["parts"] = [part for part in now["parts"] if part["id"] != "mirror"]
    now["bill"]["led_red"] += 1
    said = differences(now, kept)
    assert "case volume +3.1 %" in said
    assert "mirror is gone" in said
    assert any(text.startswith("case now measures ") for text in said)
    assert any(text.startswith("bill: led_red ") for text in said)
    assert differences(kept, kept) == []


def test_a_design_of_ones_own_is_not_held_against_the_known_one_of_its_name() -> None:
    assert read_golden("standard", FINGER.sha256) is None


@pytest.mark.parametrize("name", ["standard", "finger"])
def test_the_manifest_has_the_gel_s_size_to_the_micrometre(
    name: str, request: pytest.FixtureRequest
) -> None:
    built: Model = request.getfixturevalue(name)
    gel = built.design.gel
    (part,) = [part for part in manifest_of(built, [])["parts"] if part["id"] == "gel"]
    assert part["bounding_box_mm"] == [gel.pad_length_mm, gel.pad_width_mm, gel.thickness_mm]


def test_the_report_shows_a_whole_folder(fabricated: tuple[Path, Path]) -> None:
    folder, _ = fabricated
    section = fabrication_section({folder: FINGER}, folder.parent)
    assert len(re.findall("data:image/png;base64,", section.html)) == 2
    assert len(re.findall("data:image/svg", section.html)) == 1
    assert len(section.html) < 500_000
    addresses = re.findall(r'(?:href|data-model|script src)="([^"]+)"', section.html)
    assert {address.rpartition("/")[2] for address in addresses} >= {"model.js", "viewer.js"}
    for address in addresses:
        assert (folder.parent / address).is_file()
