# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Both designs pass every check, and each check fails on the fault it is there to find."""

import math
import re
from dataclasses import replace
from types import SimpleNamespace

import cadquery as cq
import cv2
import manifold3d
import numpy as np
import pytest
import trimesh

from cad import checks
from cad.build import Model, run_checks
from cad.checks.fit import _sideways_gap
from cad.features import box, cylinder
from cad.layout import Layout
from cad.manifolds import manifold_of
from cad.mesh import mesh_of
from cad.motions import Shift, Turn, moved, poses, straight, turned_out
from cad.optics import faulty_pictures, project, trace
from cad.parts.bought import mirror
from cad.parts.case import case
from cad.parts.mold import mold_curved
from cad.tables import fastener
from sensor.design import FINGER, STANDARD

FASTENER = fastener(FINGER.fastening.screw)


def failed(results: list[checks.Result]) -> list[str]:
    return [f"{r.check} {r.subject}: {r.value:g} {r.detail}" for r in results if not r.passed]


def solid(*ranges: tuple[float, float]) -> cq.Solid:
    x, y, z = ranges
    return box(x, y, z).val()


@pytest.mark.parametrize("name", ["standard", "finger"])
def test_both_designs_pass_every_check(name: str, request: pytest.FixtureRequest) -> None:
    built: Model = request.getfixturevalue(name)
    results = run_checks(built)
    assert failed(results) == []
    assert len({(r.check, r.subject) for r in results}) == len(results)


def test_a_thin_wall_is_found_and_a_thick_one_is_measured() -> None:
    hollow = box((0, 20), (0, 20), (0, 20)).cut(box((1.5, 19.4), (1, 19), (2, 30)))
    result = checks.check_walls("box", mesh_of(hollow.val()))
    assert result.value == pytest.approx(0.6, abs=2e-3)
    assert not result.passed


@pytest.mark.parametrize(("thick", "passes"), [(0.8, True), (0.7999, False)])
def test_the_least_wall_is_meant_to_the_micrometre(thick: float, passes: bool) -> None:
    hollow = box((0, 20), (0, 20), (0, 20)).cut(box((thick, 17), (3, 17), (3, 30)))
    assert checks.check_walls("box", mesh_of(hollow.val())).passed is passes


def test_a_thin_spot_too_small_for_rays_at_random_is_found() -> None:
    plate = box((0, 100), (0, 100), (0, 5)).cut(box((30, 30.05), (70, 70.05), (0.5, 6)))
    result = checks.check_walls("plate", mesh_of(plate.val()))
    assert result.value == pytest.approx(0.5, abs=1e-6) and not result.passed


def test_a_knife_edge_is_no_wall() -> None:
    wedge = cq.Workplane("XZ").polyline([(0, 0), (20, 0), (0, 10)]).close().extrude(10)
    assert checks.check_walls("wedge", mesh_of(wedge.val())).passed


def test_overhang_is_the_area_of_the_roof_between_two_legs() -> None:
    table = box((0, 30), (0, 10), (0, 10)).cut(box((5, 25), (-1, 11), (-1, 8)))
    result = checks.check_overhang("table", mesh_of(table.val()))
    assert result.value == pytest.approx(100 * 200 / table.val().Area(), rel=1e-6)


@pytest.mark.parametrize("height", [0.2, 10])
def test_a_part_that_would_need_support_is_found(height: float) -> None:
    stem, hat = box((4, 6), (4, 6), (0, height)), box((0, 10), (0, 10), (height, height + 2))
    mushroom = stem.union(hat)
    result = checks.check_overhang("mushroom", mesh_of(mushroom.val()))
    assert result.value == pytest.approx(100 * 96 / mushroom.val().Area(), rel=1e-6)
    assert not result.passed


@pytest.mark.parametrize(("lean_deg", "hangs"), [(46, False), (45, False), (44, True)])
def test_a_face_that_leans_half_way_needs_no_support(lean_deg: float, hangs: bool) -> None:
    out = 5 / math.tan(math.radians(lean_deg))
    block = cq.Workplane("XZ").polyline([(0, 0), (9, 0), (9 + out, 5), (0, 5)]).close().extrude(4)
    result = checks.check_overhang("block", mesh_of(block.val()))
    under = 4 * math.hypot(5, out) if hangs else 0
    assert result.value == pytest.approx(100 * under / block.val().Area(), abs=1e-6)


