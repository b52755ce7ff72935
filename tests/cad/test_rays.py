# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Rays hit a sphere where a sphere is, whichever way they are followed."""

import numpy as np
import pytest
import trimesh

from cad.rays import first_hits, first_hits_one_by_one

WAYS = pytest.mark.parametrize("follow", [first_hits, first_hits_one_by_one])


@WAYS
def test_rays_from_the_middle_of_a_box_reach_its_walls(follow: object) -> None:
    assert callable(follow)
    box = trimesh.creation.box((2.0, 4.0, 6.0))
    way = np.vstack([np.eye(3), -np.eye(3)])
    distance, struck = follow(box, np.full((6, 3), 0.01), way)
    assert distance == pytest.approx([0.99, 1.99, 2.99, 1.01, 2.01, 3.01], abs=1e-5)
    assert np.einsum("ij,ij->i", box.face_normals[struck], way) == pytest.approx(np.ones(6))


@WAYS
def test_rays_that_miss_say_so(follow: object) -> None:
    assert callable(follow)
    box = trimesh.creation.box((1.0, 1.0, 1.0))
    distance, struck = follow(box, np.array([[0.0, 0.0, 2.0]]), np.array([[0.0, 0.0, 1.0]]))
    assert np.isinf(distance).all()
    assert (struck == -1).all()


def test_both_ways_agree_on_a_ball() -> None:
    ball = trimesh.creation.icosphere(3, 5.0)
    rng = np.random.default_rng(0)
    way = rng.normal(size=(500, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    start = rng.uniform(-2, 2, (500, 3))
    fast, slow = first_hits(ball, start, way), first_hits_one_by_one(ball, start, way)
    assert fast[0] == pytest.approx(slow[0], abs=1e-5)
    assert (fast[1] == slow[1]).mean() > 0.99
