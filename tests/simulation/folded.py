# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The whole folded path traced in one piece: LEDs to skin, over acrylic and mirror to a pinhole.

Slow, grainy, and the judge of ``simulation.raw_view``: it also has what that leaves out, the
light that the mirror sends back, the lit sides themselves and their ghosts in the acrylic.
"""

from typing import Any, Final

import numpy as np

from sensor.design import Wedge
from simulation.engine import Engine
from simulation.raw_view import MIRROR_REFLECTANCE
from simulation.render import Radiance
from simulation.scene import gel_scene
from simulation.skin import Map, View

LONGEST: Final = 24
"""Longest path, in meetings with matter."""


def trace_folded(
    engine: Engine,
    design: Wedge,
    view: View,
    depth_mm: Map,
    *,
    samples: int,
    seed: int,
) -> Radiance:
    """The camera's frame, linear, in units of the radiance inside the gel; no baffle, no case.

    Args:
        engine: which Mitsuba.
        design: the sensor; its camera must be a pinhole.
        view: samples of the skin.
        depth_mm: its indentation.
        samples: paths a pixel.
        seed: of the paths.
    """
    assert design.camera.projection == "pinhole"
    with engine.loaded() as mi:
        parts = gel_scene(mi, design, view, depth_mm)
        parts["integrator"] = {"type": "path", "max_depth": LONGEST, "rr_depth": 10}
        parts["sensor"] = _pinhole(mi, design)
        parts["mirror"] = _mirror(mi, design)
        scene = mi.load_dict(parts, optimize=False)
        traced = np.array(mi.render(scene, spp=samples, seed=seed % 2**32), np.float32)
    # Radiance falls by the square of the index as light leaves the gel.
    return traced * np.float32(design.gel.refractive_index**2)


def _in_gel(design: Wedge, body: np.ndarray) -> np.ndarray:
    """A point of the body's frame in the gel's."""
    acrylic = design.acrylic
    return np.array(
        [
            acrylic.tip_offset_mm + acrylic.length_mm / 2 - body[0],
            body[1],
            -body[2] - acrylic.thickness_mm - design.gel.thickness_mm,
        ]
    )


def _pinhole(mi: Any, design: Wedge) -> dict[str, Any]:
    """Columns run up the body, rows across it."""
    camera = design.camera
    pitch = np.radians(camera.pitch_deg)
    pupil = _in_gel(design, np.array([camera.pupil_x_mm, 0.0, camera.pupil_z_mm]))
    forward = np.array([np.cos(pitch), 0.0, -np.sin(pitch)])
    half_view = np.arctan(camera.width_px / 2 / camera.focal_length_px)
    return {
        "type": "perspective",
        "fov": float(2 * np.degrees(half_view)),
        "fov_axis": "x",
        "near_clip": 0.05,
        "far_clip": 1e3,
        "to_world": mi.ScalarTransform4f().look_at(
            origin=pupil.tolist(), target=(pupil + forward).tolist(), up=[0, -1, 0]
        ),
        "film": {
            "type": "hdrfilm",
            "width": int(camera.width_px),
            "height": int(camera.height_px),
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": "multijitter"},
    }


def _mirror(mi: Any, design: Wedge) -> dict[str, Any]:
    mirror = design.mirror
    tilt = np.radians(mirror.angle_deg)
    slope = np.array([np.cos(tilt), 0.0, np.sin(tilt)])
    foot = np.array([mirror.foot_x_mm, 0.0, mirror.foot_height_mm])
    middle = _in_gel(design, foot + slope * mirror.length_mm / 2)
    normal = np.array([-np.sin(tilt), 0.0, np.cos(tilt)])
    transform = mi.ScalarTransform4f
    return {
        "type": "rectangle",
        "to_world": transform().look_at(
            origin=middle.tolist(), target=(middle + normal).tolist(), up=[0, 1, 0]
        )
        @ transform().scale([float(mirror.length_mm / 2), float(mirror.width_mm / 2), 1.0]),
        "bsdf": {
            "type": "twosided",
            "bsdf": {
                "type": "conductor",
                "material": "none",
                "specular_reflectance": {"type": "rgb", "value": [MIRROR_REFLECTANCE] * 3},
            },
        },
    }
