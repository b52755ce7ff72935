# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What acceptance measures, where a made picture or a made answer to slope gives it exactly."""

from dataclasses import replace

import numpy as np
import pytest

from recon.ball import ball_cap
from recon.brightness import inner
from recon.pixels import BallPress
from recon.presses import read_presses
from sensor.dataset import read_dataset, write_labels
from tests.synthetic import shaded
from tests.validation.sensors import accepted_on, dotted_set, failed_of, unit_of
from validation.acceptance.errors import (
    ball_radius_values,
    error_values,
    fewer_lights,
    fit_fewer_lights,
    steepest_values,
)
from validation.acceptance.gel import (
    KNOWN_SLOPE,
    REACH,
    SATURATED,
    blank_values,
    covered_area,
    saturation,
    stillness,
    usable_area,
)
from validation.acceptance.lights import Response, light_values, turn_deg
from validation.acceptance.limits import DEAD_GRAY_LEVELS, grades
from validation.acceptance.measurements import _reasons
from validation.acceptance.place import (
    LEAST_DOTS,
    LEAST_FRAMES,
    bent_grid_share,
    timing_values,
)
from validation.acceptance.roundness import Roundness, roundness
from validation.fits import concurrent_fits
from validation.lighting import GRAY_LEVELS

WEDGE = {"R": 90.0, "G": 180.0, "B": -90.0}
SHAPE = (90, 120, 3)


def response(angles_deg, strengths=(1.0, 1.0, 1.0), gray_levels=(30.0, 30.0, 30.0)):
    """Colours that brighten on what faces these azimuths."""
    radians = np.radians(angles_deg)
    slopes = -np.array(strengths)[:, None] * np.stack([np.cos(radians), np.sin(radians)], 1)
    return Response(slopes=slopes, contrast=np.array(gray_levels) / GRAY_LEVELS)


def places(angles_deg, lights_deg=None, **changes):
    return light_values(response(angles_deg, **changes), "RGB", lights_deg or WEDGE, True)


def press_of(radius_px=10.0, center_px=(60.0, 45.0), difference=None, **changes):
    made = {
        "file": "press.png",
        "difference": np.zeros(SHAPE, np.float32) if difference is None else difference,
        "center_px": center_px,
        "contact_radius_px": radius_px,
        "ball_radius_mm": 4.0,
        "mm_per_px": (0.1, 0.1),
    }
    return BallPress(**made | changes)


@pytest.mark.parametrize("turn", [-100.0, -30.0, 0.0, 30.0, 100.0])
def test_lights_that_are_all_turned_are_turned_and_neither_swapped_nor_leaking(turn):
    if abs(turn) > 45:  # a quarter turn could be colours in each other's place: no light sits at 0
        lights = {"R": 100.0, "G": 220.0, "B": -20.0}
        found = places([angle + turn / 4 for angle in lights.values()], lights)
        turn /= 4
    else:
        found = places([angle + turn for angle in WEDGE.values()])
    assert found["lights_turned_deg"][""] == pytest.approx(abs(turn))
    assert found["swapped_lights"] == {"": 0.0}
    assert found["cross_talk_share"] == pytest.approx(dict.fromkeys("RGB", 0.0), abs=1e-9)


def test_swapped_colours_count_and_are_no_turn():
    found = places([-90.0, 180.0, 90.0])
    assert found["swapped_lights"] == {"": 2.0}
    assert found["lights_turned_deg"][""] == pytest.approx(0, abs=1e-9)


def test_lights_a_little_off_are_in_their_own_places():
    """Another order of lights that lie close together may fit better by a few degrees."""
    lights = {"R": 0.0, "G": 20.0, "B": 180.0}
    assert places([12.0, 9.0, 180.0], lights)["swapped_lights"] == {"": 0.0}
    assert places([20.0, 0.0, 180.0], lights)["swapped_lights"] == {"": 2.0}


def test_cross_talk_is_the_sine_from_where_a_light_belongs_and_never_less_behind_it():
    common = np.degrees(np.arctan2(np.sin(np.radians(20)), 2 + np.cos(np.radians(20))))
    shares = places([110.0, 180.0, -90.0])["cross_talk_share"]
    assert shares["R"] == pytest.approx(np.sin(np.radians(20 - common)))
    assert shares["G"] == shares["B"] == pytest.approx(np.sin(np.radians(common)))
    assert places([-90.0, 180.0, -90.0])["cross_talk_share"]["R"] == 1.0  # red answers as blue


