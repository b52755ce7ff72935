# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What an object looks like from a pose: earlier touches of it, or its mesh."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Protocol, runtime_checkable

import numpy as np
from scipy.spatial.transform import Rotation

from recon.pose.mesh import Mesh, averaged
from recon.pose.pyramid import Pyramid
from recon.pose.registration import Registration, Touch, contact_middle, of_one_sensor, own
from recon.pose.rest import gel_of, lifted, tangent
from recon.pose.rigid import (
    Covariance,
    Points,
    Transform,
    angle_deg,
    inverse,
    rigid,
    turned_covariance,
)
from recon.pose.search import sifted
from recon.pose.symmetry import own_rotations
from sensor.design import Gel
from sensor.errors import WedgeError

REACH_DEG, REACH_MM = 12.0, 1.2
"""A touch is compared with those that differ by less."""
RENDER_DEG, RENDER_MM = 4.0, 0.4
"""A mesh is rendered anew where the object has moved by more."""
CLOSE_DEG, CLOSE_MM = 0.3, 0.03
"""The same where what a pose explains decides between poses."""
MOST_LEARNT = 100
"""Touches of a run that are kept: each takes megabytes, and an object may turn for hours."""
YAWS = 12
MOST_GUESSES = 16


@dataclass(frozen=True, kw_only=True)
class Keyframe:
    """A touch whose pose is known."""

    T_sensor_object: Transform
    covariance: Covariance
    """Of a twist x in ``T_sensor_object @ motion(x)``."""
    pyramid: Pyramid
    prepared: Any
    """What the registration made of it."""

    @cached_property
    def middle(self) -> Points:
        """(3,), of the contact, in mm, gel frame."""
        return contact_middle(self.pyramid.touch)


def keyframe(
    touch: Touch, T_sensor_object: Transform, covariance: Covariance, registration: Registration
) -> Keyframe:
    """A touch, prepared for comparisons."""
    prepared = registration.prepare(touch)
    return Keyframe(
        T_sensor_object=T_sensor_object,
        covariance=covariance,
        pyramid=prepared if isinstance(prepared, Pyramid) else Pyramid(touch),
        prepared=prepared,
    )


def turned(item: Keyframe, turn: Transform) -> Keyframe:
    """The same touch, of an object that looks the same after a turn of its own frame."""
    return replace(
        item,
        T_sensor_object=item.T_sensor_object @ turn,
        covariance=turned_covariance(item.covariance, turn),
    )


@runtime_checkable
class ObjectModel(Protocol):
    """What is known of an object."""

    @property
    def alike(self) -> Sequence[Transform]:
        """Turns of its frame after which it looks the same; the identity first."""

    def near(
        self, T_sensor_object: Transform, like: Touch, *, close: bool = False
    ) -> Keyframe | None:
        """The keyframe to compare a touch with at a pose; ``None`` where nothing is known.

        Where it can be drawn at any pose, it is drawn close to this one if that is asked.
        """

    def surest_first(self) -> Sequence[Keyframe]:
        """All keyframes, those first whose own pose is least in doubt."""

    def learn(self, seen: Keyframe) -> None:
        """Take in a touch whose pose was found."""

    def guesses(self, touch: Touch) -> Iterator[tuple[Keyframe, Transform]]:
        """Keyframes, and poses at which a touch might be theirs, when no pose is known."""


def refuse_other_model(
    model: ObjectModel, name: str, registration: Registration, gel: Gel | None
) -> None:
    """Refuse a model whose keyframes are not what a tracker compares.

    Args:
        model: given to the tracker.
        name: of its registration.
        registration: the same.
        gel: that it lays touches on.

    Raises:
        WedgeError: it is none, or they are of another registration, or lie on another gel.
    """
    if not isinstance(model, ObjectModel):
        raise WedgeError("a model is a MeshModel(mesh=..., registration=...) or a TouchModel.")
    known = model.surest_first()
    if isinstance(model, MeshModel):
        alike = model.registration.prepares is registration.prepares
    else:
        alike = all(isinstance(item.prepared, registration.prepares) for item in known)
    if not alike:
        raise WedgeError(f"give the model the registration of the tracker, {name!r}.")
    if any(gel_of(item.pyramid.touch) != gel for item in known):
        raise WedgeError("the model's touches lie on another gel: give both the tracker's.")


