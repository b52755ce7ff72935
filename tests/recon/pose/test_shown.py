# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What a touch does not show is doubted, and what it shows, however thin, is not."""

from collections.abc import Callable

import numpy as np
import pytest

from benchmarks import touches
from benchmarks.touches import SyntheticTouch, Thing, cube_corner, pressed
from recon.pose.agreement import agreement
from recon.pose.gaps import gaps_between
from recon.pose.icp import Icp
from recon.pose.joint import Joint
from recon.pose.pyramid import Pyramid
from recon.pose.registration import PRIOR, PRIOR_DEG, prior_root
from recon.pose.rigid import Transform, angle_deg, inverse, motion, rigid
from recon.pose.tracker import Tracker

Heights = Callable[[np.ndarray, np.ndarray], np.ndarray]
SIZE_PX, MM_PER_PX = (140, 140), (0.0634, 0.0634)


@pytest.fixture(autouse=True)
def little_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the default estimator has on the finger."""
    monkeypatch.setattr(touches, "SLOPE_NOISE", 0.015)


def relief(height_mm: Heights) -> Thing:
    """A surface so high above its lowest point, which is pressed half a millimetre deep."""

    def field(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x, y, step = points[..., 0], points[..., 1], 1e-5
        along = [
            (height_mm(x + step * i, y + step * j) - height_mm(x - step * i, y - step * j))
            / (2 * step)
            for i, j in ((1, 0), (0, 1))
        ]
        gradient = np.stack([*along, -np.ones_like(x)], -1)
        return height_mm(x, y) - points[..., 2] - 0.5, gradient

    return Thing(name="relief", field=field, start_mm=lambda xy, pose: np.full(xy.shape[:-1], -2.5))


def turned(height_mm: Heights) -> Thing:
    return relief(lambda x, y: height_mm(np.hypot(x, y), 0 * x))


ROUND = {
    "pin": turned(lambda r, _: 1.2 * np.maximum(r - 2, 0)),
    "tube": turned(lambda r, _: np.maximum(np.abs(r - 1.6) - 0.35, 0)),
    "rings": turned(lambda r, _: 0.06 - 0.06 * np.cos(7.85 * r) + 1.2 * np.maximum(r - 2.4, 0)),
}


def cross() -> Thing:
    """Two thin ridges of different length."""

    def height_mm(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        over = [np.maximum(np.abs(side) - half, 0) for side, half in (
            (y, 0.05), (x - 1, 3), (x, 0.05), (y - 0.5, 2)
        )]  # fmt: skip
        return 1.2 * np.minimum(over[0] + over[1], over[2] + over[3])

    return relief(height_mm)


def touch(thing: Thing, pose: Transform, seed: int, pitch_mm: float = 0.0634) -> SyntheticTouch:
    rng = np.random.default_rng(seed)
    return pressed(thing, pose, rng, size_px=SIZE_PX, mm_per_px=(pitch_mm, pitch_mm))


def yaw(degrees: float, about_mm: tuple[float, float] = (0, 0)) -> Transform:
    turn = motion(np.array([0, 0, np.radians(degrees), 0, 0, 0]))
    middle = rigid(np.eye(3), np.array([*about_mm, 0.0]))
    return middle @ turn @ inverse(middle)


@pytest.mark.parametrize("name", ROUND)
@pytest.mark.parametrize("pitch_mm", [0.0634, 0.1063])
def test_a_round_thing_with_edges_does_not_show_how_far_it_spins(
    name: str, pitch_mm: float
) -> None:
    """Edges lie in some way between the pixels, which derivatives take for a mark on the thing."""
    track = Tracker()
    track(touch(ROUND[name], np.eye(4), 0, pitch_mm))
    for step in (1, 2):
        found = track(touch(ROUND[name], yaw(4.0 * step), step, pitch_mm))
        assert found.words == "weak: a rotation is not seen by this touch"
        assert found.rotation_std_deg > PRIOR_DEG - 0.1


@pytest.mark.parametrize("about_mm", [(0, 0), (8, 5)])
def test_an_unseen_spin_is_as_uncertain_wherever_it_is(about_mm: tuple[float, float]) -> None:
    there = rigid(np.eye(3), np.array([*about_mm, 0.0]))
    seen = [
        pressed(ROUND["pin"], pose @ there, np.random.default_rng(seed), mm_per_px=MM_PER_PX)
        for seed, pose in enumerate((np.eye(4), yaw(4, about_mm)))
    ]
    found = Joint().align(Pyramid(seen[0]), Pyramid(seen[1]), np.eye(4))
    variances = np.linalg.eigvalsh(found.covariance[:3, :3])
    assert np.degrees(np.sqrt(variances[-1])) == pytest.approx(PRIOR_DEG, rel=0.02)
    icp = Icp(kind="GICP")
    clouds = [icp.prepare(item) for item in seen]
    gaps = gaps_between(clouds[0], clouds[1], np.eye(4), gaussian=True, every=1)
    for twist in gaps.unseen(clouds[0], clouds[1]).T:
        away = np.linalg.solve(prior_root(gaps.points.mean(0)), twist)
        assert np.linalg.norm(away) == pytest.approx(1)


def test_the_prior_turns_a_contact_about_its_middle() -> None:
    middle = np.array([3.0, -2.0, 0.5])
    covariance = prior_root(middle) @ prior_root(middle).T
    lever = np.array([[0, 0.5, 2], [-0.5, 0, 3], [-2, -3, 0]])  # -[middle]x, of a turn
    there = np.block([lever, np.eye(3)])
    np.testing.assert_allclose(there @ covariance @ there.T, PRIOR[3:, 3:], atol=1e-12)
    np.testing.assert_allclose(prior_root(np.zeros(3)) ** 2, PRIOR)


def test_a_thin_thing_is_followed_and_recognized() -> None:
    """Its details are too fine for half resolution."""
    track, thing = Tracker(), cross()
    first = touch(thing, np.eye(4), 0, 0.1063)
    track(first)
    for step in (1, 2, 3):
        pose = yaw(4.0 * step)
        found = track(touch(thing, pose, step, 0.1063))
        assert found.words == "tracking"
        assert angle_deg(inverse(pose) @ found.T_sensor_object) < 0.2
    empty = SyntheticTouch(
        gradient=0.01 * np.random.default_rng(9).standard_normal((*SIZE_PX, 2)).astype(np.float32),
        depth_mm=np.zeros(SIZE_PX, np.float32),
        contact=np.zeros(SIZE_PX, bool),
        mm_per_px=first.mm_per_px,
    )
    assert track(empty).state == "lost"
    assert track(touch(thing, np.eye(4), 5, 0.1063)).words == "tracking"


@pytest.mark.parametrize("depth_mm", [0.8, 1.0, 1.4])
def test_a_corner_shows_itself_however_small(depth_mm: float) -> None:
    things = [touch(cube_corner(depth_mm), np.eye(4), seed, 0.1063) for seed in (0, 1)]
    pyramids = [Pyramid(item) for item in things]
    assert agreement(pyramids[0], pyramids[1], np.eye(4)).alike > 0.8


@pytest.mark.parametrize("step_mm", [0.9, 1.0, 1.1])
def test_a_pattern_one_period_off_is_warned_of(step_mm: float) -> None:
    """A step as long as the studs are apart is no jump yet."""

    def height_mm(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        waves = np.cos(2 * np.pi * x / 0.9) + np.cos(2 * np.pi * y / 0.9)
        return 0.04 * (2 - waves) + np.maximum(np.abs(x) - 3, 0) + np.maximum(np.abs(y) - 2, 0)

    thing, track = relief(height_mm), Tracker()
    for seed, away_mm in enumerate((0, step_mm)):
        pose = rigid(np.eye(3), np.array([away_mm, 0.0, 0]))
        rng = np.random.default_rng(seed)
        found = track(pressed(thing, pose, rng, mm_per_px=(0.1063, 0.1063)))
    right = found.T_sensor_object[0, 3] == pytest.approx(step_mm, abs=0.02)
    assert found.state == ("tracking" if right else "weak")
