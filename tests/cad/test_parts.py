# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Volumes that formulas give, and shapes that must follow the design."""

import math
from dataclasses import replace

import cadquery as cq
import manifold3d
import numpy as np
import pytest

from cad.build import Model
from cad.checks.fit import common_mm3
from cad.features import SEGMENTS, box, cylinder, digits, one_solid
from cad.layout import PLATE, Layout
from cad.manifolds import manifold_of
from cad.mesh import DEFLECTION_MM, mesh_of
from cad.parts import bought, electronics_cover
from cad.parts.case import case
from cad.parts.coupons import acrylic_coupon, camera_coupon
from cad.parts.gripper_adapter import LAB, WSG_50
from cad.parts.jigs import ball_jig, ball_jig_volume_mm3
from cad.parts.mold import gel_pad, mold_curved, mold_flat
from cad.tables import fastener
from sensor.design import FINGER, STANDARD, Gel, Wedge
from sensor.errors import WedgeError

GELS = {
    "standard": STANDARD.gel,
    "finger": FINGER.gel,
    "three axes": replace(STANDARD.gel, semi_axis_across_mm=70.0, semi_axis_normal_mm=55.0),
    "nearly flat": replace(FINGER.gel, semi_axis_along_mm=900.0, semi_axis_across_mm=800.0),
}


def gel_volume(gel: Gel) -> float:
    """Integral of the ellipsoid's height over the pad, by Gauss and Legendre."""
    nodes, weights = np.polynomial.legendre.leggauss(24)
    x, y = nodes * gel.pad_length_mm / 2, nodes * gel.pad_width_mm / 2
    heights = np.array([[gel.thickness_at_mm(a, b) for b in y] for a in x])
    return float(weights @ heights @ weights) * gel.pad_length_mm * gel.pad_width_mm / 4


@pytest.mark.parametrize("gel", GELS.values(), ids=GELS)
def test_the_gel_has_the_volume_of_its_integral(gel: Gel) -> None:
    assert gel_pad(gel).Volume() == pytest.approx(gel_volume(gel), rel=1e-6)


@pytest.mark.parametrize("gel", GELS.values(), ids=GELS)
def test_the_gel_fills_its_pad_and_reaches_its_apex(gel: Gel) -> None:
    low, high = mesh_of(gel_pad(gel)).bounds
    assert high - low == pytest.approx(
        [gel.pad_length_mm, gel.pad_width_mm, gel.thickness_mm], abs=DEFLECTION_MM
    )
    assert high[2] == pytest.approx(0, abs=1e-9)


def test_the_two_molds_differ_by_the_gels_they_cast() -> None:
    gel = STANDARD.gel
    flat = gel.pad_length_mm * gel.pad_width_mm * gel.thickness_mm
    more = mold_curved(STANDARD).Volume() - mold_flat(STANDARD).Volume()
    # The notches of both are the same and end at the pad's edge.
    assert more == pytest.approx(flat - gel_volume(gel), rel=1e-4)


def test_the_ball_jig_is_its_cylinders_less_a_part_of_a_sphere() -> None:
    assert ball_jig(FINGER).Volume() == pytest.approx(ball_jig_volume_mm3(), rel=1e-9)


def test_the_coupon_has_each_screw_hole_once_as_the_case_has_it() -> None:
    for press in (0.05, 0.15):
        design = replace(STANDARD, printing=replace(STANDARD.printing, press_clearance_mm=press))
        faces = camera_coupon(design).faces("%CYLINDER").Faces()
        widths = [round(face.BoundingBox().ylen, 3) for face in faces]
        size = fastener(design.fastening.screw)
        assert sorted(width for width in widths if width > 1) == [size.tap_mm, size.clearance_mm]


