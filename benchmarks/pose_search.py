# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How many poses of meshes are found from one touch alone, and why the others are not.

    python -m benchmarks.pose_search --count 12

Random polyhedra, boxes, cubes and bolts are pressed in random poses: near the middle with white
slope noise, there with errors that are alike over 4 pixels, and cut off by the frame's border with
such errors. A pose is right if it is within 5 degrees and 0.5 mm, at the contact, of the true one
or of one that looks the same after one of the mesh's own rotations. A touch shows its pose if a
tracker that is told the true one is sure of it, unless a pose that is found with a warning explains
as much: corners of boxes are all alike. Of right poses it is told how many are within the region
that their covariance says holds nine of ten.

Each polyhedron pressed in the middle is searched once more with the guesses near the true pose
left out: what a wrong pose explains of a touch at most, and a right one at least, is what
``recon.pose.tracker.FITS`` is chosen from.
"""

import argparse
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from statistics import fmean, median

import cv2
import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from benchmarks.pose_doubt import smooth_noise, square
from benchmarks.touches import MM_PER_PX, SIZE_PX, SLOPE_NOISE, SyntheticTouch
from recon.contact.disturbed import boundary_of
from recon.depth import untouched_depth
from recon.integration.poisson import integrate
from recon.pose.estimate import PoseEstimate
from recon.pose.joint import Joint
from recon.pose.mesh import Mesh, render, under_side
from recon.pose.models import Keyframe, MeshModel
from recon.pose.registration import Touch, contact_middle, contact_points
from recon.pose.rigid import Transform, angle_deg, applied, inverse, rigid, turn_and_shift
from recon.pose.symmetry import nearest_turn, own_rotations
from recon.pose.tracker import ALIKE, FITS, SAME_DEG, SAME_MM, Tracker

COUNT, SEED = 12, 1
NEAR_DEG, NEAR_MM = 15.0, 1.5
"""A guess so near counts as one of the true pose."""
PRESS_MM = (0.8, 1.6)
ALIKE_PX = 4.0
SUBPIXELS = 4
"""Along each side of a pixel; the search's own pictures have fewer."""
LEFT_SHARE = (0.55, 0.85)
"""Of a contact that the border cuts off."""
NINE_OF_TEN = float(chi2.ppf(0.9, 6)) / 6
"""Squared errors in units of their covariance, over 6, are less in nine of ten."""
KINDS = ("middle, white", "middle, alike", "cut, alike")