def test_a_part_of_another_volume_than_its_formula_is_found(finger: Model) -> None:
    whole = finger.printed
    assert not failed(checks.check_closed_forms(FINGER, whole))
    for name in ("ball_jig", "mold_flat", "mold_lid"):
        x = whole[name].BoundingBox().xmin
        scratched = cq.Workplane(whole[name]).cut(box((x, x + 0.1), (-2, 2), (-1, 1))).val()
        found = failed(checks.check_closed_forms(FINGER, {**whole, name: scratched}))
        assert [text.split(":")[0] for text in found] == [f"closed form {name}"]


def test_a_lens_too_narrow_for_a_fault_is_found() -> None:
    """The pad fits the picture as designed, and leaves it when the mirror is a degree off."""
    wide = FINGER.camera.diagonal_view_deg
    for view in np.arange(wide, 60, -0.5):
        tight = replace(FINGER, camera=replace(FINGER.camera, diagonal_view_deg=float(view)))
        worst = min(fault.margin_px for fault in faulty_pictures(tight))
        if worst < 0:
            break
    results = checks.check_tolerance(tight)
    assert failed(results)
    assert not failed(checks.check_tolerance(FINGER))
    assert {r.subject for r in results} == {r.subject for r in checks.check_tolerance(FINGER)}


def test_an_open_mesh_is_found(finger: Model) -> None:
    name = "camera_holder"
    whole = finger.bed_meshes[name]
    torn = trimesh.Trimesh(whole.vertices, whole.faces[1:], process=False)
    found = checks.check_solids({name: finger.printed[name]}, {name: torn})
    assert len(failed(found)) == len(found) == 2  # what is open has no volume either
    assert not failed(checks.check_solids({name: finger.printed[name]}, {name: whole}))


def test_a_part_in_pieces_a_wrong_mesh_and_a_solid_that_is_none_are_found() -> None:
    one, other = solid((0, 2), (0, 3), (0, 4)), solid((5, 7), (0, 3), (0, 4))
    mesh = mesh_of(one)
    both = mesh_of(cq.Compound.makeCompound([one, other]))
    turned = trimesh.Trimesh(mesh.vertices, mesh.faces.copy(), process=False)
    turned.faces[0] = turned.faces[0][::-1]
    larger = mesh.copy().apply_scale(1.001)

    def faults(part: object, seen: trimesh.Trimesh) -> list[str]:
        found = checks.check_solids({"part": part}, {"part": seen})  # type: ignore[dict-item]
        return [result.check for result in found if not result.passed]

    assert both.is_watertight and turned.is_watertight
    assert faults(one, mesh) == []
    assert faults(cq.Compound.makeCompound([one, other]), both) == ["solid"]
    assert faults(one, turned) == ["solid", "mesh volume"]
    assert faults(one, larger) == ["mesh volume"]
    unsound = SimpleNamespace(isValid=lambda: False, Volume=one.Volume)
    assert faults(unsound, mesh) == ["solid", "mesh volume"]


def test_a_mold_with_another_curvature_is_found() -> None:
    off = replace(FINGER, gel=replace(FINGER.gel, semi_axis_across_mm=50.0))
    meshes = mesh_of(mold_curved(off)), mesh_of(mold_curved(FINGER))
    halves = {"mold_curved": meshes[0], "mold_flat": meshes[1]}
    first, _ = checks.check_mold(FINGER, halves)
    # At the cavity's edge, y = 4.7 mm: the sag differs by about y²/2 (60/50² - 1/60).
    assert first.value == pytest.approx(4.7**2 / 2 * (60 / 50**2 - 1 / 60), rel=0.1)
    assert not first.passed
    blocks = {name: mesh_of(solid((-20, 20), (-20, 20), (-9, 0))) for name in halves}
    assert len(failed(checks.check_mold(FINGER, blocks))) == 2  # no cavity at all


