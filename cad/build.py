# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""One design becomes a folder of files, with every check's figure."""

from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import cadquery as cq
import trimesh

from cad import checks
from cad.assembly import assembly_of, solids_of
from cad.catalogue import on_the_bed, printed_parts
from cad.counts import bill_counts
from cad.electronics.boards import Board, boards
from cad.electronics.files import board_files
from cad.electronics.netlist import check_electronics
from cad.electronics.wiring import wiring_svg
from cad.exports import laser, solids
from cad.exports.drawing import drawing_of
from cad.exports.page import view_files
from cad.exports.views import Subject, color_of, draw
from cad.manifest import bounding_box_mm, check_entries, part_entries
from cad.manifolds import manifold_of
from cad.mesh import mesh_of
from cad.refusals import refuse_unbuildable
from cad.steps import Assembly
from sensor.design import Wedge


@dataclass(frozen=True)
class Model:
    """A design as solids, meshes and figures, each made once."""

    design: Wedge
    assembly: Assembly
    bodies: dict[str, cq.Solid]
    printed: dict[str, cq.Solid]
    """In the frame they are modelled in."""

    @cached_property
    def boards(self) -> list[Board]:
        """The resistor board and the LED arrays."""
        return boards(self.design)

    @cached_property
    def printed_meshes(self) -> dict[str, trimesh.Trimesh]:
        """Printed parts in the frame they are modelled in."""
        return {name: mesh_of(solid) for name, solid in self.printed.items()}

    @cached_property
    def body_meshes(self) -> dict[str, trimesh.Trimesh]:
        """Bodies of the assembly in their places; printed ones are modelled there."""
        return {
            name: self.printed_meshes[name] if name in self.printed else mesh_of(solid)
            for name, solid in self.bodies.items()
        }

    @cached_property
    def bed_meshes(self) -> dict[str, trimesh.Trimesh]:
        """Printed parts as they stand on the bed."""
        parts = printed_parts(self.design)
        return {part.id: on_the_bed(part, self.printed_meshes[part.id]) for part in parts}

    @cached_property
    def parts(self) -> list[dict[str, Any]]:
        """Figures of every part, for the manifest."""
        bought = {
            body.part: (self.bodies[name], body.material)
            for name, body in self.assembly.bodies.items()
            if body.part not in self.printed
        }
        return part_entries(self.design, self.printed, bought, self.assembly.counts())


def model(design: Wedge) -> Model:
    """Build a design's solids.

    Raises:
        WedgeError: the design cannot be built; names field, value and bound.
    """
    refuse_unbuildable(design)
    bodies = solids_of(design)
    printed = {
        part.id: bodies[part.id] if part.id in bodies else part.make(design)
        for part in printed_parts(design)
    }
    return Model(design, assembly_of(design), bodies, printed)


def run_checks(built: Model) -> list[checks.Result]:
    """Every check of a design."""
    design, meshes, printed = built.design, built.body_meshes, built.printed_meshes
    bodies = {name: manifold_of(mesh) for name, mesh in meshes.items()}
    results = checks.check_solids(built.printed, built.bed_meshes)
    results += checks.check_closed_forms(design, built.printed)
    molds = ("mold_curved", "mold_flat")
    halves = {name: printed[name] for name in molds if name in printed}
    results += checks.check_mold(design, halves)
    results += checks.check_relief(halves, printed["mold_lid"])
    results += [checks.check_walls(name, mesh) for name, mesh in built.bed_meshes.items()]
    results += [checks.check_overhang(name, mesh) for name, mesh in built.bed_meshes.items()]
    results += checks.check_fasteners(design, built.printed)
    results += checks.check_interference(built.assembly, bodies)
    results += checks.check_clearances(design, bodies)
    results += checks.check_insertion(built.assembly, bodies)
    results += checks.check_wires(design, built.boards)
    results += checks.check_sight(design, meshes)
    results += checks.check_tolerance(design)
    results += check_electronics(design, built.boards)
    return results


def write_files(built: Model, folder: Path) -> None:
    """Everything but pictures: solids, meshes, sheets for the laser, the drawing."""
    for path, content in _files(built):
        target = folder / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)


def _files(built: Model) -> Iterator[tuple[str, bytes]]:
    design = built.design
    for name, mesh in built.bed_meshes.items():
        yield f"print/{name}.stl", solids.stl_of(mesh)
        yield f"print/{name}.3mf", solids.threemf_of({name: mesh})
        yield f"step/{name}.step", solids.step_of(built.printed[name], name)
    colors = {name: color_of(body.part) for name, body in built.assembly.bodies.items()}
    whole = solids.step_of_assembly(built.bodies, f"wedge_{design.name}", colors)
    yield "step/assembly.step", whole
    painted = {name: (mesh, colors[name]) for name, mesh in built.body_meshes.items()}
    yield "view/assembly.glb", solids.glb_of(painted)
    for name, content in view_files(design, built.assembly, built.body_meshes):
        yield f"view/{name}", content
    for name, content in laser.laser_files(design):
        yield f"laser/{name}", content
    for board in built.boards:
        for name, content in board_files(board):
            yield f"electronics/{name}", content
    yield "electronics/wiring.svg", wiring_svg(design)
    yield "drawing.svg", drawing_of(design, built.body_meshes)


def write_pictures(built: Model, folder: Path, executor: Executor) -> Callable[[], None]:
    """Begin to draw all pictures in the executor; the answer waits for them and writes them."""
    subject = Subject(built.design, built.assembly, built.body_meshes, built.bed_meshes)
    names = subject.names()
    halves = [executor.submit(draw, subject, names[start::2]) for start in range(2)]

    def finish() -> None:
        target = folder / "pictures"
        target.mkdir(parents=True, exist_ok=True)
        for half in halves:
            for name, content in half.result().items():
                (target / f"{name}.png").write_bytes(content)

    return finish


def manifest_of(built: Model, results: list[checks.Result]) -> dict[str, Any]:
    """The manifest without the files' hashes."""
    counts = built.assembly.counts()
    return {
        "design": built.design.name,
        "design_sha256": built.design.sha256,
        "bounding_box_mm": bounding_box_mm(built.bodies.values()),
        "parts": [dict(part) for part in built.parts],
        "bill": bill_counts(built.design, counts, built.boards, built.parts),
        "checks": check_entries(results),
    }