def test_cut_parts_have_the_volume_of_their_boxes() -> None:
    mirror = STANDARD.mirror
    expected = mirror.length_mm * mirror.width_mm * mirror.thickness_mm
    assert bought.mirror(STANDARD).Volume() == pytest.approx(expected)
    film = Layout(STANDARD).film_ranges["base"]
    sheet = bought.film(STANDARD, "diffuser", "green").Volume()
    thickness = Layout(STANDARD).films["diffuser"]
    assert sheet == pytest.approx((film[1] - film[0]) * STANDARD.acrylic.thickness_mm * thickness)


def test_the_case_is_as_large_as_the_design_says(standard: Model, finger: Model) -> None:
    for built in (standard, finger):
        design, bounds = built.design, built.printed["case"].BoundingBox(tolerance=1e-4)
        assert bounds.xlen == pytest.approx(design.housing.case_length_mm, abs=1e-3)
        assert bounds.ylen == pytest.approx(design.outer_width_mm, abs=1e-3)
        height = design.housing.roof_z_mm + design.acrylic.thickness_mm
        assert bounds.zlen == pytest.approx(height, abs=1e-3)


def test_the_mirror_lies_at_its_angle_on_its_foot() -> None:
    for design in (STANDARD, FINGER):
        faces = bought.mirror(design).Faces()
        normals = [face.normalAt() for face in faces if face.Area() > 100]
        tilts = {round(math.degrees(math.acos(abs(normal.z))), 6) for normal in normals}
        assert tilts == {design.mirror.angle_deg}
        assert bought.mirror(design).BoundingBox(tolerance=1e-4).zmin == pytest.approx(
            design.mirror.foot_height_mm, abs=1e-3
        )


def test_no_light_pocket_at_the_tip(finger: Model) -> None:
    place = Layout(FINGER)
    # A box between tip face and first LED, beside the acrylic, must be all case but for the pins.
    x, y = (0.0, place.acrylic_x0 + 1.7), (place.acrylic_half + 0.7, place.outer_half)
    probe = cq.Workplane().box(x[1], y[1] - y[0], 4.0, centered=False)
    probe = probe.translate((0, y[0], -4.2))
    common = finger.printed["case"].intersect(probe.val()).Volume()
    assert common == pytest.approx(probe.val().Volume(), rel=1e-6)


def test_the_mark_is_the_designs_hash(finger: Model) -> None:
    other = replace(FINGER, printing=replace(FINGER.printing, layer_mm=0.2))
    assert other.sha256 != FINGER.sha256
    assert case(other).Volume() != pytest.approx(finger.printed["case"].Volume(), abs=1e-3)
    assert case(replace(FINGER, name="other name")).Volume() == pytest.approx(
        finger.printed["case"].Volume()
    )


def test_every_hexadecimal_digit_is_drawn_differently() -> None:
    drawn = {tuple(digits(digit, 3.0, 0.4)) for digit in "0123456789abcdef"}
    assert len(drawn) == len(SEGMENTS) == 16


def test_an_empty_boolean_is_caught() -> None:
    nothing = (
        cq.Workplane().box(1, 1, 1).intersect(cq.Workplane().box(1, 1, 1).translate((5, 0, 0)))
    )
    with pytest.raises(WedgeError, match="the probe came out as 0 bodies"):
        one_solid(nothing, "the probe")


@pytest.mark.parametrize("size", ["M2", "M2.5", "M3", "M4"])
def test_fasteners_are_consistent(size: str) -> None:
    row = fastener(size)
    assert row.thread_mm == float(size[1:])
    # ISO 68-1: the core of a thread is its diameter less 1.2269 pitches.
    assert row.core_mm == pytest.approx(row.thread_mm - 1.2269 * row.pitch_mm, abs=2e-3)
    assert row.core_mm < row.tap_mm < row.thread_mm < row.clearance_mm < row.head_diameter_mm


