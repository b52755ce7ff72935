# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A dimensioned drawing of what must be right: section and view of the face, as SVG in mm."""

import math
from collections.abc import Iterable, Mapping
from html import escape

import manifold3d
import numpy as np
import trimesh

from cad.layout import FLANGE, Layout
from cad.manifest import size_words
from cad.manifolds import manifold_of
from cad.optics import pad_center_x_mm
from sensor.design import Wedge

_SHOWN = {
    "case": "#d9d9dd",
    "camera_holder": "#c3d4ee",
    "mirror": "#ffffff",
    "acrylic": "#d8f1fb",
    "gel": "#e3ddd6",
    "camera": "#cfe6d5",
}
_LETTER = 0.72
"""Size of the letters over the distance of two lines of text."""


def drawing_of(design: Wedge, meshes: Mapping[str, trimesh.Trimesh]) -> bytes:
    """The drawing of a design."""
    place = Layout(design)
    bodies = {name: manifold_of(meshes[name]) for name in _SHOWN}
    # Turned so that z points up the page: the page's second axis points down.
    section = [
        _polygons(body.rotate((90.0, 0.0, 0.0)).slice(0.0), _SHOWN[name])
        for name, body in bodies.items()
    ]
    face = [_polygons(bodies[name].project(), _SHOWN[name]) for name in ("case", "acrylic", "gel")]
    page = _Page(place)
    corners = np.array([mesh.bounds for mesh in meshes.values()])
    notes = page.notes(corners[:, 1].max(axis=0) - corners[:, 0].min(axis=0))
    high, low = design.housing.roof_z_mm, place.bottom - design.gel.thickness_mm
    left = 8 * page.line
    top = (len(notes) + 5) * page.line + high
    middle = top - low + 11 * page.line + place.outer_half
    width = place.rear + FLANGE + 20 * page.line
    height = middle + place.outer_half + 6 * page.line
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{3 * width:.1f}mm"'
        f' height="{3 * height:.1f}mm" viewBox="0 0 {width:.2f} {height:.2f}"'
        f' font-family="sans-serif" font-size="{page.line * _LETTER:.2f}">',
        f'<rect width="{width:.2f}" height="{height:.2f}" fill="#fff"/>',
        *(
            f'<text x="{page.line:.2f}" y="{(index + 1.5) * page.line:.2f}">{escape(note)}</text>'
            for index, note in enumerate(notes)
        ),
        f'<g transform="translate({left:.2f} {top:.2f})">',
        *section,
        *page.section(),
        "</g>",
        f'<g transform="translate({left:.2f} {middle:.2f})">',
        *face,
        *page.face(),
        "</g>",
        "</svg>",
    ]
    return ("\n".join(lines) + "\n").encode()


def _polygons(cut: manifold3d.CrossSection, fill: str) -> str:
    """Closed outlines of a flat cut."""
    path = ""
    for polygon in cut.to_polygons():
        points = " ".join(f"{x:.3f},{y + 0.0:.3f}" for x, y in np.asarray(polygon))
        path += f"M{points}Z"
    return f'<path d="{path}" fill="{fill}" stroke="#333" stroke-width="0.12" fill-rule="evenodd"/>'


