# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Touches whose pose is known: objects in closed form, posed, pressed and seen with slope noise.

Each object is the zero set of a function of its own coordinates, negative inside. A pixel of the
gel sees the object's lowest point above it, found by Newton's method, and its exact slopes; depth
is then integrated from the noisy slopes by the project's own integrator, as in a real frame.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy import ndimage
from scipy.spatial.transform import Rotation

from recon.arrays import ContactMask, DepthMap, GradientField
from recon.integration.poisson import Boundary, integrate
from recon.pose.rest import rest_at
from sensor.design import Gel
from sensor.toml import Pair

SIZE_PX = (320, 240)
MM_PER_PX = (0.0634, 0.0634)
SLOPE_NOISE = 0.05
"""Standard deviation of white noise on each slope of each pixel."""
CONTACT_DEPTH_MM = 0.04
"""Depth that counts as contact; integrated slope noise reaches a tenth of it."""
MOTION_DEG, MOTION_MM = 2.5, 0.2
"""By which each of ``motions`` turns and shifts."""
OBLIQUE_DEG = 11.0
"""Edges run askew to the pixels: along them the sampling error of depth would not average out."""
CLEAR_MM = 1.0
"""A surface so far above the gel is not pressed: its search ends."""
NEWTON_STEPS = 12
SUBPIXELS, EDGE_SUBPIXELS = 2, 8
"""Samples a pixel along each side, for a camera's pixel averages over its area; more where an edge
or the contact's outline crosses it."""
EDGE_SLOPE = 0.1
"""Samples of one pixel that differ by more."""
WINDOW_PX = 8
"""Where an object touches is first looked for on so coarse a lattice."""

Points = Float[np.ndarray, "*n 3"]
Transform = Float[np.ndarray, "4 4"]
Values = Float[np.ndarray, "*n"]
Field = Callable[[Points], tuple[Values, Points]]
"""Value, negative inside and about a distance in mm, and its gradient."""


@dataclass(frozen=True, kw_only=True)
class Thing:
    """An object whose own frame is that of the gel when it is pressed as first held."""

    name: str
    field: Field
    start_mm: Callable[[Float[np.ndarray, "*n 2"], Transform], Values]
    """A height below the surface of the posed object, from which Newton's method climbs."""


@dataclass(frozen=True, kw_only=True)
class SyntheticTouch:
    """What reconstruction would hand over, noise included."""

    gradient: GradientField
    depth_mm: DepthMap
    contact: ContactMask
    mm_per_px: Pair
    boundary: Boundary = "dirichlet"
    slope_error: GradientField | None = None

    @property
    def disturbed(self) -> ContactMask:
        """Nothing changes its colour but what touches."""
        return self.contact


def pressed(
    thing: Thing,
    T_sensor_object: Transform,
    rng: np.random.Generator | None = None,
    *,
    size_px: tuple[int, int] = SIZE_PX,
    mm_per_px: Pair = MM_PER_PX,
    gel: Gel | None = None,
) -> SyntheticTouch:
    """One touch of a posed object.

    Args:
        thing: the object.
        T_sensor_object: its pose; the gel's undeformed skin is z = 0 in the pad's middle.
        rng: of the slope noise; ``None`` for exact slopes.
        size_px: width and height.
        mm_per_px: pixel pitch.
        gel: the curved gel that it is pressed on; by default it is flat.
    """
    x_mm, y_mm = (
        (np.arange(n) - (n - 1) / 2) * pitch for n, pitch in zip(size_px, mm_per_px, strict=True)
    )
    centers = np.stack(np.meshgrid(x_mm, y_mm), -1)
    gradient = np.zeros_like(centers)
    window = _window(thing, T_sensor_object, centers, gel)
    coarse = _samples(thing, T_sensor_object, centers[window], mm_per_px, SUBPIXELS, gel)
    gradient[window] = coarse.mean(2)
    sharp = np.ptp(coarse, axis=2).max(-1) > EDGE_SLOPE
    edge = np.zeros(gradient.shape[:2], bool)
    edge[window] = ndimage.binary_dilation(sharp, np.ones((3, 3)))
    fine = _samples(thing, T_sensor_object, centers[edge][None], mm_per_px, EDGE_SUBPIXELS, gel)
    gradient[edge] = fine[0].mean(1)
    if rng is not None:
        gradient += SLOPE_NOISE * rng.standard_normal(gradient.shape)
    depth = integrate(gradient, mm_per_px, SyntheticTouch.boundary)
    gradient, depth = gradient.astype(np.float32), depth.astype(np.float32)
    return SyntheticTouch(
        gradient=gradient, depth_mm=depth, contact=depth > CONTACT_DEPTH_MM, mm_per_px=mm_per_px
    )


