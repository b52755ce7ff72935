# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A design as a scene: acrylic, gel, painted skin, and what shines and reflects at the sides.

Gel frame in mm: origin on the untouched skin at the pad's centre, x to the tip, y down the
picture, z out of the gel. The pad sits in the middle of the acrylic.

Every face refracts: light passes from LED through film and acrylic into the gel, or is kept in the
acrylic where it is too slanted. A rectangle's normal points into the medium named ``ext_ior``.
"""

from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from jaxtyping import Float

from sensor.design import Channel, Wedge
from sensor.fabrication import FLEX_MM
from sensor.toml import Pair
from simulation.skin import Map, View, rest_height_mm

Paint = Literal["gray", "silver"]
Window = tuple[slice, slice]
"""Columns and rows of a part of the picture."""

GRAY_REFLECTANCE: Final = 0.5
"""Of matt silicone paint."""
SILVER: Final = {"diffuse": 0.25, "flake": 0.75, "share": 0.5, "roughness": 0.35}
"""Of semi-specular paint: matt base, metal flakes, the share of light they take, their spread."""
BACKING_REFLECTANCE: Final = 0.5
"""Of the white diffuser and the LEDs behind it, seen from inside the acrylic."""
DIFFUSER_TRANSMISSION: Final = 0.6
"""Of white diffuser film."""
SIDE_START_MM: Final = 1.8
"""Acrylic at its tip end that the case grips, dark on both sides."""
SIDE_END_MM: Final = 1.2
"""The same at its base end."""
PRIMARIES: Final[dict[Channel, tuple[float, float, float]]] = {
    "R": (1.00, 0.08, 0.03),
    "G": (0.06, 1.00, 0.10),
    "B": (0.03, 0.14, 1.00),
}
"""What the camera's red, green and blue make of each LED's colour: a Bayer sensor after its colour
matrix; see docs/concepts/twin.md."""
DEPTH: Final = 16
"""Longest path, in meetings with matter."""
HAIR_MM: Final = 1e-3
"""Between a light and the face that it lies on."""


@dataclass(frozen=True, kw_only=True)
class Side:
    """One side of the acrylic, with a row of LEDs or without."""

    color: Channel
    center_mm: tuple[float, float]
    """Middle of the side in x and y."""
    inward: tuple[float, float]
    length_mm: float
    row_center_mm: tuple[float, float]
    """Middle of the row of LEDs in x and y."""
    leds: int

    @property
    def along(self) -> tuple[float, float]:
        """Unit vector along the side."""
        return -self.inward[1], self.inward[0]


def sides(design: Wedge) -> list[Side]:
    """The three sides that carry lights: red at y > 0, blue at y < 0, green at the base, x < 0."""
    acrylic, lights = design.acrylic, design.lights
    x, y = acrylic.length_mm / 2, acrylic.width_mm / 2
    row_x = (SIDE_END_MM - SIDE_START_MM) / 2
    rows: tuple[tuple[Channel, Pair, Pair, float, Pair, int], ...] = (
        ("R", (0.0, y), (0.0, -1.0), acrylic.length_mm, (row_x, y), lights.red_side_leds),
        ("B", (0.0, -y), (0.0, 1.0), acrylic.length_mm, (row_x, -y), lights.blue_side_leds),
        ("G", (-x, 0.0), (1.0, 0.0), acrylic.width_mm, (-x, 0.0), lights.green_base_leds),
    )
    return [
        Side(
            color=color,
            center_mm=center,
            inward=inward,
            length_mm=length,
            row_center_mm=row,
            leds=count,
        )
        for color, center, inward, length, row, count in rows
    ]


def gel_scene(
    mi: Any,
    design: Wedge,
    view: View,
    depth_mm: Map,
    *,
    window: Window | None = None,
    paint: Paint = "gray",
    ink: Map | None = None,
) -> dict[str, Any]:
    """The gel seen straight on from its foot, as a Mitsuba scene.

    Args:
        mi: Mitsuba, with a variant set.
        design: the sensor.
        view: the pixels, whose centres are the skin's samples.
        depth_mm: indentation of the skin.
        window: the part of the picture to render; all of it by default.
        paint: on the skin.
        ink: share of light that the skin's paint still reflects, 1 where there is no marker.
    """
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": DEPTH, "rr_depth": 8},
        "sensor": _straight_on(mi, design, view, window),
        **_body(mi, design),
        **_lights(mi, design),
        "skin": skin_mesh(mi, design, view, depth_mm, paint=paint, ink=ink),
    }


def skin_mesh(
    mi: Any, design: Wedge, view: View, depth_mm: Map, *, paint: Paint, ink: Map | None
) -> Any:
    """The skin out to the pad's edges, smooth between its samples."""
    length, width = design.pad_size_mm
    x = np.concatenate([[-length / 2], view.x_mm, [length / 2]])
    y = np.concatenate([[-width / 2], view.y_mm, [width / 2]])
    grid_x, grid_y = np.meshgrid(x, y)
    z = rest_height_mm(design.gel, grid_x, grid_y) - np.pad(depth_mm, 1, mode="edge")
    slope_y, slope_x = np.gradient(z, y, x)
    normal = np.stack([slope_x, slope_y, -np.ones_like(z)], -1)
    rows, columns = z.shape
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    right, below = corner + 1, corner + columns
    faces = np.concatenate(
        [np.stack([corner, below, right], 1), np.stack([right, below, below + 1], 1)]
    )
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(_paint(mi, paint, ink))
    mesh = mi.Mesh(
        "skin", z.size, len(faces), has_vertex_normals=True, has_vertex_texcoords=True,
        props=properties,
    )  # fmt: skip
    values = mi.traverse(mesh)
    pixel = [(grid_x / view.mm_per_px[0]) / view.size_px[0] + 0.5,
             (grid_y / view.mm_per_px[1]) / view.size_px[1] + 0.5]  # fmt: skip
    values["vertex_positions"] = _flat(np.stack([grid_x, grid_y, z], -1))
    values["vertex_normals"] = _flat(normal / np.linalg.norm(normal, axis=-1, keepdims=True))
    values["vertex_texcoords"] = _flat(np.stack(pixel, -1))
    values["faces"] = faces.astype(np.uint32).ravel()
    values.update()
    return mesh