def holes_at(solid: cq.Solid, z: float) -> list[np.ndarray]:
    """Lowest and highest corners of the holes in a level slice, from left to right."""
    rings = manifold_of(mesh_of(solid)).slice(z).to_polygons()
    boxes = [np.stack([ring.min(axis=0), ring.max(axis=0)]) for ring in map(np.asarray, rings)]
    largest = max(boxes, key=lambda box: float(np.ptp(box, axis=0).prod()))
    return sorted((box for box in boxes if box is not largest), key=lambda box: box[0, 0])


def test_more_dots_on_a_coupon_mean_a_looser_fit() -> None:
    size, press = STANDARD.camera.head_size_mm, STANDARD.printing.press_clearance_mm
    coupon = camera_coupon(STANDARD)
    sockets = [hole for hole in holes_at(coupon, 2.5) if np.ptp(hole[:, 0]) > 4]
    dots = [hole for hole in holes_at(coupon, 4.8) if np.ptp(hole[:, 0]) < 1]
    cell = sockets[1][0, 0] - sockets[0][0, 0]
    for count, socket in enumerate(sockets, start=1):
        middle = socket.mean(axis=0)
        near = [dot for dot in dots if abs(dot.mean(axis=0)[0] - middle[0]) < cell / 2]
        assert len(near) == count
        fit = size + 2 * (press + 0.05 * (count - 2))
        assert np.ptp(socket, axis=0) == pytest.approx([fit, fit], abs=1e-3)
    gauges = holes_at(acrylic_coupon(STANDARD), 2.5)
    whole, width = manifold_of(mesh_of(acrylic_coupon(STANDARD))), STANDARD.acrylic.width_mm
    seats = sorted(gauges, key=lambda hole: hole[0, 1])
    dots = [hole for hole in holes_at(acrylic_coupon(STANDARD), 4.8) if np.ptp(hole[:, 0]) < 1]
    for count, seat in enumerate(seats, start=1):
        below = [dot for dot in dots if 0 < seat[0, 1] - dot.mean(axis=0)[1] < 2.5]
        assert len(below) == count
        step = 0.05 * (count - 2)  # the pins' notches reach farthest
        edge = seat.mean(axis=0)[0] + width / 2 + press + step
        for at, is_open in ((edge - 0.01, True), (edge + 0.01, False)):
            cube = manifold3d.Manifold.cube((0.01, 0.01, 1.0), True)
            probe = cube.translate((at, seat[1, 1] - 0.5, 2.5))
            assert (common_mm3(whole, probe) < 1e-9) is is_open
        notch = width / 2 + 0.1 + Layout(STANDARD).pin_hole_radius + step
        assert np.ptp(seat[:, 0]) == pytest.approx(2 * notch, abs=0.01)


@pytest.mark.parametrize("name", ["standard", "finger"])
def test_the_caliper_s_jig_goes_over_the_sensor_and_shows_the_pad_s_ends(
    name: str, request: pytest.FixtureRequest
) -> None:
    built: Model = request.getfixturevalue(name)
    design, place = built.design, Layout(built.design)
    jig = manifold_of(mesh_of(built.printed["caliper_jig"]))
    for body in ("case", "acrylic", "gel"):
        upside_down = manifold_of(built.body_meshes[body]).rotate((180.0, 0.0, 0.0))
        assert common_mm3(jig, upside_down.translate((0.0, 0.0, place.bottom))) < 0.01, body
    middle, gel = (place.acrylic_x0 + place.acrylic_x1) / 2, design.gel
    for half, axis in ((gel.pad_length_mm / 2, 0), (gel.pad_width_mm / 2, 1)):
        for side in (-1, 1):
            for share, is_open in ((0.99, True), (1.01, False)):
                at = np.array([middle, 0.0, gel.thickness_mm + 2.5])
                at[axis] += side * share * half
                probe = manifold3d.Manifold.cube((0.02, 0.02, 1.0), True).translate(tuple(at))
                assert (common_mm3(jig, probe) < 1e-9) is is_open