@dataclass(frozen=True, kw_only=True)
class Case:
    """A touch of a mesh whose pose is known."""

    shape: str
    kind: str
    mesh: Mesh
    pose: Transform
    touch: SyntheticTouch


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What a search made of a case."""

    case: Case
    found: PoseEstimate
    right: bool
    off_deg: float
    """NaN where lost."""
    square: float
    """Squared error in units of the covariance, over 6; NaN where lost."""
    shown: bool
    """Whether who is told the true pose is sure of it, and no other explains as much."""
    seconds: float
    """Processor time."""
    why: str
    """Where a right pose was dropped."""

    @property
    def word(self) -> str:
        """right, warned (right, with a warning), doubtful (wrong, with one), WRONG or lost."""
        if self.found.T_sensor_object is None:
            return "lost"
        sure = self.found.state == "tracking"
        if self.right:
            return "right" if sure else "warned"
        return "WRONG" if sure else "doubtful"


def polyhedron(rng: np.random.Generator) -> Mesh:
    """Fourteen random corners, no two alike."""
    ways = rng.standard_normal((14, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    return hull(np.array([9, 7, 6]) * ways * rng.uniform(0.7, 1.1, (14, 1)))


def box(rng: np.random.Generator) -> Mesh:
    """Three unlike sides."""
    return block(np.array([12, 9, 7]) * rng.uniform(0.9, 1.1, 3))


def cube(rng: np.random.Generator) -> Mesh:
    """Three like sides."""
    return block(np.full(3, rng.uniform(8, 11)))


def bolt(rng: np.random.Generator) -> Mesh:
    """A hexagonal head of 8 mm and a shaft of 5 mm, of 24 sides."""
    head, shaft = prism(6, 4.6, -4, 0), prism(24, 2.5, 0, float(rng.uniform(8, 12)))
    return Mesh(
        vertices_mm=np.concatenate([head.vertices_mm, shaft.vertices_mm]),
        triangles=np.concatenate([head.triangles, shaft.triangles + len(head.vertices_mm)]),
    )


SHAPES: Mapping[str, Callable[[np.random.Generator], Mesh]] = {
    "polyhedra": polyhedron,
    "boxes": box,
    "cubes": cube,
    "bolts": bolt,
}


def hull(corners_mm: np.ndarray) -> Mesh:
    """The convex body of corners (n, 3)."""
    return Mesh(vertices_mm=corners_mm, triangles=ConvexHull(corners_mm).simplices)


def block(sides_mm: np.ndarray) -> Mesh:
    """A box about the origin."""
    places = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return hull(places * sides_mm / 2)


def prism(sides: int, radius_mm: float, low_mm: float, high_mm: float) -> Mesh:
    """About z, between two heights."""
    angles = np.arange(sides) * 2 * np.pi / sides
    ring = np.stack([np.cos(angles), np.sin(angles)], -1) * radius_mm
    ends = [np.column_stack([ring, np.full(sides, height)]) for height in (low_mm, high_mm)]
    return hull(np.concatenate(ends))


def lying(mesh: Mesh, turn: np.ndarray, press_mm: float) -> Transform:
    """A mesh so turned, pressed so deep in the middle."""
    corners = mesh.vertices_mm @ turn.T
    z_mm = -press_mm - corners[:, 2].min()
    return rigid(turn, np.array([*-under_side(corners, mesh.triangles, z_mm), z_mm]))


def cut_off(mesh: Mesh, pose: Transform, share: float, rng: np.random.Generator) -> Transform:
    """The pose moved across a random border until so much of the contact is left."""
    points = contact_points(render(mesh, pose, (3 * SIZE_PX[0], 3 * SIZE_PX[1]), MM_PER_PX))
    axis, sign = int(rng.integers(2)), float(rng.choice([-1, 1]))
    half_mm = SIZE_PX[axis] * MM_PER_PX[axis] / 2
    moved = pose.copy()
    moved[axis, 3] += sign * (half_mm - np.quantile(sign * points[:, axis], share))
    return moved


def noisy(
    mesh: Mesh, pose: Transform, rng: np.random.Generator, length_px: float
) -> SyntheticTouch:
    """What would be reconstructed, its contact told by colour; pixels average over their area."""
    fine_px = SUBPIXELS * SIZE_PX[0], SUBPIXELS * SIZE_PX[1]
    fine_mm = MM_PER_PX[0] / SUBPIXELS, MM_PER_PX[1] / SUBPIXELS
    drawn = render(mesh, pose, fine_px, fine_mm)
    exact, share = (
        cv2.resize(values.astype(np.float32), SIZE_PX, interpolation=cv2.INTER_AREA)
        for values in (drawn.gradient, drawn.contact)
    )
    contact = share >= 0.5
    gradient = exact + SLOPE_NOISE * smooth_noise(rng, contact.shape, length_px)
    boundary = boundary_of(contact)
    depth_mm = integrate(gradient, MM_PER_PX, boundary)
    depth_mm -= untouched_depth(depth_mm, contact, boundary)
    return SyntheticTouch(
        gradient=gradient.astype(np.float32),
        depth_mm=depth_mm.astype(np.float32),
        contact=contact,
        mm_per_px=MM_PER_PX,
        boundary=boundary,
    )


def cases(shape: str, count: int, seed: int = SEED) -> Iterator[Case]:
    """So many meshes of a shape, each touched in every way."""
    return (drawn_case(shape, number, seed) for number in range(count * len(KINDS)))


def drawn_case(shape: str, number: int, seed: int = SEED) -> Case:
    """One of them, by its place among all."""
    which, way = divmod(number, len(KINDS))
    rng = np.random.default_rng([seed, list(SHAPES).index(shape), which, way])
    mesh, kind = SHAPES[shape](rng), KINDS[way]
    pose = lying(mesh, Rotation.random(random_state=rng).as_matrix(), rng.uniform(*PRESS_MM))
    pose[:2, 3] += rng.uniform(-2, 2, 2)
    if kind.startswith("cut"):
        pose = cut_off(mesh, pose, rng.uniform(*LEFT_SHARE), rng)
    touch = noisy(mesh, pose, rng, 0.0 if kind.endswith("white") else ALIKE_PX)
    return Case(shape=shape, kind=kind, mesh=mesh, pose=pose, touch=touch)


def off(case: Case, found: Transform, rotations: list[Transform]) -> tuple[float, float]:
    """Degrees, and mm at the middle of the contact, from the nearest pose that looks the same."""
    middle = contact_middle(case.touch)
    turn = nearest_turn(found, case.pose, rotations)
    left = found @ turn @ inverse(case.pose)
    return angle_deg(left), float(np.linalg.norm(applied(left, middle) - middle))


def held(case: Case, found: PoseEstimate, rotations: list[Transform]) -> float:
    """Squared error of a pose in units of its covariance, over 6."""
    assert found.T_sensor_object is not None and found.covariance is not None
    turn = nearest_turn(case.pose, found.T_sensor_object, rotations)
    left = inverse(found.T_sensor_object) @ case.pose @ turn
    return square(turn_and_shift(left), found.covariance)


def searched(case: Case) -> Outcome:
    """One search from nothing."""
    rotations = own_rotations(case.mesh)
    track = Tracker("joint", MeshModel(mesh=case.mesh, registration=Joint()))
    begun = time.process_time()
    found = track(case.touch)
    seconds = time.process_time() - begun
    right, angle, error = False, np.nan, np.nan
    if found.T_sensor_object is not None:
        angle, away = off(case, found.T_sensor_object, rotations)
        right = angle < SAME_DEG and away < SAME_MM
        error = held(case, found, rotations)
    told = Tracker("joint", MeshModel(mesh=case.mesh, registration=Joint()), case.pose)(case.touch)
    left_open = found.state == "weak" and found.explained > told.explained - ALIKE
    return Outcome(
        case=case,
        found=found,
        right=right,
        off_deg=angle,
        square=error,
        shown=told.state == "tracking" and (right or not left_open),
        seconds=seconds,
        why="" if right else _why(case, found, told, rotations),
    )


def _why(case: Case, found: PoseEstimate, told: PoseEstimate, rotations: list[Transform]) -> str:
    """At which stage the right pose was dropped."""
    if told.explained < found.explained:
        return "a wrong pose explains more"
    model = MeshModel(mesh=case.mesh, registration=Joint())
    ways = [off(case, pose, rotations) for _, pose in model.guesses(case.touch)]
    near = [angle for angle, away in ways if angle < NEAR_DEG and away < NEAR_MM]
    return "led elsewhere from a guess nearby" if near else "not among the guesses"


@dataclass(kw_only=True)
class Misled(MeshModel):
    """A mesh that is never guessed near the true pose."""

    case: Case

    def guesses(self, touch: Touch) -> Iterator[tuple[Keyframe, Transform]]:
        """All others."""
        rotations = own_rotations(self.mesh)
        for known, pose in super().guesses(touch):
            angle, away = off(self.case, pose, rotations)
            if angle > NEAR_DEG or away > NEAR_MM:
                yield known, pose


def misled(case: Case) -> PoseEstimate:
    """What is found where the right pose is not among the guesses."""
    model = Misled(mesh=case.mesh, registration=Joint(), case=case)
    return Tracker("joint", model)(case.touch)


def _row(name: str, outcomes: list[Outcome]) -> str:
    words = Counter(item.word for item in outcomes if item.shown)
    others = Counter(item.word for item in outcomes if not item.shown)
    cells = [str(words[word]) for word in ("right", "warned", "doubtful", "WRONG", "lost")]
    rest = ", ".join(f"{others[word]} {word}" for word in others) or "-"
    degrees = [item.off_deg for item in outcomes if item.word == "right"]
    away = f"{median(degrees):.2f}, {max(degrees):.2f}°" if degrees else "-"
    squares = [item.square for item in outcomes if item.right]
    within = f"{np.less(squares, NINE_OF_TEN).sum()} of {len(squares)}"
    seconds = fmean(item.seconds for item in outcomes)
    return " | ".join([name, str(words.total()), *cells, rest, away, within, f"{seconds:.2f} s"])


def fits(outcomes: list[Outcome]) -> Iterator[str]:
    """What right poses explain, and wrong ones where the right is not guessed."""
    shares: dict[str, list[float]] = {"right poses": [], "where the right is not guessed": []}
    for item in outcomes:
        if not item.shown or not item.right:
            continue
        shares["right poses"].append(item.found.explained)
        found = misled(item.case)
        if item.case.kind.startswith("middle") and found.T_sensor_object is not None:
            angle, away = off(item.case, found.T_sensor_object, own_rotations(item.case.mesh))
            if angle > NEAR_DEG or away > NEAR_MM:
                shares["where the right is not guessed"].append(found.explained)
    for name, values in shares.items():
        lowest = ", ".join(f"{value:.3f}" for value in sorted(values)[:3])
        highest = ", ".join(f"{value:.3f}" for value in sorted(values)[-3:])
        yield f"{name}: {len(values)} poses explain {lowest} at least, {highest} at most"
    yield f"FITS is {FITS}"


def main(count: int, seed: int, shapes: list[str]) -> None:
    """Print the table, the reasons, and what ``FITS`` is chosen from."""
    heads = ("shape, touch", "shown", "right", "warned", "doubtful", "WRONG", "lost", "not shown")
    print(" | ".join([*heads, "right ones off: median, most", "within 90 %", "a search"]))
    for shape in shapes:
        outcomes = [searched(case) for case in cases(shape, count, seed)]
        for kind in KINDS:
            here = [item for item in outcomes if item.case.kind == kind]
            print(_row(f"{shape}, {kind}", here), flush=True)
        for item in outcomes:
            if item.shown and item.why:
                print(f"    {item.case.kind}: {item.word}, {item.why}")
        if shape == "polyhedra":
            for line in fits(outcomes):
                print(line, flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m benchmarks.pose_search", description=__doc__)
    parser.add_argument("--count", type=int, default=COUNT, help="meshes of each shape")
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--shapes", nargs="+", choices=list(SHAPES), default=list(SHAPES))
    arguments = parser.parse_args()
    main(arguments.count, arguments.seed, arguments.shapes)