class _Page:
    """Dimension lines and notes, spaced by a line of text that grows with the sensor."""

    def __init__(self, place: Layout) -> None:
        self.place = place
        self.line = max(1.4, 0.045 * place.rear)

    def notes(self, sizes_mm: Iterable[float]) -> list[str]:
        """What no line on the page can say; ``sizes_mm`` are the whole sensor's."""
        design = self.place.design
        mirror, camera, gel = design.mirror, design.camera, design.gel
        shape = "flat" if not gel.curved else (
            f"ellipsoid {gel.semi_axis_along_mm:g} along, {gel.semi_axis_across_mm:g} across,"
            f" {gel.semi_axis_normal_mm:g} normal"
        )  # fmt: skip
        return [
            f"GelSight Wedge {design.name}, design {design.sha256[:8]}, mm and degrees",
            f"only the case is drawn; with cover and gripper adapter {size_words(sizes_mm)}",
            f"mirror {mirror.length_mm:g} x {mirror.width_mm:g} x {mirror.thickness_mm:g} at"
            f" {mirror.angle_deg:g}°, its foot {mirror.foot_height_mm:g} above the acrylic",
            f"camera pitch {camera.pitch_deg:g}°, view {camera.diagonal_view_deg:g}°,"
            f" frames of {camera.width_px} x {camera.height_px} px",
            f"gel {shape}, {gel.corner_thickness_mm:.2f} thick at the corners",
            f"gaps per side: {self.place.slide:g} sliding, {self.place.press:g} pressed;"
            f" threads {self.place.screw.screw}, drilled {self.place.screw.tap_mm:g}",
        ]

    def section(self) -> list[str]:
        """Dimensions of the section."""
        place, line = self.place, self.line
        design = place.design
        camera = design.camera
        low, high = place.bottom - design.gel.thickness_mm, design.housing.roof_z_mm
        far = place.rear + FLANGE
        return [
            self._across(0, place.rear, -high - line, f"case {place.rear:g}"),
            self._angle(design.mirror.foot_x_mm, -design.mirror.foot_height_mm,
                        design.mirror.angle_deg, 0.3 * design.mirror.length_mm),
            self._across(place.acrylic_x0, place.acrylic_x1, 2 * line - low,
                         f"acrylic {design.acrylic.length_mm:g}, {place.acrylic_x0:g} from tip"),
            self._across(0, camera.pupil_x_mm, -low + 4 * line, f"pupil {camera.pupil_x_mm:g}"),
            self._across(0, design.mirror.foot_x_mm, -low + 6 * line,
                         f"mirror's foot {design.mirror.foot_x_mm:g}"),
            self._upright(-1.5 * line, -place.bottom, 0, f"{design.acrylic.thickness_mm:g}"),
            self._upright(-3.5 * line, -low, -place.bottom, f"{design.gel.thickness_mm:g}"),
            self._upright(far + 3 * line, -low, -high, f"{high - low:.1f}"),
            self._upright(far + 6 * line, -camera.pupil_z_mm, 0, f"pupil {camera.pupil_z_mm:g}"),
        ]  # fmt: skip

    def face(self) -> list[str]:
        """Dimensions of the face."""
        place, line = self.place, self.line
        gel, middle = place.design.gel, pad_center_x_mm(place.design)
        half, far = place.outer_half, place.rear
        ends = (middle - gel.pad_length_mm / 2, middle + gel.pad_length_mm / 2)
        screws = f"{place.screw.screw} screws {2 * place.screw_y:g}"
        width = place.design.acrylic.width_mm
        return [
            self._across(*ends, half + 2 * line, f"pad {gel.pad_length_mm:g}"),
            self._upright(
                -1.5 * line,
                -gel.pad_width_mm / 2,
                gel.pad_width_mm / 2,
                f"pad {gel.pad_width_mm:g}",
            ),
            self._upright(-4 * line, -width / 2, width / 2, f"acrylic {width:g}"),
            self._upright(far + 3 * line, -half, half, f"case {2 * half:g}"),
            self._upright(far + 6 * line, -place.screw_y, place.screw_y, screws),
        ]

    def _across(self, x0: float, x1: float, y: float, text: str) -> str:
        tick = 0.4 * self.line
        path = f"M{x0:.3f},{y:.3f}H{x1:.3f}M{x0:.3f},{y - tick:.3f}v{2 * tick:.3f}"
        path += f"M{x1:.3f},{y - tick:.3f}v{2 * tick:.3f}"
        if self._width(text) < x1 - x0:
            return self._drawn(path) + self._text((x0 + x1) / 2, y - 0.3 * self.line, text)
        return self._drawn(path) + self._text(
            x1 + 0.5 * self.line, y + _LETTER * 0.35 * self.line, text, anchor="start"
        )

    def _upright(self, x: float, y0: float, y1: float, text: str) -> str:
        tick = 0.4 * self.line
        path = f"M{x:.3f},{y0:.3f}V{y1:.3f}M{x - tick:.3f},{y0:.3f}h{2 * tick:.3f}"
        path += f"M{x - tick:.3f},{y1:.3f}h{2 * tick:.3f}"
        if self._width(text) < abs(y1 - y0):
            return self._drawn(path) + self._text(x - 0.3 * self.line, (y0 + y1) / 2, text, -90)
        start = min(y0, y1) - 0.7 * self.line
        return self._drawn(path) + self._text(
            x + _LETTER * 0.35 * self.line, start, text, -90, "start"
        )

    def _angle(self, x: float, y: float, degrees: float, radius: float) -> str:
        """An arc that opens from the horizontal upward, its figure beyond the middle."""
        end, half = math.radians(degrees), math.radians(degrees / 2)
        path = f"M{x:.3f},{y:.3f}H{x + 1.15 * radius:.3f}M{x + radius:.3f},{y:.3f}"
        path += f"A{radius:.3f},{radius:.3f} 0 0 0"
        path += f" {x + radius * math.cos(end):.3f},{y - radius * math.sin(end):.3f}"
        beyond = radius + 0.4 * self.line
        place = x + beyond * math.cos(half), y - beyond * math.sin(half) + 0.25 * self.line
        return self._drawn(path) + self._text(*place, f"{degrees:g}°", anchor="start")

    def _width(self, text: str) -> float:
        """Room that a text takes, judged generously."""
        return (0.62 * len(text) + 0.8) * _LETTER * self.line

    def _drawn(self, path: str) -> str:
        return f'<path d="{path}" stroke="#06c" stroke-width="{0.05 * self.line:.3f}" fill="none"/>'

    def _text(self, x: float, y: float, text: str, turn: float = 0, anchor: str = "middle") -> str:
        turned = f' transform="rotate({turn:g} {x:.2f} {y:.2f})"' if turn else ""
        return (
            f'<text x="{x:.2f}" y="{y:.2f}" text-anchor="{anchor}" fill="#06c"{turned}>'
            f"{text}</text>"
        )
