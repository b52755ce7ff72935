# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Every printed part: how it is made, of what, and how it stands on the printer's bed."""

from collections.abc import Callable
from dataclasses import dataclass

import cadquery as cq
import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from cad.parts.camera_holder import camera_holder
from cad.parts.case import case
from cad.parts.coupons import acrylic_coupon, camera_coupon
from cad.parts.electronics_cover import electronics_cover
from cad.parts.gripper_adapter import adapter_lab, adapter_wsg50
from cad.parts.jigs import ball_jig, caliper_jig
from cad.parts.mold import mold_curved, mold_flat, mold_lid
from sensor.design import Wedge

BACK_DOWN = (0.0, 1.0, 0.0), 90.0
"""Turn that lays the face at large x on the bed."""
AS_MODELLED = (0.0, 0.0, 1.0), 0.0
UPSIDE_DOWN = (1.0, 0.0, 0.0), 180.0

INFILL_PERCENT = 100.0
"""Parts this small gain nothing from being hollow, and must be opaque."""

Turn = tuple[tuple[float, float, float], float]


@dataclass(frozen=True)
class Printed:
    """One printed part. ``turn`` is the axis and angle from model to bed, in quarters of a turn."""

    id: str
    title: str
    make: Callable[[Wedge], cq.Solid]
    material: str
    turn: Turn
    use: str
    """``assembly`` where the sensor holds it, else what it is for."""
    note: str


PRINTED = (
    Printed("case", "Case", case, "PLA black", BACK_DOWN, "assembly",
            "on its back face, tip up, no supports; black, otherwise light leaks"),
    Printed("camera_holder", "Camera holder", camera_holder, "PLA black", BACK_DOWN, "assembly",
            "flange on the bed, no supports"),
    Printed("adapter_wsg50", "Gripper adapter, WSG-50", adapter_wsg50, "PLA", UPSIDE_DOWN,
            "assembly", "gripper side on the bed; the recesses of the roof screws are bridged"),
    Printed("electronics_cover", "Electronics cover", electronics_cover, "PLA", AS_MODELLED,
            "assembly", "floor on the bed, open side up"),
    Printed("adapter_lab", "Gripper adapter, lab pattern", adapter_lab, "PLA", UPSIDE_DOWN,
            "alternative", "instead of the WSG-50 adapter"),
    Printed("mold_curved", "Gel mold, curved", mold_curved, "PLA", AS_MODELLED, "casting",
            "cavity up, finest layers; sand to 2000 grit and polish"),
    Printed("mold_flat", "Gel mold, flat", mold_flat, "PLA", AS_MODELLED, "casting",
            "cavity up, finest layers; sand to 2000 grit and polish"),
    Printed("mold_lid", "Gel mold, lid", mold_lid, "PLA", AS_MODELLED, "casting",
            "flat side on smooth glass, ridge up; sand and polish that face"),
    Printed("ball_jig", "Ball jig", ball_jig, "PLA", AS_MODELLED, "calibration",
            "socket up; fix the ball with a drop of glue"),
    Printed("caliper_jig", "Caliper jig", caliper_jig, "PLA", UPSIDE_DOWN, "calibration",
            "slotted face on the bed"),
    Printed("camera_coupon", "Fit coupon, camera and screws", camera_coupon, "PLA black",
            AS_MODELLED, "fit test", "dots up; print it first, in the case's filament"),
    Printed("acrylic_coupon", "Fit coupon, acrylic and pins", acrylic_coupon, "PLA black",
            AS_MODELLED, "fit test",
            "dots up; print it first, in the case's filament; its pin holes are upright, those of"
            " the case lie on their side"),
)  # fmt: skip


def printed_parts(design: Wedge) -> tuple[Printed, ...]:
    """The parts that a design is printed of; a flat gel has no use for the curved mold."""
    return tuple(part for part in PRINTED if design.gel.curved or part.id != "mold_curved")


def on_the_bed(part: Printed, mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """The part turned for printing, its lowest point at z = 0 and its corner at the origin."""
    axis, angle_deg = part.turn
    turn = np.round(Rotation.from_rotvec(angle_deg * np.array(axis), degrees=True).as_matrix())
    turned = mesh.vertices @ turn.T
    return trimesh.Trimesh(turned - turned.min(axis=0), mesh.faces, process=False)