@pytest.mark.parametrize("name", ["standard", "finger"])
def test_ribbon_plug_and_sunk_heads_have_their_openings(
    name: str, request: pytest.FixtureRequest
) -> None:
    built: Model = request.getfixturevalue(name)
    design, place = built.design, Layout(built.design)
    roof, wiring = design.housing.roof_z_mm, design.wiring
    sill = roof - design.compartment.height_mm + electronics_cover.WALL

    parts = {
        name: manifold_of(mesh_of(built.printed[name]))
        for name in ("electronics_cover", "adapter_wsg50", "adapter_lab")
    }

    def free(part: str, probe: cq.Workplane) -> bool:
        return common_mm3(parts[part], manifold_of(mesh_of(probe.val()))) < 1e-6

    half = wiring.ribbon_width_mm / 2
    ribbon = box((place.cover_x0 - 1, place.cover_x0 + 3), (-half, half), (sill, sill + 0.5))
    assert free("electronics_cover", ribbon)
    wide, high = bought.PLUG
    z = electronics_cover.board_z(place) + bought.BOARD[2]
    plug = box((place.plate_x1 - 3, place.plate_x1 + 3), (-wide / 2, wide / 2), (z, z + high))
    assert free("electronics_cover", plug)
    middle = (place.cover_x0 + place.plate_x1) / 2
    for part, pattern in (("adapter_wsg50", WSG_50), ("adapter_lab", LAB)):
        size = fastener(pattern.screw)
        for along, across in pattern.places:
            at = (middle + along, across, roof - 0.01)
            head = cylinder(at, (0, 0, 1), size.head_diameter_mm / 2, size.head_height_mm)
            assert free(part, head), part
            remains = cylinder(
                (middle + along, across, roof + PLATE), (0, 0, -1), size.head_diameter_mm / 2, 1.8
            )
            assert not free(part, remains)


@pytest.mark.parametrize("design", [STANDARD, FINGER], ids=lambda design: design.name)
def test_the_least_compartment_just_holds_its_boards_under_tape(design: Wedge) -> None:
    least = bought.compartment_height_mm()
    tight = replace(design, compartment=replace(design.compartment, height_mm=least))
    tops = [
        part(tight).BoundingBox(tolerance=1e-4).zmax
        for part in (bought.resistor_board, bought.csi_hdmi_board)
    ]
    assert max(tops) + bought.TAPE == pytest.approx(design.housing.roof_z_mm, abs=1e-2)


@pytest.mark.parametrize("screw", ["M2", "M2.5"])
def test_the_resistor_board_lies_on_the_socket_and_beside_the_screws(screw: str) -> None:
    design = replace(STANDARD, fastening=replace(STANDARD.fastening, screw=screw))
    adapter, board = bought.csi_hdmi_board(design), bought.resistor_board(design)
    reach = board.BoundingBox()
    below = board.translate(cq.Vector(0, 0, -bought.TAPE - 0.01))
    assert below.intersect(adapter).Volume() > 0.01 * 5 * reach.ylen * 0.5  # on the socket
    assert board.intersect(adapter).Volume() == pytest.approx(0, abs=1e-9)
    head = fastener(screw).head_diameter_mm / 2
    place = Layout(design)
    for along, across in electronics_cover.POSTS:
        if electronics_cover.board_x(place) + along + head > reach.xmin:
            assert abs(across) - head > reach.ymax


@pytest.mark.parametrize("length_mm", [40.0, 42.0, 60.0])
def test_the_socket_is_as_long_and_as_near_the_back_in_every_cover(length_mm: float) -> None:
    design = replace(STANDARD, compartment=replace(STANDARD.compartment, length_mm=length_mm))
    shipped, place = bought.csi_hdmi_board(STANDARD).BoundingBox(), Layout(design)
    box = bought.csi_hdmi_board(design).BoundingBox()
    assert box.xlen == pytest.approx(shipped.xlen, abs=1e-6)
    assert place.plate_x1 - box.xmax == pytest.approx(bought.PLUG_INSET, abs=1e-6)
    assert box.xmin > place.cover_x0 + electronics_cover.WALL