def _window(
    thing: Thing,
    T_sensor_object: Transform,
    centers_mm: Float[np.ndarray, "h w 2"],
    gel: Gel | None,
) -> tuple[slice, slice]:
    """Rows and columns where the object may touch, from every eighth pixel."""
    every = centers_mm[::WINDOW_PX, ::WINDOW_PX]
    rest_mm, _ = rest_at(gel, every[..., 0], every[..., 1])
    touched = lowest_surface(thing, T_sensor_object, every)[0] < -rest_mm
    rows, columns = (np.flatnonzero(touched.any(axis)) for axis in (1, 0))
    if not len(rows):
        return slice(None), slice(None)
    top, left = (max(int(first[0]) - 2, 0) * WINDOW_PX for first in (rows, columns))
    return (
        slice(top, (int(rows[-1]) + 3) * WINDOW_PX),
        slice(left, (int(columns[-1]) + 3) * WINDOW_PX),
    )


def _samples(
    thing: Thing,
    T_sensor_object: Transform,
    centers_mm: Float[np.ndarray, "h w 2"],
    mm_per_px: Pair,
    count: int,
    gel: Gel | None,
) -> Float[np.ndarray, "h w n 2"]:
    """Exact slopes of the dent at ``count`` x ``count`` points of each pixel."""
    steps = (np.arange(count) - (count - 1) / 2) / count
    around = np.stack(np.meshgrid(steps, steps), -1).reshape(-1, 2) * mm_per_px
    height, width = centers_mm.shape[:2]
    lattice = (centers_mm[:, :, None] + around).reshape(height, width * count**2, 2)
    surface_mm, slopes = lowest_surface(thing, T_sensor_object, lattice)
    rest_mm, rest_slopes = rest_at(gel, lattice[..., 0], lattice[..., 1])
    exact = np.where((surface_mm < -rest_mm)[..., None], -slopes - rest_slopes, 0.0)
    return exact.reshape(height, width, count**2, 2)


def lowest_surface(
    thing: Thing, T_sensor_object: Transform, lattice_mm: Float[np.ndarray, "h w 2"]
) -> tuple[Float[np.ndarray, "h w"], Float[np.ndarray, "h w 2"]]:
    """Height in mm of the posed object's underside, 1 where missed, and its slopes."""
    rotation, translation = T_sensor_object[:3, :3], T_sensor_object[:3, 3]
    z_mm = thing.start_mm(lattice_mm, T_sensor_object)
    slopes = np.zeros_like(lattice_mm)
    active = np.flatnonzero(z_mm < 0)  # elsewhere even the start is not pressed
    flat, climb, tilt = lattice_mm.reshape(-1, 2), z_mm.reshape(-1), slopes.reshape(-1, 2)
    found = np.zeros(len(flat), bool)
    for _ in range(NEWTON_STEPS):
        points = np.concatenate([flat[active], climb[active, None]], -1)
        value, gradient = thing.field((points - translation) @ rotation)
        normal = gradient @ rotation.T
        reached = (np.abs(value) < 1e-7) & (normal[:, 2] < 0)
        found[active[reached]] = True
        tilt[active] = -normal[:, :2] / np.minimum(normal[:, 2:], -1e-3)
        climb[active] += np.clip(value / np.maximum(-normal[:, 2], 0.1), -0.5, 0.5)
        active = active[~reached & (climb[active] < CLEAR_MM)]
    climb[~found] = CLEAR_MM
    return z_mm, slopes


def motions(rng: np.random.Generator, count: int) -> list[Transform]:
    """Random rigid motions of one angle about any axis, and one shift in any direction."""
    found = []
    for _ in range(count):
        axis, way = (v / np.linalg.norm(v) for v in rng.standard_normal((2, 3)))
        motion = np.eye(4)
        motion[:3, :3] = Rotation.from_rotvec(np.radians(MOTION_DEG) * axis).as_matrix()
        motion[:3, 3] = MOTION_MM * way
        found.append(motion)
    return found


def _convex(normals: Points, offsets_mm: Values) -> Field:
    """A convex solid: the intersection of half-spaces ``n . p <= offset``."""
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)

    def field(points: Points) -> tuple[Values, Points]:
        distances = points @ normals.T - offsets_mm
        side = distances.argmax(-1)
        return np.take_along_axis(distances, side[..., None], -1)[..., 0], normals[side]

    return field


@dataclass(frozen=True, kw_only=True)
class Waves:
    """A smooth random texture in space: plane waves of random direction and phase."""

    vectors: Float[np.ndarray, "k 3"]
    """rad/mm."""
    phases: Float[np.ndarray, " k"]
    amplitude_mm: float
    """Standard deviation of the sum."""

    @classmethod
    def random(cls, seed: int, count: int, lengths_mm: Pair, amplitude_mm: float) -> "Waves":
        """Waves of lengths spread evenly in logarithm."""
        rng = np.random.default_rng(seed)
        ways = rng.standard_normal((count, 3))
        shortest, longest = np.log(lengths_mm)
        lengths = np.exp(rng.uniform(shortest, longest, count))
        return cls(
            vectors=2
            * np.pi
            * ways
            / np.linalg.norm(ways, axis=1, keepdims=True)
            / lengths[:, None],
            phases=rng.uniform(0, 2 * np.pi, count),
            amplitude_mm=amplitude_mm,
        )

    def __call__(self, points: Points) -> tuple[Values, Points]:
        """Height in mm and its gradient."""
        angles = points @ self.vectors.T + self.phases
        scale = self.amplitude_mm * np.sqrt(2 / len(self.phases))
        return scale * np.cos(angles).sum(-1), -scale * np.sin(angles) @ self.vectors