def test_a_wedge_s_lights_belong_on_the_axes_wherever_calibration_found_them():
    found = places([90.0, 180.0, -90.0], {"R": 75.0, "G": 180.0, "B": -90.0})
    assert found["cross_talk_share"] == pytest.approx(dict.fromkeys("RGB", 0.0), abs=1e-9)
    assert found["lights_turned_deg"][""] > 4
    ring = {"R": 15.0, "G": 135.0, "B": 255.0}
    assert places(list(ring.values()), ring)["cross_talk_share"] == pytest.approx(
        dict.fromkeys("RGB", 0.0), abs=1e-9
    )


def test_a_dead_light_has_no_place_and_axes_compare_as_the_lights_do():
    found = places([10.0, 180.0, -90.0], gray_levels=(0.9 * DEAD_GRAY_LEVELS, 30.0, 30.0))
    assert set(found["cross_talk_share"]) == {"G", "B"}
    assert found["contrast_gray_levels"]["R"] == pytest.approx(0.9 * DEAD_GRAY_LEVELS)
    assert found["lights_turned_deg"][""] == pytest.approx(0, abs=1e-9)
    # Red and blue along y, 1 and 1: the square root of 2; green along x: 3.
    apart = places([90.0, 180.0, -90.0], strengths=(1.0, 3.0, 1.0))
    assert apart["axes_ratio"][""] == pytest.approx(3 / np.sqrt(2))
    assert "axes_ratio" not in light_values(response([90, 180, -90]), "RGB", WEDGE, False)


@pytest.mark.parametrize("lights", [{"R": 45.0}, {"R": 45.0, "B": -135.0}])
def test_lights_on_one_oblique_line_that_should_see_both_axes_fail(lights):
    answers = response([lights.get(c, 0.0) for c in "RGB"])
    found = light_values(answers, "".join(lights), lights, True)
    assert [name for name, grade in grades(found).items() if grade == "fail"] == ["axes_ratio"]


@pytest.mark.parametrize(("angle", "turn"), [(190.0, -170.0), (-190.0, 170.0), (360.0, 0.0)])
def test_a_turn_is_told_the_shorter_way(angle, turn):
    assert turn_deg(angle) == turn


def test_the_blank_gel_of_two_lights_is_judged_by_them():
    gel = np.full(SHAPE, 0.4, np.float32)
    gel[..., 0] = np.linspace(0.2, 0.8, 120)[None]
    gel[..., 2] = 0.2
    found = blank_values(gel, "RB")
    seen = gel[inner(SHAPE)][0, :, 0]
    low, high = np.quantile(seen, [0.02, 0.98])
    assert found["evenness_share"] == pytest.approx({"R": low / high, "B": 1.0}, abs=0.01)
    assert found["color_balance_share"][""] == pytest.approx(0.2 / 0.5, rel=0.01)
    assert "color_balance_share" not in blank_values(gel, "R")
    gel[:, 60:] = 0.01
    assert blank_values(gel, "RB")["lit_share"][""] == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize("axes", ["xy", "x", "y"])
def test_slopes_are_known_where_noise_leaves_them_the_variance_of_least_squares(axes):
    gel = np.full(SHAPE, 0.4, np.float32)
    answers = response([0.0, 90.0, 0.0], strengths=(0.2, 0.1, 0.0))
    for share, known in ((0.99, True), (1.01, False)):
        # What is needed is known of the weaker light that sees it.
        strength = {"xy": 0.1, "x": 0.2, "y": 0.1}[axes]
        noise = dict.fromkeys("RG", share * KNOWN_SLOPE * strength * GRAY_LEVELS)
        assert usable_area(gel, answers, noise, axes, "RG").all() == known
        assert usable_area(gel, answers, noise, axes, "RG").any() == known