def _flat(values: np.ndarray) -> Float[np.ndarray, " n"]:
    return np.ascontiguousarray(values, np.float32).ravel()


def _paint(mi: Any, paint: Paint, ink: Map | None) -> dict[str, Any]:
    if paint == "gray":
        matt = {"type": "diffuse", "reflectance": _inked(mi, GRAY_REFLECTANCE, ink)}
        return {"type": "twosided", "bsdf": matt}
    flakes = {"type": "roughconductor", "material": "none", "alpha": SILVER["roughness"],
              "specular_reflectance": _inked(mi, SILVER["flake"], ink)}  # fmt: skip
    base = {"type": "diffuse", "reflectance": _inked(mi, SILVER["diffuse"], ink)}
    blend = {"type": "blendbsdf", "weight": SILVER["share"], "base": base, "flakes": flakes}
    return {"type": "twosided", "bsdf": blend}


def _inked(mi: Any, value: float, ink: Map | None) -> dict[str, Any]:
    """A reflectance, less where there is ink: a dot's ink covers flakes as well as base."""
    if ink is None:
        return _gray(value)
    texture = np.repeat((value * ink)[..., None], 3, -1).astype(np.float32)
    return {"type": "bitmap", "bitmap": mi.Bitmap(texture), "raw": True,
            "filter_type": "bilinear", "wrap_mode": "clamp"}  # fmt: skip


def _gray(value: float) -> dict[str, Any]:
    return {"type": "rgb", "value": [float(value)] * 3}


def _matt(value: float) -> dict[str, Any]:
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": _gray(value)}}


def _body(mi: Any, design: Wedge) -> dict[str, Any]:
    """The acrylic's faces, and the gel's foot and painted edge."""
    acrylic, gel, lights = design.acrylic, design.gel, design.lights
    length, width = acrylic.length_mm, acrylic.width_mm
    foot, floor = -float(gel.thickness_mm), -float(gel.thickness_mm + acrylic.thickness_mm)
    index, through = float(acrylic.refractive_index), float(lights.gray_filter_transmission)
    bare = {"type": "dielectric", "int_ior": 1.0, "ext_ior": index}
    if lights.diffuser:
        film = _matt(_film_reflectance(design))
    else:  # the film's own outer face, passed once by what leaves and twice by what stays
        film = {**bare, "specular_transmittance": _gray(through),
                "specular_reflectance": _gray(through**2)}  # fmt: skip
    scene: dict[str, Any] = {
        "inner_face": _wall(mi, (0, 0, floor), (0, 0, 1), (length / 2, width / 2), bare),
        "gel_foot": _wall(
            mi, (0, 0, foot), (0, 0, 1), (gel.pad_length_mm / 2, gel.pad_width_mm / 2),
            {"type": "dielectric", "int_ior": index, "ext_ior": float(gel.refractive_index)},
        ),
        "tip_face": _wall(
            mi, (length / 2, 0, (floor + foot) / 2), (-1, 0, 0),
            (width / 2, acrylic.thickness_mm / 2), bare,
        ),
    }  # fmt: skip
    for side in sides(design):
        scene[f"side_{side.color}"] = _wall(
            mi, (*side.center_mm, (floor + foot) / 2), (*side.inward, 0),
            (side.length_mm / 2, acrylic.thickness_mm / 2), film,
        )  # fmt: skip
    pad_x, pad_y = gel.pad_length_mm / 2, gel.pad_width_mm / 2
    ring_x, ring_y = length / 2 - pad_x, width / 2 - pad_y
    painted, tall = _matt(GRAY_REFLECTANCE), float(gel.thickness_mm)
    for sign in (-1, 1):
        if ring_x > 0:
            scene[f"ring_x{sign}"] = _wall(
                mi, (sign * (pad_x + ring_x / 2), 0, foot), (0, 0, -1),
                (ring_x / 2, width / 2), bare,
            )  # fmt: skip
        if ring_y > 0:
            scene[f"ring_y{sign}"] = _wall(
                mi, (0, sign * (pad_y + ring_y / 2), foot), (0, 0, -1), (pad_x, ring_y / 2), bare
            )
        scene[f"edge_x{sign}"] = _wall(
            mi, (sign * pad_x, 0, foot + tall / 2), (-sign, 0, 0), (pad_y, tall / 2), painted
        )
        scene[f"edge_y{sign}"] = _wall(
            mi, (0, sign * pad_y, foot + tall / 2), (0, -sign, 0), (pad_x, tall / 2), painted
        )
    return scene


