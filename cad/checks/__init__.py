# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What is measured on a design before it is cut: one check a module, each with its figure."""

from cad.checks.cavity import check_mold, check_relief
from cad.checks.fasteners import check_fasteners
from cad.checks.fit import check_clearances, check_interference
from cad.checks.insertion import check_insertion
from cad.checks.sight import check_sight, check_tolerance
from cad.checks.solids import check_closed_forms, check_solids
from cad.checks.walls import check_overhang, check_walls
from cad.checks.wires import check_wires
from cad.result import Result

__all__ = [
    "Result",
    "check_clearances",
    "check_closed_forms",
    "check_fasteners",
    "check_insertion",
    "check_interference",
    "check_mold",
    "check_overhang",
    "check_relief",
    "check_sight",
    "check_solids",
    "check_tolerance",
    "check_walls",
    "check_wires",
]
