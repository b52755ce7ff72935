# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Each limit fails where the one thing that it watches is broken, and no other that is not told."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from recon.geometry.lens import Lens, write_lens
from recon.presses import read_presses
from sensor.dataset import LENS_FILE, read_dataset, write_card, write_labels
from tests import synthetic
from tests.synthetic import KEYSTONE_PX, make_dataset
from tests.validation.sensors import (
    PRESSES,
    accepted_on,
    change_frames,
    failed_of,
    good_set,
    unit_of,
)
from validation.acceptance.errors import error_values, steepest_values
from validation.acceptance.limits import LIMITS, grades, verdict
from validation.acceptance.place import bent_grid_share, timing_values
from validation.acceptance.roundness import roundness
from validation.report.certificate import lines

LENS = Lens(
    frame_size_px=(120, 90),
    focal_px=(100.0, 100.0),
    center_px=(60.0, 45.0),
    radial=(0.0, 0.0, 0.0),
    rms_px=1.5,
)


def test_a_good_sensor_passes_every_limit(accepted):
    found = grades(accepted.values)
    assert {limit.name for limit in LIMITS} - set(found) == {
        "inferred_axis_deg",
        "bent_grid_share",
        "lens_rms_px",
    }
    assert set(accepted.absent) == {"bent_grid_share", "lens_rms_px"}
    assert not failed_of(accepted) and verdict(accepted.values) in ("A", "B")


def only_channel(channel, change):
    def changed(frame, index):
        frame = frame.copy()
        frame[..., channel] = change(frame[..., channel])
        return frame

    return changed


def worn(frame, _):
    torn = np.random.default_rng(1).random(frame.shape[:2]) > 0.985
    return np.where(ndimage.binary_dilation(torn, iterations=2)[..., None], 20.0, frame)


def leaking(frame, _):
    mean = frame.mean(-1, keepdims=True)
    return 0.97 * mean + 0.03 * frame + [0, 0, 1]  # white is exactly gray for no camera


def noisy(frame, index):
    return frame + np.random.default_rng(index).normal(0, 8, frame.shape)


RAMP = np.linspace(0.0, 1.0, 120) ** 2
DARK = np.where(np.arange(120) < 40, 0.02, 1.0)[None, :, None]
SLOPES = {
    "theta_x_deg",
    "theta_y_deg",
    "fewer_lights_x_deg",
    "fewer_lights_y_deg",
    "depth_rmse_share",
    "ball_radius_share",
}
"""What any change of the colours may spoil, since slopes are read from them."""


@pytest.mark.parametrize(
    ("limit", "change", "blank_too", "along"),
    [
        pytest.param(
            "contrast_gray_levels",
            only_channel(0, lambda red: 0 * red + 60),
            True,
            {"brightness_change_share", "axes_ratio", "usable_share", "lights_turned_deg"},
            id="a dead LED",
        ),
        pytest.param(
            "swapped_lights", lambda frame, _: frame[..., ::-1], True, set(), id="swapped colours"
        ),
        pytest.param(
            "color_balance_share",
            only_channel(2, lambda blue: 0.15 * blue),
            True,
            {"brightness_change_share", "contrast_gray_levels", "usable_share", "axes_ratio"},
            id="a wrong white balance",
        ),
        pytest.param(
            "brightness_change_share",
            lambda frame, _: 0.7 * frame,
            True,
            set(),
            id="lights that have aged",
        ),
        pytest.param(
            "saturated_share",
            lambda frame, _: 2.5 * frame,
            True,
            {"brightness_change_share", "usable_share", "contrast_gray_levels", "moved_px"},
            id="too much exposure",
        ),
        pytest.param(
            "evenness_share",
            only_channel(0, lambda red: red * RAMP),
            True,
            {"brightness_change_share", "usable_share", "cross_talk_share"},
            id="a light that fades across the pad",
        ),
        pytest.param(
            "lit_share",
            lambda frame, _: frame * DARK,
            True,
            {"brightness_change_share", "usable_share", "evenness_share", "worn_share"},
            id="a pad in the dark",
        ),
        pytest.param(
            "worn_share",
            worn,
            True,
            {"usable_share", "evenness_share", "brightness_change_share", "moved_px"},
            id="a worn gel",
        ),
        pytest.param(
            "cross_talk_share",
            leaking,
            True,
            {"axes_ratio", "usable_share", "out_of_round_share"},
            id="light that leaks",
        ),
        pytest.param(
            "moved_px",
            lambda frame, _: np.roll(frame, 5, axis=1),
            True,
            set(),
            id="a moved camera",
        ),
        pytest.param(
            "drift_gray_levels", lambda frame, _: frame + 16, False, set(), id="exposure not locked"
        ),
        pytest.param(
            "noise_gray_levels",
            noisy,
            True,
            {"usable_share", "out_of_round_share"},
            id="a noisy camera",
        ),
    ],
)
def test_one_broken_thing_fails_its_limit_and_no_unrelated_one(
    calibration, broken, limit, change, blank_too, along
):
    change_frames(broken, change, blank_too=blank_too)
    failed = failed_of(accepted_on(calibration, broken))
    assert limit in failed
    assert failed <= {limit} | along | SLOPES


