# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the pictures show: parts, the sensor whole, pulled apart, cut open, and step by step."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import trimesh

from cad.exports.pictures import (
    FROM_A_LOW_CORNER,
    FROM_ABOVE,
    FROM_BEHIND,
    FROM_BELOW,
    FROM_THE_SIDE,
    Item,
    Painter,
    tube,
)
from cad.manifolds import manifold_of, mesh_of_manifold
from cad.motions import Vector, straight, turned_out
from cad.optics import pad_center_x_mm, trace
from cad.steps import Assembly, Step
from sensor.design import Wedge

Meshes = Mapping[str, trimesh.Trimesh]

_COLORS: dict[str, Vector] = {
    "case": (0.32, 0.33, 0.36),
    "camera_holder": (0.30, 0.48, 0.75),
    "adapter_wsg50": (0.80, 0.62, 0.38),
    "electronics_cover": (0.55, 0.68, 0.52),
    "acrylic": (0.62, 0.86, 0.96),
    "mirror": (0.82, 0.84, 0.88),
    "gel": (0.62, 0.60, 0.58),
    "camera": (0.15, 0.45, 0.25),
    "csi_hdmi_board": (0.12, 0.40, 0.32),
    "resistor_board": (0.30, 0.55, 0.30),
    "led_array_red": (0.92, 0.30, 0.25),
    "led_array_green": (0.30, 0.75, 0.35),
    "led_array_blue": (0.30, 0.45, 0.92),
    "gray_filter_side": (0.35, 0.35, 0.38),
    "gray_filter_base": (0.35, 0.35, 0.38),
    "diffuser_side": (0.96, 0.96, 0.90),
    "diffuser_base": (0.96, 0.96, 0.90),
}
_BRASS: Vector = (0.85, 0.70, 0.30)
_STEEL: Vector = (0.70, 0.71, 0.73)
_PRINT: Vector = (0.62, 0.68, 0.76)
_FADED: Vector = (0.82, 0.83, 0.85)
_LIGHT: Vector = (0.98, 0.62, 0.08)


def color_of(part: str) -> Vector:
    """The colour a part has in every picture and in the three-dimensional view."""
    return _COLORS.get(part, _BRASS if part.startswith("pin_") else _STEEL)


@dataclass(frozen=True)
class Subject:
    """All that pictures are drawn from; it travels to the process that draws them."""

    design: Wedge
    assembly: Assembly
    bodies: Meshes
    """In their places."""
    printed: Meshes
    """As they stand on the printer's bed."""

    def names(self) -> list[str]:
        """Every picture, named as its file is."""
        steps = [f"step_{number + 1:02d}" for number in range(len(self.assembly.steps))]
        parts = [f"part_{name}" for name in self.printed]
        return ["assembled_above", "assembled_below", "exploded", "section", *parts, *steps]


def draw(subject: Subject, names: Sequence[str]) -> dict[str, bytes]:
    """Some of the pictures as PNG, by name."""
    painter = Painter()
    return {name: painter.png(*_picture(subject, name)) for name in names}


def _picture(subject: Subject, name: str) -> tuple[list[Item], Vector]:
    """What is drawn, and from where."""
    assembly, bodies = subject.assembly, subject.bodies
    kind, _, rest = name.partition("_")
    if kind == "part":
        return [Item(subject.printed[rest], _PRINT)], FROM_ABOVE
    if kind == "step":
        return _step(assembly, bodies, assembly.steps[int(rest) - 1])
    if name == "exploded":
        return list(_exploded(assembly, bodies)), FROM_A_LOW_CORNER
    if name == "section":
        return list(_section(subject.design, assembly, bodies)), FROM_THE_SIDE
    whole = list(_items(assembly, bodies, list(assembly.bodies)))
    return whole, FROM_ABOVE if rest == "above" else FROM_BELOW


def _items(
    assembly: Assembly, bodies: Meshes, names: Sequence[str], faded: bool = False
) -> Iterator[Item]:
    for name in names:
        yield Item(bodies[name], _FADED if faded else color_of(assembly.bodies[name].part))


def pulled_apart(assembly: Assembly) -> dict[str, np.ndarray]:
    """Where each body moves in the exploded view: along its way, what goes in later farther."""
    shift = {name: np.zeros(3) for name in assembly.bodies}
    for step in assembly.steps:
        for name in assembly.moving(step):
            way = straight(assembly.way(step, name))
            length = float(np.linalg.norm(way))
            if length and assembly.standing(step):
                shift[name] += way / length * _apart(step)
    return shift


def _exploded(assembly: Assembly, bodies: Meshes) -> Iterator[Item]:
    shift = pulled_apart(assembly)
    for name, body in assembly.bodies.items():
        moved = bodies[name].copy()
        moved.apply_translation(shift[name])
        yield Item(moved, color_of(body.part))


def _apart(step: Step) -> float:
    """How far, in mm, a step's bodies lie apart in the exploded view."""
    far = {
        "mirror": 14.0, "lights": 24.0, "window": 38.0, "gel": 10.0, "gray_filter": 5.0,
        "diffuser": 9.0, "pins": 24.0, "camera": 20.0, "camera_into_case": 16.0,
        "rear_screws": 52.0, "adapter": 16.0, "roof_screws": 36.0, "board": 14.0,
        "board_screws": 24.0, "resistor_board": 36.0, "cover_into_place": 60.0,
        "cover_screws": 76.0,
    }  # fmt: skip
    return far.get(step.id, 10.0)


def _section(design: Wedge, assembly: Assembly, bodies: Meshes) -> Iterator[Item]:
    """The half of the sensor behind y = 0, with the light's path from five points of the pad."""
    for name, body in assembly.bodies.items():
        half = manifold_of(bodies[name]).trim_by_plane((0.0, 1.0, 0.0), 0.0)
        if half.num_tri():
            yield Item(mesh_of_manifold(half), color_of(body.part))
    length = design.gel.pad_length_mm
    x = pad_center_x_mm(design) + np.linspace(-length / 2, length / 2, 5)
    paths = trace(design, np.column_stack([x, np.zeros(5)]))
    forward = np.array([0.0, -0.3, 0.0])
    for bends in zip(paths.skin, paths.gel, paths.acrylic, paths.mirror, strict=True):
        line = np.array([*bends, paths.pupil]) + forward
        yield Item(tube(line.tolist(), 0.004 * length + 0.04), _LIGHT, edges=False)


def _step(assembly: Assembly, bodies: Meshes, step: Step) -> tuple[list[Item], Vector]:
    """What stands is faded; what this step adds is coloured and drawn a little before its place."""
    standing = assembly.standing(step)
    items = list(_items(assembly, bodies, standing, faded=True))
    whole_way = np.zeros(3)
    for name in assembly.moving(step):
        mesh, way = bodies[name].copy(), straight(assembly.way(step, name))
        length = float(np.linalg.norm(way))
        if standing and length:
            mesh.apply_transform(turned_out(assembly.way(step, name)))
            mesh.apply_translation(way / length * min(12.0, length))
        whole_way += way
        items.append(Item(mesh, color_of(assembly.bodies[name].part)))
    if not standing or whole_way[2] > np.abs(whole_way[:2]).max():
        return items, FROM_ABOVE
    return items, FROM_BEHIND if whole_way[0] > -whole_way[2] else FROM_BELOW