def test_lights_on_one_line_leave_the_other_axis_unknown_however_bright():
    gel, noise = np.full(SHAPE, 0.4, np.float32), dict.fromkeys("RG", 0.5)
    aslant = response([45.0, 225.0, 0.0])
    assert not usable_area(gel, aslant, noise, "xy", "RG").any()
    assert usable_area(gel, response([45.0, 135.0, 0.0]), noise, "xy", "RG").all()


def test_what_is_saturated_dark_or_worn_is_not_usable():
    gel, noise = np.full(SHAPE, 0.4, np.float32), dict.fromkeys("RG", 0.5)
    answers = response([0.0, 90.0, 0.0])
    gel[:, :30, 1] = SATURATED
    gel[:, 90:] = 0.02
    gel[40:46, 60:66] = 0.6  # worn
    usable = usable_area(gel, answers, noise, "xy", "RG")
    assert not usable[:, :30].any() and not usable[:, 96:].any()
    assert not usable[42:44, 62:64].any() and usable[:, 45:55].all()
    gel[:, :30, 1:] = (0.4, 1.0)  # blue has no light here
    assert usable_area(gel, answers, noise, "xy", "RG")[:, :10].all()


def test_noise_and_drift_are_those_of_the_gel_beyond_the_presses():
    rng = np.random.default_rng(0)
    drifts = np.arange(1, 12) / GRAY_LEVELS
    presses = []
    for drift in drifts:
        difference = rng.normal(drift, 4 / GRAY_LEVELS, SHAPE).astype(np.float32)
        difference[30:60, 45:75] += 1  # the press itself
        hidden = np.zeros(SHAPE[:2], bool)
        hidden[:, :20] = True
        difference[:, :20] = drift  # filled in, under dots
        presses.append(press_of(difference=difference, hidden=hidden))
    found = stillness(presses, "RG", 1)
    assert set(found["noise_gray_levels"]) == set(found["drift_gray_levels"]) == {"R", "G"}
    for color in "RG":
        assert found["noise_gray_levels"][color] == pytest.approx(4 / np.sqrt(2), rel=0.03)
        assert found["drift_gray_levels"][color] == pytest.approx(10, abs=0.2)
    assert stillness([press_of(radius_px=60.0)], "RGB", 1) == {}


def test_saturation_is_counted_inside_contacts_alone():
    blank = np.full(SHAPE, 0.5, np.float32)
    lit = np.zeros(SHAPE, np.float32)
    lit[:, 60:, 0] = 0.5  # half of the contact, and much beyond it
    shares = saturation([press_of(difference=lit), press_of()], blank, "RGB")
    assert shares == pytest.approx({"R": 0.25, "G": 0.0, "B": 0.0}, abs=0.02)


def test_a_press_covers_its_reach_on_a_pad_of_any_pitch():
    press = press_of(mm_per_px=(0.1, 0.1))
    area = np.pi * (REACH * press.contact_radius_px) ** 2
    assert covered_area([press]).sum() == pytest.approx(area, rel=0.02)
    other = press_of(center_px=(60.0, 45.0))
    assert (covered_area([press, other]) == covered_area([press])).all()


@pytest.mark.parametrize("sine", [0.2, 0.5])
def test_the_steepest_slope_is_at_the_rim_of_wide_contacts_not_of_the_one_widest(sine):
    presses = [press_of(radius_px=40 * sine) for _ in range(99)] + [press_of(radius_px=40.0)]
    angle = np.degrees(np.arcsin(sine))
    assert steepest_values(presses)["steepest_deg"][""] == pytest.approx(angle)
    assert steepest_values([press_of(radius_px=50.0)])["steepest_deg"] == {"": 90.0}


@pytest.mark.parametrize(
    ("channels", "lights", "fewer"),
    [
        ("RGB", WEDGE, ["RG", "RB", "R"]),
        ("RB", WEDGE, ["R"]),
        ("R", WEDGE, []),
        ("RGB", {"R": 15.0, "G": 135.0, "B": 255.0}, []),
        ("RGB", None, []),
    ],
)
def test_fewer_lights_are_some_of_a_wedge_s_own(calibration, channels, lights, fewer):
    card = replace(calibration.card, channels=channels, lights_deg=lights)
    assert fewer_lights(card) == fewer