@pytest.mark.parametrize(
    ("limit", "change"),
    [
        ("usable_share", lambda frame, _: frame * DARK),
        ("axes_ratio", leaking),
    ],
)
def test_limits_that_fail_with_their_cause_do_fail(calibration, broken, limit, change):
    """No slope is read in the dark, nor an axis through light that leaks: causes fail as well."""
    change_frames(broken, change)
    assert limit in failed_of(accepted_on(calibration, broken))


@pytest.mark.parametrize(("limit", "shift"), [("theta_x_deg", (7, 0)), ("theta_y_deg", (0, 7))])
def test_labels_beside_the_ball_fail_the_error_along_their_axis(calibration, broken, limit, shift):
    moved = [
        replace(x, center_x_px=x.center_x_px + shift[0], center_y_px=x.center_y_px + shift[1])
        for x in broken.labels
    ]
    write_labels(broken.folder / "labels.csv", moved)
    failed = failed_of(accepted_on(calibration, read_dataset(broken.folder)))
    assert limit in failed
    assert failed <= {
        limit,
        "depth_rmse_share",
        "ball_radius_share",
        "out_of_round_share",
        limit.replace("theta", "fewer_lights"),
    }


@pytest.mark.parametrize(
    ("stated_mm", "along"),
    [(1.9, set()), (8.0, {"steepest_deg"})],
    ids=["too small", "its diameter"],
)
def test_a_wrong_ball_fails_the_depth_and_the_radius_alone(calibration, broken, stated_mm, along):
    write_card(broken.folder / "dataset.toml", replace(broken.card, ball_radius_mm=stated_mm))
    failed = failed_of(accepted_on(calibration, read_dataset(broken.folder)))
    assert {"depth_rmse_share", "ball_radius_share"} | along <= failed <= SLOPES | along


def test_a_ball_stated_ten_times_too_large_fails_the_steepest_slope_alone(tmp_path):
    """Unit and presses agree on it, so that no error shows: all slopes are a tenth."""
    for name, seed in (("taught", 0), ("set", 1)):
        made = good_set(tmp_path / name, seed)
        wrong = replace(made.card, ball_radius_mm=10 * made.card.ball_radius_mm)
        write_card(made.folder / "dataset.toml", wrong)
    unit = unit_of(read_dataset(tmp_path / "taught"))
    found = accepted_on(unit, read_dataset(tmp_path / "set"))
    assert failed_of(found) == {"steepest_deg"}
    assert any("of the ball's radius, 40 mm" in doubt for doubt in found.doubts)
    assert found.mean_abs_gradient < 0.03


def test_slopes_that_fit_no_ball_give_a_radius_that_nobody_knows(calibration, broken):
    change_frames(broken, lambda frame, _: frame[..., ::-1])  # balls look like hollows
    found = accepted_on(calibration, broken)
    assert found.values["ball_radius_share"] == {"": float("inf")}
    (shown,) = [line for line in lines(found) if "radius" in line.title]
    assert (shown.value.split()[0], shown.grade) == ("unknown", "fail")


def test_presses_in_one_corner_do_not_cover_the_pad(calibration, broken):
    first = sorted(broken.labels, key=lambda x: x.center_x_px + x.center_y_px)[:2]
    write_labels(broken.folder / "labels.csv", first)
    failed = failed_of(accepted_on(calibration, read_dataset(broken.folder)))
    assert "covered_share" in failed
    # Two presses are few to judge by, and few to learn fewer lights from.
    assert failed <= {"covered_share", "usable_presses"} | SLOPES


