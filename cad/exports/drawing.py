# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A dimensioned drawing of what must be right: section and view of the face, as SVG in mm."""

from collections.abc import Mapping, Sequence

import manifold3d
import numpy as np
import trimesh

from cad.layout import Layout
from cad.mesh import manifold_of
from cad.optics import pad_centre_x_mm
from sensor.design import Wedge

_SHOWN = {
    "case": "#d9d9dd",
    "camera_holder": "#c3d4ee",
    "mirror": "#ffffff",
    "acrylic": "#d8f1fb",
    "gel": "#e3ddd6",
    "camera": "#cfe6d5",
}
_MARGIN = 24.0


def drawing_of(design: Wedge, meshes: Mapping[str, trimesh.Trimesh]) -> bytes:
    """The drawing of a design."""
    place = Layout(design)
    bodies = {name: manifold_of(meshes[name]) for name in _SHOWN}
    high, low = design.housing.roof_z_mm, place.bottom - design.gel.thickness_mm
    gap = 2 * place.outer_half + high - low + 3 * _MARGIN
    width, height = place.rear + 2.0 + 2 * _MARGIN, gap + _MARGIN
    section = [
        _polygons(body.rotate((90.0, 0.0, 0.0)).slice(0.0), 1.0, _SHOWN[name])
        for name, body in bodies.items()
    ]
    face = [
        _polygons(bodies[name].project(), -1.0, _SHOWN[name]) for name in ("case", "acrylic", "gel")
    ]
    top = _MARGIN + high
    middle = top - low + _MARGIN * 1.5 + place.outer_half
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.1f}mm" height="{height:.1f}mm"'
        f' viewBox="0 0 {width:.1f} {height:.1f}" font-family="sans-serif" font-size="2.6">',
        f'<rect width="{width:.1f}" height="{height:.1f}" fill="#fff"/>',
        f'<text x="4" y="6" font-size="3.4">GelSight Wedge {design.name},'
        f" design {design.sha256[:8]}: critical dimensions in mm and degrees</text>",
        '<text x="4" y="11">section through the middle, and the face that touches</text>',
        f'<g transform="translate({_MARGIN} {top:.2f})">',
        *section,
        *_section_dimensions(place),
        "</g>",
        f'<g transform="translate({_MARGIN} {middle:.2f})">',
        *face,
        *_face_dimensions(place),
        "</g>",
        "</svg>",
    ]
    return ("\n".join(lines) + "\n").encode()


def _polygons(cut: manifold3d.CrossSection, flip: float, fill: str) -> str:
    """Closed outlines of a flat cut; its second axis points down for ``flip`` = 1."""
    path = ""
    for polygon in cut.to_polygons():
        points = " ".join(f"{x:.3f},{-flip * y + 0.0:.3f}" for x, y in np.asarray(polygon))
        path += f"M{points}Z"
    return f'<path d="{path}" fill="{fill}" stroke="#333" stroke-width="0.15" fill-rule="evenodd"/>'


def _section_dimensions(place: Layout) -> list[str]:
    design = place.design
    mirror, camera, gel = design.mirror, design.camera, design.gel
    low, high = place.bottom - gel.thickness_mm, design.housing.roof_z_mm
    x_far = place.rear + 8
    tip = (mirror.foot_x_mm, -mirror.foot_height_mm)
    end = (place.mirror_x1, -place.mirror_top)
    return [
        _across(0, place.rear, -high - 4, f"case {place.rear:g}"),
        _across(place.acrylic_x0, place.acrylic_x1, -low + 4, f"acrylic {design.acrylic.length_mm:g}"),
        _across(0, camera.pupil_x_mm, -low + 9, f"pupil {camera.pupil_x_mm:g}"),
        _across(0, mirror.foot_x_mm, -low + 14, f"mirror's foot {mirror.foot_x_mm:g}"),
        _upright(-6, -place.bottom, 0, f"{design.acrylic.thickness_mm:g}"),
        _upright(-12, -low, -place.bottom, f"{gel.thickness_mm:g}"),
        _upright(x_far, -low, -high, f"{high - low:.1f}"),
        _upright(x_far + 7, -camera.pupil_z_mm, 0, f"pupil {camera.pupil_z_mm:g}"),
        _note((tip[0] + end[0]) / 2 - 2, (tip[1] + end[1]) / 2 - 7,
              f"mirror {mirror.length_mm:g} x {mirror.width_mm:g} x {mirror.thickness_mm:g}"
              f" at {mirror.angle_deg:g}°, foot {mirror.foot_height_mm:g} above the acrylic",
              turn=-mirror.angle_deg),
        _note(camera.pupil_x_mm + 2, -camera.pupil_z_mm - 6, f"pitch {camera.pitch_deg:g}°"),
    ]  # fmt: skip


def _face_dimensions(place: Layout) -> list[str]:
    design = place.design
    middle, half = pad_centre_x_mm(design), place.outer_half
    pad = design.gel
    x = (middle - pad.pad_length_mm / 2, middle + pad.pad_length_mm / 2)
    return [
        _across(*x, half + 5, f"pad {pad.pad_length_mm:g}"),
        _upright(-5, -pad.pad_width_mm / 2, pad.pad_width_mm / 2, f"pad {pad.pad_width_mm:g}"),
        _upright(
            -12, -place.acrylic_half, place.acrylic_half, f"acrylic {design.acrylic.width_mm:g}"
        ),
        _upright(place.rear + 6, -half, half, f"case {2 * half:g}"),
        _upright(
            place.rear + 13,
            -place.screw_y,
            place.screw_y,
            f"{place.screw.screw} {2 * place.screw_y:g}",
        ),
    ]


def _across(x0: float, x1: float, y: float, text: str) -> str:
    return _line(((x0, y), (x1, y)), ((0, 1), (0, 1))) + _note((x0 + x1) / 2, y - 0.8, text)


def _upright(x: float, y0: float, y1: float, text: str) -> str:
    line = _line(((x, y0), (x, y1)), ((1, 0), (1, 0)))
    return line + _note(x - 0.8, (y0 + y1) / 2, text, turn=-90)


def _line(ends: Sequence[tuple[float, float]], ticks: Sequence[tuple[float, float]]) -> str:
    (x0, y0), (x1, y1) = ends
    path = f"M{x0:.3f},{y0:.3f}L{x1:.3f},{y1:.3f}"
    for (x, y), (dx, dy) in zip(ends, ticks, strict=True):
        path += f"M{x - dx:.3f},{y - dy:.3f}L{x + dx:.3f},{y + dy:.3f}"
    return f'<path d="{path}" stroke="#06c" stroke-width="0.18" fill="none"/>'


def _note(x: float, y: float, text: str, turn: float = 0.0) -> str:
    turned = f' transform="rotate({turn:g} {x:.2f} {y:.2f})"' if turn else ""
    return f'<text x="{x:.2f}" y="{y:.2f}" text-anchor="middle" fill="#06c"{turned}>{text}</text>'