def test_a_disc_s_roundness_is_told_beside_its_dots_and_as_most_presses_have_it(today):
    presses = read_presses(today).presses[:5]
    plain = roundness(presses, 0)
    assert plain is not None and plain.out_of_round < 0.03
    dotted = []
    for press in presses:
        x, y = (round(at) for at in press.center_px)
        hidden = np.zeros(SHAPE[:2], bool)
        hidden[:y, x:] = True  # a quarter of the disc
        filled = np.where(hidden[..., None], np.float32(0.5), press.difference)
        dotted.append(replace(press, difference=filled, hidden=hidden))
    found = roundness(dotted, 0)
    assert (found.stretch, found.shear) == pytest.approx((plain.stretch, plain.shear), abs=0.04)
    # Of three presses one may be anything.
    other = replace(presses[0], difference=np.ascontiguousarray(presses[0].difference[::-1]))
    three = [roundness([press], 0) for press in (other, *presses[1:3])]
    together = roundness([other, *presses[1:3]], 0)
    assert together.stretch == pytest.approx(np.median([one.stretch for one in three]))
    assert together.shear == pytest.approx(np.median([one.shear for one in three]))


@pytest.mark.parametrize("mm_per_px", [(0.05, 0.05), (0.05, 0.075), (0.07, 0.05)])
def test_a_ball_is_round_whatever_the_shape_of_pixels(mm_per_px):
    size = round(16 / mm_per_px[0]), round(12 / mm_per_px[1])
    cap = ball_cap(size, (0.45 * size[0], 0.55 * size[1]), 1.6, 3.0, mm_per_px)
    colors = (shaded(slopes) / 255 for slopes in (cap.gradient, 0 * cap.gradient))
    difference = np.subtract(*colors).astype(np.float32)
    pressed = replace(
        press_of(difference=difference, center_px=(0.45 * size[0], 0.55 * size[1])),
        contact_radius_px=1.6 / np.sqrt(np.prod(mm_per_px)),
        ball_radius_mm=3.0,
        mm_per_px=mm_per_px,
    )
    assert roundness([pressed], 0).out_of_round < 0.03
    longer = replace(pressed, mm_per_px=(1.1 * mm_per_px[0], mm_per_px[1]))
    assert 0.06 < roundness([longer], 0).stretch < 0.14


def test_dots_are_no_change_of_the_lights(tmp_path):
    """They are taken off today's blank gel and off that of the calibration."""
    unit = unit_of(dotted_set(tmp_path / "taught"))
    found = accepted_on(unit, dotted_set(tmp_path / "set", 1))
    assert max(found.values["brightness_change_share"].values()) < 0.01


def test_one_press_cannot_judge_fewer_lights(calibration, today):
    presses = read_presses(today).presses
    with concurrent_fits() as fits:
        for usable in (0, 1):
            assert fit_fewer_lights(calibration.card, presses[:usable], fits, seed=0) == {}


def test_a_disc_is_out_of_round_by_stretch_and_shear_together():
    assert Roundness(stretch=-0.03, shear=0.04).out_of_round == pytest.approx(0.05)
    assert roundness([press_of(center_px=(10.0, 45.0)), press_of(radius_px=44.0)], 0) is None


def test_few_frames_tell_no_times_and_numbers_that_repeat_make_up_for_no_loss():
    times_ns = [33_000_000 * i for i in range(LEAST_FRAMES)]
    few = times_ns[:-1]
    assert timing_values(few, range(len(few))) == {}
    numbers = [0, 0, 0, *range(4, LEAST_FRAMES + 1)]  # 1 to 3 are lost
    assert timing_values(times_ns, numbers)["lost_share"][""] == pytest.approx(
        3 / (LEAST_FRAMES + 3)
    )
    assert set(timing_values(times_ns, range(LEAST_FRAMES))) > {"jitter_ms", "frame_rate_hz"}


@pytest.mark.parametrize(
    ("frames", "said"),
    [(0, "have no times"), (LEAST_FRAMES - 1, f"only {LEAST_FRAMES - 1} frames"),
     (LEAST_FRAMES, "times do not increase")],
)  # fmt: skip
def test_why_there_is_no_jitter_is_told_by_how_many_frames_had_times(frames, said):
    assert said in _reasons({}, frames, 9)["jitter_ms"]
    assert "jitter_ms" not in _reasons({"jitter_ms": {"": 1.0}}, frames, 9)
    assert "cannot be split" in _reasons({}, frames, 1)["fewer_lights_x_deg"]


