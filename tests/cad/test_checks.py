# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Both designs pass every check, and each check fails on the fault it is there to find."""

from dataclasses import replace

import cadquery as cq
import numpy as np
import pytest
import trimesh

from cad import checks
from cad.build import Model, run_checks
from cad.features import box
from cad.layout import Layout
from cad.mesh import manifold_of, mesh_of
from cad.motions import Shift, Turn, moved, poses
from cad.optics import faulty_pictures
from cad.parts.case import case
from cad.parts.mold import mold_curved
from sensor.design import FINGER


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


def test_a_knife_edge_is_no_wall() -> None:
    wedge = cq.Workplane("XZ").polyline([(0, 0), (20, 0), (0, 10)]).close().extrude(10)
    assert checks.check_walls("wedge", mesh_of(wedge.val())).passed


def test_overhang_is_the_area_of_the_roof_between_two_legs() -> None:
    table = box((0, 30), (0, 10), (0, 10)).cut(box((5, 25), (-1, 11), (-1, 8)))
    result = checks.check_overhang("table", mesh_of(table.val()))
    assert result.value == pytest.approx(100 * 200 / table.val().Area(), rel=1e-6)


def test_a_part_that_would_need_support_is_found() -> None:
    mushroom = box((4, 6), (4, 6), (0, 10)).union(box((0, 10), (0, 10), (10, 12)))
    result = checks.check_overhang("mushroom", mesh_of(mushroom.val()))
    assert result.value == pytest.approx(100 * 96 / mushroom.val().Area(), rel=1e-6)
    assert not result.passed


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
    assert failed(checks.check_solids({name: finger.on_bed[name]}, {name: torn}))
    assert not failed(checks.check_solids({name: finger.on_bed[name]}, {name: whole}))


def test_a_mold_with_another_curvature_is_found() -> None:
    off = replace(FINGER, gel=replace(FINGER.gel, semi_axis_across_mm=50.0))
    meshes = mesh_of(mold_curved(off)), mesh_of(mold_curved(FINGER))
    halves = {"mold_curved": meshes[0], "mold_flat": meshes[1]}
    first, _ = checks.check_mold(FINGER, halves)
    # At the cavity's edge, y = 4.7 mm: the sag differs by about y²/2 (60/50² - 1/60).
    assert first.value == pytest.approx(4.7**2 / 2 * (60 / 50**2 - 1 / 60), rel=0.1)
    assert not first.passed


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
    moved = finger.printed["case"].translate(cq.Vector(0, 0.05, 0))
    found = failed(checks.check_fasteners(FINGER, {**finger.printed, "case": moved}))
    assert [text.split(":")[0] for text in found] == ["fasteners case, 1.6 mm"]


def test_a_body_that_meets_another_is_found(finger: Model) -> None:
    bodies = {name: manifold_of(mesh) for name, mesh in finger.body_meshes.items()}
    bodies["mirror"] = bodies["mirror"].translate((0.0, 0.0, 0.2))
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


def test_a_tight_fit_is_found(finger: Model) -> None:
    bodies = {name: manifold_of(mesh) for name, mesh in finger.body_meshes.items()}
    bodies["camera"] = bodies["camera"].translate((0.0, 0.03, 0.0))
    found = failed(checks.check_clearances(FINGER, bodies))
    assert [text.split(":")[0] for text in found] == ["clearance camera in camera_holder"]


def test_something_in_the_light_is_found(finger: Model) -> None:
    x = FINGER.acrylic.tip_offset_mm + FINGER.acrylic.length_mm / 2
    speck = mesh_of(solid((x, x + 0.5), (-0.25, 0.25), (0.5, 1.0)))
    results = checks.check_sight(FINGER, {**finger.body_meshes, "speck": speck})
    assert any(text.startswith("sight rays blocked") for text in failed(results))


def test_without_its_baffle_the_camera_sees_the_pad_directly(finger: Model) -> None:
    place = Layout(FINGER)
    low = box(
        (place.window_x1 - 0.1, place.tunnel_x0 + 0.1),
        (-place.cavity_half, place.cavity_half),
        (0.3, place.baffle_z(place.tunnel_x0) + 0.1),
    )
    cut = cq.Workplane(case(FINGER)).cut(low).val()
    figures = {}
    for name, mesh in (("with", finger.body_meshes["case"]), ("without", mesh_of(cut))):
        results = checks.check_sight(FINGER, {**finger.body_meshes, "case": mesh})
        figures[name] = next(r for r in results if r.subject.startswith("direct")).value
    assert figures["without"] > 2 * figures["with"]


def test_a_result_keeps_its_bound_and_not_a_number_never_does() -> None:
    result = checks.Result("c", "s", 1.0, "mm", 1.0, "at least")
    assert result.passed
    assert not replace(result, value=0.99).passed
    assert not replace(result, value=1.01, sense="at most").passed
    assert not replace(result, value=np.nan).passed
    assert not replace(result, value=np.nan, sense="at most").passed