def test_silicone_that_a_whole_ridge_shuts_in_is_found(finger: Model) -> None:
    halves = {name: mesh_of(finger.printed[name]) for name in ("mold_curved", "mold_flat")}
    lid = finger.printed["mold_lid"]
    assert failed(checks.check_relief(halves, mesh_of(lid))) == []
    x, y = FINGER.gel.pad_length_mm / 2, FINGER.gel.pad_width_mm / 2
    ridge = box((-x - 3.6, x + 3.6), (-y - 3.6, y + 3.6), (-0.1, 1.0))
    ridge = ridge.cut(box((-x - 1.8, x + 1.8), (-y - 1.8, y + 1.8), (-1, 2)))
    closed = mesh_of(cq.Workplane(lid).union(ridge).val())
    for result in checks.check_relief(halves, closed):
        assert result.value > 0.8 * finger.bodies["gel"].Volume() and not result.passed


def test_screws_of_another_size_are_found(finger: Model) -> None:
    other = replace(FINGER, fastening=replace(FINGER.fastening, screw="M2.5"))
    assert failed(checks.check_fasteners(other, finger.printed))


def test_a_screw_beside_its_hole_is_found(finger: Model) -> None:
    assert not failed(checks.check_fasteners(FINGER, finger.printed))
    tap, clear = FASTENER.tap_mm, FASTENER.clearance_mm
    both = ("adapter_wsg50", "adapter_lab", "electronics_cover")
    holes = {"case": {tap}, "camera_holder": {clear}} | {name: {tap, clear} for name in both}
    for name, diameters in holes.items():
        moved = finger.printed[name].translate(cq.Vector(0, 0.05, 0))
        found = checks.check_fasteners(FINGER, {**finger.printed, name: moved})
        subjects = {result.subject for result in found if not result.passed}
        assert subjects == {f"{name}, {diameter:g} mm" for diameter in diameters}


def test_a_hole_that_was_drilled_too_wide_for_its_thread_is_found(finger: Model) -> None:
    place = Layout(FINGER)
    hole = cylinder((place.rear, place.screw_y, place.rear_screw_z), (-1, 0, 0),
                    FASTENER.tap_mm / 2 + 0.05, place.rear_hole_depth)  # fmt: skip
    wide = cq.Workplane(finger.printed["case"]).cut(hole).val()
    found = checks.check_fasteners(FINGER, {**finger.printed, "case": wide})
    assert [(r.subject, r.value) for r in found if not r.passed] == [
        (f"case, {FASTENER.tap_mm:g} mm", 1)
    ]


def test_a_body_that_meets_another_is_found(finger: Model) -> None:
    bodies = {name: manifold_of(mesh) for name, mesh in finger.body_meshes.items()}
    # A micrometre over the whole of its seat.
    bodies["mirror"] = bodies["mirror"].translate((0.0, 0.0, 1e-3))
    (result,) = checks.check_interference(finger.assembly, bodies)
    assert not result.passed
    assert result.detail == "mirror and case"


def test_a_mirror_behind_a_lip_cannot_be_put_in(finger: Model) -> None:
    place = Layout(FINGER)
    lip = box(
        (place.mirror_x1 - 0.5, place.window_x1 + 0.1),
        (-place.cavity_half - 0.5, place.cavity_half + 0.5),
        (0.1, 0.4),
    )
    closed = cq.Workplane(finger.bodies["case"]).union(lip).val()
    bodies = {name: manifold_of(mesh) for name, mesh in finger.body_meshes.items()}
    bodies["case"] = manifold_of(mesh_of(closed))
    (still,) = checks.check_interference(finger.assembly, bodies)
    assert still.passed, "the lip must be harmless to a mirror that is in its place"
    found = failed(checks.check_insertion(finger.assembly, bodies))
    assert len(found) == 1
    assert found[0].startswith("insertion mirror")


def test_a_thorn_that_only_the_turn_meets_is_found(finger: Model) -> None:
    """Under the swinging foot: out of the way of the mirror in its place."""
    mirror = FINGER.mirror
    x, z = mirror.foot_x_mm + 0.9, mirror.foot_height_mm
    # Under the reflecting face near the foot, which passes there while it turns.
    thorn = box((x, x + 0.3), (-0.15, 0.15), (z - 0.25, z + 0.3))
    bodies = {name: manifold_of(mesh) for name, mesh in finger.body_meshes.items()}
    bodies["case"] = bodies["case"] + manifold_of(mesh_of(thorn.val()))
    (still,) = checks.check_interference(finger.assembly, bodies)
    assert still.passed
    assert [text.split(":")[0] for text in failed(checks.check_insertion(finger.assembly, bodies))]