def test_a_blank_picture_is_not_held_against_itself(calibration, today, broken):
    """Of the calibration's own blank frame nothing says whether it has changed since."""
    since = {"moved_px", "brightness_change_share"}
    own = replace(calibration, background=read_presses(today).background)
    found = accepted_on(own, today)
    assert since <= set(found.absent) and not since & set(found.values)
    change_frames(broken, lambda frame, index: frame + 1)
    assert since <= set(accepted_on(own, broken).values)


@pytest.mark.parametrize(("fresh", "is_judged"), [(PRESSES - 1, True), (4, False)])
def test_errors_are_of_the_presses_that_were_not_learnt_where_they_are_enough(
    calibration, today, fresh, is_judged
):
    presses = read_presses(today).presses
    learnt = frozenset(press.fingerprint for press in presses[fresh:])
    kept = {"contact_theta_x_deg": 7.5, "contact_theta_y_deg": 7.5}
    kept |= {"depth_rmse_mm": 0.01, "depth_peak_truth_mm": 0.5, "contact_curvature": 0.8}
    card = replace(calibration.card, learnt_frames=learnt, learnt_truths=None, metrics=kept)
    found = accepted_on(replace(calibration, card=card), today)
    assert (found.learnt, found.presses) == (PRESSES - fresh, PRESSES)
    if is_judged:
        judged = [error.file for error in found.errors.depth["table"]]
        assert judged == [press.file for press in presses[:fresh]]
        (row,) = [row for row in found.errors.rows if row.pixels == "contact"]
        seen_deg, curvature = row.errors.values["theta_x_deg"], row.errors.curvature
    else:  # also of the depth of the presses that were held out, not of those here
        assert found.errors is None and found.values["depth_rmse_share"] == {"": 0.02}
        seen_deg, curvature = 7.5, 0.8
    assert found.values["theta_x_deg"] == {"": seen_deg}
    assert found.values["ball_radius_share"] == {"": abs(1 / curvature - 1)}
    assert found.held_out == (fresh if is_judged else None)
    chosen = presses[:fresh] if is_judged else presses
    for name, value in steepest_values(chosen).items():
        assert found.values[name] == value


def test_a_turned_light_board_fails_the_turn_alone(calibration, today):
    lights_deg = {c: angle + 40 for c, angle in calibration.card.lights_deg.items()}
    turned = replace(calibration, card=replace(calibration.card, lights_deg=lights_deg))
    assert failed_of(accepted_on(turned, today)) == {"lights_turned_deg"}


def test_a_poor_lens_fails_the_lens_alone(calibration, broken):
    write_lens(broken.folder / LENS_FILE, LENS)
    found = accepted_on(calibration, read_dataset(broken.folder))
    assert failed_of(found) == {"lens_rms_px"}


def test_a_wrong_corner_makes_discs_oval(tmp_path):
    unit = unit_of(make_dataset(tmp_path / "taught", corners_px=KEYSTONE_PX))
    dataset = make_dataset(tmp_path / "set", seed=1, corners_px=KEYSTONE_PX)
    assert "out_of_round_share" not in failed_of(accepted_on(unit, dataset))
    corners = tuple((80 + 1.12 * (x - 80), y) for x, y in KEYSTONE_PX)
    write_card(dataset.folder / "dataset.toml", replace(dataset.card, corners_px=corners))
    squeezed = [
        replace(x, center_x_px=59.5 + (x.center_x_px - 59.5) / 1.12) for x in dataset.labels
    ]
    write_labels(dataset.folder / "labels.csv", squeezed)
    failed = failed_of(accepted_on(unit, read_dataset(dataset.folder)))
    assert "out_of_round_share" in failed
    assert failed <= {"out_of_round_share", "moved_px", "worn_share"} | SLOPES


def test_a_sensor_of_two_lights_is_not_blamed_for_the_third(tmp_path):
    lights_deg = {"R": 90.0, "B": -90.0}
    dataset = good_set(tmp_path / "set", lights_deg=lights_deg)
    metrics = {"contact_theta_x_deg": 5.0, "contact_theta_y_deg": 1.0}
    metrics |= {"depth_rmse_mm": 0.01, "depth_peak_truth_mm": 0.5}
    unit = unit_of(dataset, **metrics)
    found = accepted_on(unit, dataset)
    assert not failed_of(found)
    assert found.values["inferred_axis_deg"] == {"": 5.0} and "theta_x_deg" not in found.values
    assert set(found.values["contrast_gray_levels"]) == {"R", "B"}
    assert "ball_radius_share" in found.absent
    card = replace(unit.card, metrics=metrics | {"contact_theta_x_deg": 20.0})
    assert grades(error_values(None, card))["inferred_axis_deg"] == "fail"