def _lights(mi: Any, design: Wedge) -> dict[str, Any]:
    """What the LEDs send into the acrylic, through diffuser and gray filter or without."""
    acrylic, lights = design.acrylic, design.lights
    middle = -float(design.gel.thickness_mm + acrylic.thickness_mm / 2)
    scene: dict[str, Any] = {}
    for side in sides(design):
        if not side.leds:
            continue
        color = np.array(PRIMARIES[side.color])
        inward = np.array([*side.inward, 0.0])
        place = np.array([*side.row_center_mm, middle])
        along = np.array([*side.along, 0.0])
        if lights.diffuser:  # a film on the LEDs: their row, blurred by its thickness, matt
            long = min(side.leds * design.wiring.led_pitch_mm, side.length_mm - 0.1)
            tall = min(lights.led_width_mm + 2 * lights.film_thickness_mm, acrylic.thickness_mm)
            radiance = lights.gray_filter_transmission * DIFFUSER_TRANSMISSION * color
            scene[f"light_{side.color}"] = _lamp(
                mi,
                place + HAIR_MM * inward,
                side,
                (long, tall),
                radiance,
                _film_reflectance(design),
            )
            continue
        for index in range(side.leds):  # bare LEDs in the air behind the film
            step = (index - (side.leds - 1) / 2) * design.wiring.led_pitch_mm
            behind = lights.film_thickness_mm + max(HAIR_MM, lights.backing_thickness_mm - FLEX_MM)
            scene[f"light_{side.color}{index}"] = _lamp(
                mi, place + step * along - behind * inward, side,
                (lights.led_length_mm, lights.led_width_mm), color, BACKING_REFLECTANCE,
            )  # fmt: skip
    return scene


def _film_reflectance(design: Wedge) -> float:
    """Of the diffuser behind the gray filter, which light passes on its way there and back."""
    return BACKING_REFLECTANCE * float(design.lights.gray_filter_transmission) ** 2


def _lamp(
    mi: Any,
    place: np.ndarray,
    side: Side,
    size_mm: tuple[float, float],
    radiance: np.ndarray,
    reflectance: float,
) -> dict[str, Any]:
    """A matt source that shines inward."""
    half = (size_mm[0] / 2, size_mm[1] / 2)
    shine = {"type": "rgb", "value": [float(value) for value in radiance]}
    return {
        **_wall(mi, place, (*side.inward, 0), half, _matt(reflectance)),
        "emitter": {"type": "area", "radiance": shine},
    }


def _wall(
    mi: Any,
    center: Any,
    normal: tuple[float, float, float],
    half: tuple[float, float],
    bsdf: dict[str, Any],
) -> dict[str, Any]:
    """A rectangle whose first half side is horizontal, across the normal, the second upright.

    A level rectangle's half sides go along x and y.
    """
    transform = mi.ScalarTransform4f
    facing = np.asarray(normal, float)
    up = [0, 1, 0] if abs(facing[2]) > 0.5 else [0, 0, 1]
    place = [float(value) for value in center]
    target = [float(value) for value in np.asarray(center) + facing]
    return {
        "type": "rectangle",
        "to_world": transform().look_at(origin=place, target=target, up=up)
        @ transform().scale([float(half[0]), float(half[1]), 1.0]),
        "bsdf": bsdf,
    }


def _straight_on(mi: Any, design: Wedge, view: View, window: Window | None) -> dict[str, Any]:
    """A camera without perspective just above the gel's foot; y runs down."""
    transform = mi.ScalarTransform4f
    back = -float(design.gel.thickness_mm) + 2 * HAIR_MM
    width, height = view.size_px
    half_x = width * view.mm_per_px[0] / 2  # the pixels are square
    columns, rows = window or (slice(0, width), slice(0, height))
    looking = transform().look_at(origin=[0, 0, back], target=[0, 0, 0], up=[0, -1, 0])
    return {
        "type": "orthographic",
        "near_clip": HAIR_MM / 2,
        "far_clip": 1e3,
        "to_world": looking @ transform().scale([half_x, half_x, 1.0]),
        "film": {
            "type": "hdrfilm",
            "width": width,
            "height": height,
            "crop_offset_x": columns.start,
            "crop_offset_y": rows.start,
            "crop_width": columns.stop - columns.start,
            "crop_height": rows.stop - rows.start,
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": "multijitter"},
    }