def test_no_point_moves_farther_than_a_step() -> None:
    way = (Turn((3.0, 0.0, -2.0), -25.0), Shift((0.0, 4.0, -9.0)), Turn((0.0, 0.0, 8.0), 40.0))
    box_ = np.array([[-2.0, -1.0, 0.0], [11.0, 5.0, 4.0]])
    points = np.random.default_rng(0).uniform(*box_, (200, 3))
    before, last = points, 0.0
    for travelled, pose in poses(way, box_, 0.3):
        now = moved(points, pose)
        assert np.linalg.norm(now - before, axis=1).max() <= 0.3 + 1e-9
        assert np.linalg.norm(now - before, axis=1).max() <= travelled - last + 1e-9
        assert np.linalg.norm(pose[:3, :3] @ pose[:3, :3].T - np.eye(3)) < 1e-12
        before, last = now, travelled
    turned = moved(moved(points, way[0].part(1.0)), way[1].part(1.0))
    assert before == pytest.approx(moved(turned, way[2].part(1.0)))


def test_turns_and_shifts_are_told_apart_in_the_order_of_the_way() -> None:
    quarter = Turn((0.0, 0.0, 0.0), 90.0)
    assert moved(np.array([[0.0, 5.0, 2.0]]), quarter.part(1.0)) == pytest.approx(
        np.array([[2.0, 5.0, 0.0]])  # from z toward x
    )
    other = Turn((3.0, 0.0, -2.0), -25.0)
    way = (Shift((1.0, 0.0, 2.0)), quarter, Shift((0.0, 4.0, -9.0)), other)
    assert straight(way) == pytest.approx([1.0, 4.0, -7.0])
    points = np.random.default_rng(0).uniform(-5, 5, (20, 3))
    after = moved(moved(points, quarter.part(1.0)), other.part(1.0))
    assert moved(points, turned_out(way)) == pytest.approx(after)
    assert straight(way[1:2]) == pytest.approx(np.zeros(3))


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("by", [0.03, 0.3])
def test_a_tight_fit_is_found_on_either_side(side: int, by: float, finger: Model) -> None:
    bodies = {name: manifold_of(mesh) for name, mesh in finger.body_meshes.items()}
    for name, around in (("camera", "camera_holder"), ("acrylic", "case"), ("mirror", "case")):
        moved = {**bodies, name: bodies[name].translate((0.0, side * by, 0.0))}
        found = failed(checks.check_clearances(FINGER, moved))
        assert [text.split(":")[0] for text in found] == [f"clearance {name} in {around}"]
    moved = {**bodies, "camera_holder": bodies["camera_holder"].translate((0.0, side * by, 0.0))}
    found = failed(checks.check_clearances(FINGER, moved))
    assert "clearance camera_holder in case" in {text.split(":")[0] for text in found}


def test_bodies_that_overlap_have_no_gap_however_free_they_are_farther_on() -> None:
    plate = manifold3d.Manifold.cube((5.0, 0.2, 5.0))
    for side in (-1, 1):
        assert _sideways_gap(plate, plate, side) == 0
        apart = plate.translate((0.0, 0.4 * side, 0.0))
        assert _sideways_gap(plate, apart, side) == pytest.approx(0.2, abs=2e-3)


def test_a_mirror_too_near_the_acrylic_is_found(finger: Model) -> None:
    bodies = {name: manifold_of(mesh) for name, mesh in finger.body_meshes.items()}
    bodies["mirror"] = bodies["mirror"].translate((0.0, 0.0, -0.05))
    found = failed(checks.check_clearances(FINGER, bodies))
    assert [text.split(":")[0] for text in found] == ["clearance mirror over acrylic"]