@dataclass(kw_only=True)
class TouchModel:
    """Earlier touches; without any, the first touch becomes the object."""

    keyframes: list[Keyframe] = field(default_factory=list)
    _stay: int = field(default=1, init=False)
    """So many are never forgotten: those given, or the first."""

    def __post_init__(self) -> None:
        self._stay = max(len(self.keyframes), 1)

    @property
    def alike(self) -> Sequence[Transform]:
        """Nothing is known of sides that did not touch."""
        return (np.eye(4),)

    def near(
        self, T_sensor_object: Transform, like: Touch, *, close: bool = False
    ) -> Keyframe | None:
        """The touch whose pose was nearest, if it is in reach."""
        if not self.keyframes:
            return None
        best = min(self.keyframes, key=lambda item: remoteness(item, T_sensor_object))
        return best if remoteness(best, T_sensor_object) < 1 else None

    def surest_first(self) -> Sequence[Keyframe]:
        """By the variance of their rotation."""
        return sorted(self.keyframes, key=lambda item: float(np.trace(item.covariance[:3, :3])))

    def learn(self, seen: Keyframe) -> None:
        """Keep it, and forget what was learnt long ago."""
        self.keyframes.append(seen)
        if len(self.keyframes) > self._stay + MOST_LEARNT:
            del self.keyframes[self._stay]

    def guesses(self, touch: Touch) -> Iterator[tuple[Keyframe, Transform]]:
        """Those given, each as it was, and turned about the gel's normal, moved to the contact."""
        center = contact_middle(touch)
        for item in self.keyframes[: self._stay]:
            yield item, item.T_sensor_object
            for yaw in np.arange(YAWS) * 2 * np.pi / YAWS:
                turn = Rotation.from_rotvec([0, 0, yaw]).as_matrix()
                yield item, rigid(turn, center - turn @ item.middle) @ item.T_sensor_object


@dataclass(kw_only=True)
class MeshModel:
    """A mesh in mm, rendered where it is needed."""

    mesh: Mesh
    registration: Registration
    _last: Keyframe | None = field(default=None, init=False)

    @cached_property
    def alike(self) -> Sequence[Transform]:
        """The mesh's own rotations."""
        return own_rotations(self.mesh)

    def near(
        self, T_sensor_object: Transform, like: Touch, *, close: bool = False
    ) -> Keyframe | None:
        """The mesh as it presses at a pose; ``None`` where it would not touch.

        Raises:
            WedgeError: it has too many large triangles above each other to be drawn.
        """
        if self._last is not None and of_one_sensor(self._last.pyramid.touch, like):
            between = T_sensor_object @ inverse(self._last.T_sensor_object)
            most_deg, most_mm = (CLOSE_DEG, CLOSE_MM) if close else (RENDER_DEG, RENDER_MM)
            if angle_deg(between) < most_deg and moved_mm(self._last, between) < most_mm:
                return self._last
        self._last = self._rendered(T_sensor_object, like)
        return self._last

    def surest_first(self) -> Sequence[Keyframe]:
        """A mesh keeps none: it is rendered anew."""
        return ()

    def learn(self, seen: Keyframe) -> None:
        """A mesh is known already."""

    def guesses(self, touch: Touch) -> Iterator[tuple[Keyframe, Transform]]:
        """The mesh pressed from directions all over, those first that look most alike.

        Raises:
            WedgeError: as ``near``.
        """
        touch = own(touch)
        T_gel_plane = tangent(touch)
        for guess in sifted(self.mesh, lifted(touch), self.alike, MOST_GUESSES):
            pose = T_gel_plane @ guess
            rendered = self._rendered(pose, touch)
            if rendered is not None:
                yield rendered, pose

    def _rendered(self, T_sensor_object: Transform, like: Touch) -> Keyframe | None:
        size_px = like.depth_mm.shape[::-1]
        touch = averaged(self.mesh, T_sensor_object, size_px, like.mm_per_px, gel_of(like))
        if not touch.contact.any():
            return None
        return keyframe(touch, T_sensor_object, np.zeros((6, 6)), self.registration)


def remoteness(item: Keyframe, T_sensor_object: Transform) -> float:
    """How far a pose is from that of a keyframe, in reaches."""
    between = T_sensor_object @ inverse(item.T_sensor_object)
    return max(angle_deg(between) / REACH_DEG, moved_mm(item, between) / REACH_MM)


def moved_mm(item: Keyframe, between: Transform) -> float:
    """How far a motion in the gel frame moves the middle of a keyframe's contact."""
    middle = np.append(item.middle, 1.0)
    return float(np.linalg.norm((between @ middle - middle)[:3]))