def _below(depth_mm: float) -> Callable[[Float[np.ndarray, "*n 2"], Transform], Values]:
    """Start everywhere at one height, below all that is pressed."""
    return lambda lattice, _: np.full(lattice.shape[:-1], -depth_mm)


def cube_corner(press_mm: float = 1.0) -> Thing:
    """A cube that stands on its corner."""
    upright = Rotation.align_vectors([[0.0, 0, -1]], [[1.0, 1, 1]])[0]
    normals = (Rotation.from_euler("z", OBLIQUE_DEG, degrees=True) * upright).as_matrix().T
    tip = np.array([0.0, 0, -press_mm])
    return Thing(name="cube corner", field=_convex(normals, normals @ tip), start_mm=_below(3.0))


def bar_edges() -> Thing:
    """A key: a flat 5 x 2.4 mm face with chamfered sides."""
    oblique = Rotation.from_euler("z", OBLIQUE_DEG, degrees=True).as_matrix()
    normals = np.array([[0, 0, -1.0], [1, 0, -0.7], [-1, 0, -0.7], [0, 1, -0.7], [0, -1, -0.7]])
    corners = np.array([[0, 0, 0.0], [2.5, 0, 0], [-2.5, 0, 0], [0, 1.2, 0], [0, -1.2, 0]])
    press_mm = 0.6
    corners[:, 2] = -press_mm
    lengths = np.linalg.norm(normals, axis=1)
    return Thing(
        name="bar with edges",
        field=_convex(normals @ oblique.T, (normals * corners).sum(1) / lengths),
        start_mm=_below(2.0),
    )


def shallow_texture() -> Thing:
    """A nearly flat face of 13 mm with a random texture and a round rim."""
    waves, press_mm = Waves.random(2, 12, (0.8, 2.5), amplitude_mm=0.02), 0.25

    def field(points: Points) -> tuple[Values, Points]:
        texture, along = waves(points)
        radius = np.hypot(points[..., 0], points[..., 1])
        over = np.maximum(radius - 5.5, 0.0)
        rim = 0.25 * over**2
        value = -(points[..., 2] + press_mm) + texture + rim
        gradient = along.copy()
        gradient[..., :2] += (0.5 * over / np.maximum(radius, 1e-9))[..., None] * points[..., :2]
        gradient[..., 2] -= 1
        return value, gradient

    return Thing(name="shallow texture", field=field, start_mm=_below(1.5))


def bead(radius_mm: float = 5.0, press_mm: float = 0.8, amplitude_mm: float = 0.02) -> Thing:
    """A ball with a random texture; with no amplitude a smooth one, whose rolling nobody sees."""
    waves = Waves.random(5, 16, (0.8, 2.5), amplitude_mm)
    center = np.array([0, 0, radius_mm - press_mm])

    def field(points: Points) -> tuple[Values, Points]:
        from_center = points - center
        texture, along = waves(from_center)
        distance = np.linalg.norm(from_center, axis=-1)
        return distance - radius_mm - texture, from_center / distance[..., None] - along

    def start_mm(lattice: Float[np.ndarray, "*n 2"], T_sensor_object: Transform) -> Values:
        x, y, z = T_sensor_object[:3, :3] @ center + T_sensor_object[:3, 3]
        outer = radius_mm + 3.5 * amplitude_mm
        left = outer**2 - (lattice[..., 0] - x) ** 2 - (lattice[..., 1] - y) ** 2
        return np.where(left > 0, z - np.sqrt(np.maximum(left, 0)), 1.0)

    return Thing(name="textured bead", field=field, start_mm=start_mm)


def screw() -> Thing:
    """A thread along x, 1 mm a turn and 0.3 mm high, that tapers at both ends."""
    radius_mm, press_mm, height_mm, pitch_mm, end_mm = 2.0, 0.9, 0.3, 1.0, 4.0
    axis_z = radius_mm + height_mm / 2 - press_mm

    def field(points: Points) -> tuple[Values, Points]:
        x, y, z = points[..., 0], points[..., 1], points[..., 2] - axis_z
        distance = np.maximum(np.hypot(y, z), 1e-6)
        phase = 2 * np.pi * x / pitch_mm + np.arctan2(y, z)
        thread = 0.5 * height_mm * np.cos(phase)
        turn = -0.5 * height_mm * np.sin(phase)
        over = np.sign(x) * np.maximum(np.abs(x) - end_mm, 0.0)
        value = distance - radius_mm - thread + 0.3 * over**2
        gradient = np.stack(
            [
                -turn * 2 * np.pi / pitch_mm + 0.6 * over,
                y / distance - turn * z / distance**2,
                z / distance + turn * y / distance**2,
            ],
            -1,
        )
        return value, gradient

    return Thing(name="screw", field=field, start_mm=_below(1.4))


def things() -> Mapping[str, Thing]:
    """The objects of the bench by name."""
    made = (cube_corner(), shallow_texture(), bead(), screw(), bar_edges())
    return {thing.name: thing for thing in made}