def test_something_in_the_light_is_found(finger: Model) -> None:
    x = FINGER.acrylic.tip_offset_mm + FINGER.acrylic.length_mm / 2
    paths = trace(FINGER, np.array([[x, 0.0]]))
    # Near the pupil light has left the mirror; near the acrylic it has not yet met it.
    for near in (paths.mirror + 0.95 * (paths.pupil - paths.mirror), paths.acrylic):
        speck = trimesh.creation.box((0.3, 0.3, 0.3), trimesh.transformations.translation_matrix(
            near[0] + [0, 0, 0.3]))  # fmt: skip
        results = checks.check_sight(FINGER, {**finger.body_meshes, "speck": speck})
        assert [text.split(":")[0] for text in failed(results)] == ["sight rays blocked by a body"]


def test_a_mirror_cut_too_short_for_the_pad_is_found(finger: Model) -> None:
    short = replace(FINGER, mirror=replace(FINGER.mirror, length_mm=FINGER.mirror.length_mm - 3))
    meshes = {**finger.body_meshes, "mirror": mesh_of(mirror(short))}
    found = failed(checks.check_sight(FINGER, meshes))
    assert "sight rays that miss the mirror" in {text.split(":")[0] for text in found}


@pytest.mark.parametrize(
    ("figure", "subject", "good", "bad"),
    [
        ("keystone", "keystone", 0.3, 0.29),
        ("pixel_margin", "margin in the picture", 10.0, 9.9),
    ],
)
def test_a_pad_seen_too_narrow_or_too_near_the_edge_is_found(
    figure: str, subject: str, good: float, bad: float, finger: Model,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    for value, found in ((good, []), (bad, [f"sight {subject}"])):
        monkeypatch.setattr(f"cad.checks.sight.{figure}", lambda *_, value=value: value)
        results = checks.check_sight(FINGER, finger.body_meshes)
        assert [text.split(":")[0] for text in failed(results)] == found


@pytest.mark.parametrize("lens", ["equidistant", "pinhole"])
def test_the_direct_view_is_the_acrylic_s_outline_in_the_picture(lens: str, finger: Model) -> None:
    camera, place = replace(FINGER.camera, projection=lens), Layout(FINGER)
    design = replace(FINGER, camera=camera)
    x = place.window_x0 + np.array([0, 1, 1, 0]) * (place.acrylic_x1 - place.window_x0)
    corners = np.stack([x, place.acrylic_half * np.array([-1, -1, 1, 1]), np.zeros(4)], 1)
    ways = np.roll(corners, -1, axis=0) - corners
    edge = (corners[:, None] + np.linspace(0, 1, 200)[:, None] * ways[:, None]).reshape(-1, 3)
    pixels = project(camera, edge - [camera.pupil_x_mm, 0.0, camera.pupil_z_mm])
    picture = np.zeros((camera.height_px, camera.width_px), np.uint8)
    cv2.fillPoly(picture, [np.round(pixels).astype(np.int32)], 1)
    (shown,) = [r for r in checks.check_sight(design, finger.body_meshes) if "direct" in r.subject]
    (bare,) = re.findall(r"([\d.]+) % without", shown.detail)
    assert float(bare) == pytest.approx(100 * picture.mean(), abs=0.5)


@pytest.mark.parametrize("name", ["standard", "finger"])
def test_without_its_baffle_the_camera_sees_the_pad_directly(
    name: str, request: pytest.FixtureRequest
) -> None:
    built: Model = request.getfixturevalue(name)
    design, place = built.design, Layout(built.design)
    low = box(
        (place.window_x1 - 0.1, place.tunnel_x0 + 0.1),
        (-place.cavity_half, place.cavity_half),
        (0.3, place.baffle_z(place.tunnel_x0) + 0.1),
    )
    cut = cq.Workplane(case(design)).cut(low).val()
    figures = {}
    for state, mesh in (("with", built.body_meshes["case"]), ("without", mesh_of(cut))):
        results = checks.check_sight(design, {**built.body_meshes, "case": mesh})
        figures[state] = next(r for r in results if r.subject.startswith("direct"))
    assert figures["without"].value > 2 * figures["with"].value
    if design is STANDARD:
        assert not figures["without"].passed, figures


def test_a_result_keeps_its_bound_and_not_a_number_never_does() -> None:
    result = checks.Result("c", "s", 1.0, "mm", 1.0, "at least")
    assert result.passed
    assert not replace(result, value=0.99).passed
    assert not replace(result, value=1.01, sense="at most").passed
    assert not replace(result, value=np.nan).passed
    assert not replace(result, value=np.nan, sense="at most").passed