def test_jitter_is_what_one_interval_in_twenty_exceeds_and_lost_frames_are_none():
    intervals_ms = np.full(200, 33)
    intervals_ms[:9] = 53  # 4.5 %
    found = timing_values((np.cumsum(intervals_ms) * 1_000_000).tolist(), range(200))
    assert found["jitter_ms"] == {"": 0.0}
    intervals_ms[:13] = 53
    found = timing_values((np.cumsum(intervals_ms) * 1_000_000).tolist(), range(200))
    assert found["jitter_ms"] == {"": 20.0}
    kept = [i for i in range(200) if i % 7]
    found = timing_values([33_000_000 * i for i in kept], kept)
    assert found["jitter_ms"] == {"": 0.0} and found["longest_gap_ms"] == {"": 66.0}


def test_a_frame_that_is_lost_unnumbered_is_no_jitter():
    rng = np.random.default_rng(0)
    kept = np.flatnonzero(rng.random(400) > 0.12)
    times_ns = (kept * 33_333_333 + rng.normal(0, 3e5, len(kept))).astype(np.int64).tolist()
    numbered, unnumbered = (timing_values(times_ns, numbers) for numbers in (kept.tolist(), []))
    assert unnumbered["jitter_ms"][""] == pytest.approx(numbered["jitter_ms"][""], abs=0.05)
    assert numbered["jitter_ms"][""] < 1.0
    assert unnumbered["longest_gap_ms"] == numbered["longest_gap_ms"]


def test_bends_are_shares_of_the_spacing_and_few_dots_are_no_grid():
    rows, columns = np.mgrid[0:6, 0:8].reshape(2, -1)
    shares = []
    for spacing in (10.0, 20.0):
        bow = 0.01 * (columns - 3.5) ** 2
        points = spacing * np.stack([columns, rows + bow], 1).astype(float) + 20
        shares.append(bent_grid_share(points))
    assert shares[0] == pytest.approx(shares[1]) and shares[0] > 0
    assert shares[0] == pytest.approx(bow.std(), rel=0.1)
    few = points[(rows < 3) & (columns < 3)]
    assert len(few) < LEAST_DOTS and bent_grid_share(few) is None


def test_few_presses_fail_their_own_limit_however_small_their_errors(calibration, broken):
    spread = sorted(broken.labels, key=lambda label: label.center_x_px)[::3]
    write_labels(broken.folder / "labels.csv", spread)
    found = accepted_on(calibration, read_dataset(broken.folder))
    assert found.values["usable_presses"] == {"": len(spread)} == {"": 4}
    failed = {name for name in failed_of(found) if not name.startswith("fewer_lights")}
    assert {"usable_presses"} <= failed <= {"usable_presses", "covered_share"}
    assert any("4 presses: too few to trust" in doubt for doubt in found.doubts)


@pytest.mark.parametrize("metrics", [{}, {"depth_rmse_mm": 0.01}, {"depth_peak_truth_mm": 0.0}])
def test_a_unit_that_does_not_say_its_errors_fails_by_each_of_them(calibration, metrics):
    zeros = {"depth_rmse_mm": 0.01, "contact_curvature": 0.0} if metrics else {}
    card = replace(calibration.card, metrics=zeros | metrics)
    values = error_values(None, card) | ball_radius_values(None, card)
    expected = {"theta_x_deg", "theta_y_deg", "depth_rmse_share", "ball_radius_share"}
    assert {name for name, grade in grades(values).items() if grade == "fail"} == expected


def test_a_ball_s_radius_is_off_by_a_share_of_itself_not_of_its_curvature(calibration):
    for curvature, share in ((0.8, 0.25), (1.25, 0.2), (1.0, 0.0)):
        card = replace(calibration.card, metrics={"contact_curvature": curvature})
        assert ball_radius_values(None, card)["ball_radius_share"][""] == pytest.approx(share)