@pytest.mark.parametrize(("dead", "axis"), [(0, "y"), (1, "x")])
def test_a_dead_light_fails_the_configurations_that_need_it(tmp_path, monkeypatch, dead, axis):
    monkeypatch.setattr(synthetic, "BALL_RADIUS_MM", 2.2)  # steep: there is much to miss
    unit = unit_of(good_set(tmp_path / "taught"))
    dataset = good_set(tmp_path / "set", 1)
    fewer = {"fewer_lights_x_deg", "fewer_lights_y_deg"}
    change_frames(dataset, only_channel(dead, lambda color: 0 * color + 60))
    assert failed_of(accepted_on(unit, dataset)) & fewer == {f"fewer_lights_{axis}_deg"}


@pytest.mark.parametrize(
    ("limit", "times_ms", "indices"),
    [
        ("frame_rate_hz", [200 * i for i in range(40)], range(40)),
        ("jitter_ms", [33 * i + 25 * (i % 3 == 1) for i in range(40)], range(40)),
        ("longest_gap_ms", [33 * i + 1000 * (i > 150) for i in range(300)], range(300)),
        ("backward_steps", [33 * i - 5000 * (i > 20) for i in range(40)], range(40)),
        ("backward_steps", [33 * (i - (i > 20)) for i in range(40)], range(40)),
        ("lost_share", [33 * (i + i // 10) for i in range(40)], [i + i // 10 for i in range(40)]),
    ],
)
def test_a_stream_fails_for_its_one_fault(limit, times_ms, indices):
    values = timing_values([t * 1_000_000 for t in times_ms], indices)
    assert {name for name, grade in grades(values).items() if grade == "fail"} == {limit}
    steady = timing_values([33_000_000 * i for i in range(40)], range(40))
    assert set(grades(steady).values()) == {"A"}
    assert steady["frame_rate_hz"][""] == pytest.approx(1e3 / 33)


def test_stalls_and_regular_losses_do_not_pass_unseen():
    times_ms = [16 * i + 1000 * (i // 30) for i in range(100)]  # three stalls
    stalled = timing_values([t * 1_000_000 for t in times_ms], range(100))
    assert stalled["frame_rate_hz"][""] == pytest.approx(99 / 4.584)
    every_other = timing_values([33_000_000 * i for i in range(40)], range(0, 80, 2))
    assert every_other["lost_share"][""] == pytest.approx(0.5, abs=0.01)
    assert grades(every_other)["lost_share"] == "fail"
    assert "lost_share" not in timing_values([33_000_000 * i for i in range(40)], [])
    stands = timing_values([5] * 40, range(40))
    assert set(stands) == {"lost_share", "backward_steps"}
    assert stands["backward_steps"] == {"": 39}


def test_a_bent_grid_of_dots_is_seen_and_a_leaning_one_is_not():
    rows, columns = np.mgrid[0:9, 0:12].reshape(2, -1)
    straight = np.stack([10.0 + 9 * columns + rows, 10.0 + 8 * rows - 0.5 * columns], 1)
    bow = 0.02 * (columns - 5.5) ** 2 * 9
    bent = straight + np.stack([0 * bow, bow], 1)
    share = {
        name: bent_grid_share(points)
        for name, points in {"straight": straight, "bent": bent}.items()
    }
    (limit,) = [limit for limit in LIMITS if limit.name == "bent_grid_share"]
    assert limit.grade(share["straight"]) == "A" and share["straight"] < 1e-9
    assert limit.grade(share["bent"]) == "fail"
    assert share["bent"] == pytest.approx(bow.std() / 8.9, rel=0.2)


@pytest.mark.parametrize("stretch", [(0.1, 0.0), (0.0, 0.1), (-0.06, 0.05)])
def test_a_stretch_of_the_picture_is_measured(today, stretch):
    along, shear = stretch
    found = []
    for press in read_presses(today).presses:
        center = np.array(press.center_px)
        back = np.array([[np.exp(-along / 2), -shear / 2], [-shear / 2, np.exp(along / 2)]])
        offset = center - back @ center
        seen = [
            ndimage.affine_transform(
                press.difference[..., c], back[::-1, ::-1], offset=offset[::-1], order=1
            )
            for c in range(3)
        ]
        found.append(replace(press, difference=np.stack(seen, -1)))
    measured = roundness(found, 0)
    assert (measured.stretch, measured.shear) == pytest.approx(stretch, abs=0.02)
