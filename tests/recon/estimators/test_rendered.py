# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Rendered pixels, seen by sensors whose light is a known mix of the rendered one's."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safetensors.numpy import save

from benchmarks.rendered_pixels import joined, sensor_arrays
from benchmarks.rendered_presses import random_presses
from recon.estimators.rendered import (
    FILE,
    STEEPEST,
    VERSION,
    drawn_evenly,
    left_by_mix,
    matched_light,
    read_rendered,
    rendered_pixels,
    rendered_sensors,
    unlike,
)
from recon.estimators.shading import Taught, blank_colors, color_changes, fit_light
from recon.estimators.surroundings import ASPECTS
from recon.unet.weights import sha256_of
from sensor.design_file import load_design
from sensor.errors import WedgeError
from simulation.presses import skin_under
from simulation.skin import gel_view
from tests.synthetic import (
    SIZE_PX,
    gradient_of,
    make_dataset,
    make_deeper_set,
    make_rendered_set,
    shaded,
)

UNTOLD = (0.25, 0.25, 0.25, 0.4)
"""Of each sensor's colours, at most; shading tells least of the last, of gel 6.5 mm thick."""


def mixed(change, position, columns=3):
    """Colours swapped, weakened, and more so to one side."""
    swapped = change[:, [2, 0, 1]][:, :columns] * np.float32([0.8, 0.5, 1.2])[:columns]
    return swapped * (1 + 0.3 * position[:, :1])


def twisted(slopes):
    """The product of the normal's components along x and y."""
    return (slopes[:, :1] * slopes[:, 1:]) / (1 + (slopes**2).sum(1, keepdims=True))


def balls(sensor, columns=3, noise=0.0, seed=0, own=0.0, deep=0.0):
    """Pixels as a sensor of such mixed light has them, and its light.

    ``own`` is how much it answers, with all colours alike, to slopes that rise to the upper right;
    ``deep`` how far the balls are from the rendered sensor's shallow ones to its deep ones.
    """
    shading = sensor.shading
    rng = np.random.default_rng(seed)
    slopes, position = rng.uniform(-0.7, 0.7, (2, 3000, 2)).astype(np.float32)
    blank = np.tile(np.float32([0.4, 0.5, 0.6])[:columns], (3000, 1))
    answer = shading.shallow + np.float32(deep) * (shading.deep - shading.shallow)
    change = mixed(color_changes(answer, slopes, position), position, columns)
    change += own * twisted(slopes)
    color = change * blank + noise * rng.standard_normal(blank.shape)
    press = np.repeat(np.arange(10, dtype=np.int32), 300)
    cap = shading.caps[0] + np.float32(deep) * (shading.caps[1] - shading.caps[0])
    taught = Taught(
        color=color.astype(np.float32),
        position=position,
        slopes=slopes,
        cap=np.full(len(press), cap, np.float32),
        press=press,
    )
    return taught, fit_light(position, blank)


def described(pixels):
    """Place and slope of each."""
    return map(tuple, np.concatenate([pixels.position, pixels.slopes], 1).tolist())


@cache
def pixels_of_the_first():
    """Where the first rendered sensor's are.

    Flat gel of several presses may lie at one place, and is left out.
    """
    return {at: i for i, at in enumerate(described(rendered_sensors()[0])) if any(at[2:])}


def found_again(seen):
    """Where pixels that are seen are, and where they come from in the first rendered sensor's."""
    known = pixels_of_the_first()
    own = [(at, known[pixel]) for at, pixel in enumerate(described(seen)) if pixel in known]
    return np.array(own).T


def test_the_shipped_sensors_have_slopes_that_no_ball_shows_and_gel_that_is_flat():
    for sensor in rendered_sensors():
        steepness = np.linalg.norm(sensor.slopes, axis=1)
        assert (steepness > STEEPEST).mean() > 0.01 and (steepness < 0.01).mean() > 0.1
        assert sensor.around.shape == (len(sensor.slopes), 3 * ASPECTS)
        assert np.abs(sensor.position).max() <= 1
        arrays = {**vars(sensor), **vars(sensor.shading)}
        del arrays["name"], arrays["shading"]
        assert all(np.isfinite(values).all() for values in arrays.values())


def test_the_shading_of_each_shipped_sensor_tells_most_of_its_gentle_pixels_colours():
    for sensor, most in zip(rendered_sensors(), UNTOLD, strict=True):
        steepness = np.linalg.norm(sensor.slopes, axis=1)
        some = (steepness > 0.1) & (steepness < 0.5)
        told = color_changes(sensor.shading.shallow, sensor.slopes[some], sensor.position[some])
        left = ((sensor.change[some] - told) ** 2).sum() / (sensor.change[some] ** 2).sum()
        assert left < most


def test_pixels_of_more_presses_are_added_to_those_of_the_same_sensor_alone():
    def arrays(name, count, light):
        return {f"{name}.slopes": np.full((count, 2), light), f"{name}.deep": np.full(3, light)}

    found = joined(arrays("a", 5, 1) | arrays("b", 4, 2), arrays("a", 3, 7) | arrays("c", 2, 9))
    assert {name: len(found[f"{name}.slopes"]) for name in "abc"} == {"a": 8, "b": 4, "c": 2}
    assert found["a.slopes"][:, 0].tolist() == [1] * 5 + [7] * 3
    assert found["a.deep"].tolist() == [7] * 3 and found["b.deep"].tolist() == [2] * 3


@pytest.mark.parametrize("columns", [3, 2, 1])
def test_a_mixed_light_is_matched_whatever_colours_are_lit(columns):
    sensor = rendered_sensors()[0]
    taught, light = balls(sensor, columns)
    match = matched_light(sensor.shading, taught, light)
    assert match.mix.shape == (9, columns) and match.unexplained < 1e-4


@pytest.mark.parametrize("columns", [3, 2, 1])
@pytest.mark.parametrize("sensor", rendered_sensors(), ids=["finger", "standard", "4 mm", "6.5 mm"])
def test_balls_that_go_in_deep_tell_the_mix_that_shallow_ones_tell(sensor, columns):
    (shallow, light), (deep, _) = (balls(sensor, columns, deep=deep) for deep in (0.0, 1.0))
    assert np.abs(shallow.color - deep.color).max() > 0.01  # they look otherwise
    one, other = (matched_light(sensor.shading, taught, light) for taught in (shallow, deep))
    assert other.deepness == 1 and other.unexplained < 1e-4
    np.testing.assert_allclose(other.mix, one.mix, atol=0.02)  # its ridge takes a little
    as_shallow = matched_light(sensor.shading, replace(deep, cap=shallow.cap), light)
    assert np.abs(as_shallow.mix - one.mix).max() > 0.06


def test_balls_deeper_than_any_rendered_one_are_taken_to_be_half_as_deep_again():
    sensor = rendered_sensors()[0]
    taught, light = balls(sensor, deep=1.5)
    match = matched_light(sensor.shading, replace(taught, cap=100 * taught.cap), light)
    assert match.deepness == 1 and match.unexplained < 1e-4


@pytest.mark.parametrize("deep", [0.0, 1.0])
def test_what_the_mix_leaves_is_nothing_where_it_explains_all(deep):
    sensor = rendered_sensors()[0]
    taught, light = balls(sensor, deep=deep)
    left = left_by_mix(sensor.shading, matched_light(sensor.shading, taught, light), taught, light)
    assert np.abs(color_changes(left, taught.slopes, taught.position)).max() < 4e-3


def test_pixels_come_in_the_colours_of_the_sensor_at_hand():
    sensor = rendered_sensors()[0]
    taught, light = balls(sensor)
    seen, _ = rendered_pixels(taught, light, np.nan, 4000, seed=0)
    assert 3900 < len(seen.slopes) <= 4000
    here, there = found_again(seen)
    assert len(here) > 2000  # the sensor whose light fits counts most
    place = sensor.position[there]
    blank = blank_colors(light, place)
    np.testing.assert_allclose(
        seen.color[here], mixed(sensor.change[there], place) * blank, atol=2e-3
    )
    wide = sensor.around[there][:, 3:6]
    np.testing.assert_allclose(seen.around[here, 3:6], mixed(wide, place) * blank, atol=2e-3)


@pytest.mark.parametrize("columns", [3, 2, 1])
def test_whatever_is_lit_all_of_a_sensors_pixels_are_drawn_from(columns):
    sensor = rendered_sensors()[0]
    taught, light = balls(sensor, columns)
    seen, _ = rendered_pixels(taught, light, np.nan, 4000, seed=0)
    _, there = found_again(seen)
    tenths = np.histogram(there, 10, (0, len(sensor.slopes)))[0] / len(there)
    assert len(there) > 2000
    np.testing.assert_allclose(tenths, 0.1, atol=0.03)


@pytest.mark.parametrize("columns", [3, 1])
def test_what_no_mix_explains_is_told_by_the_balls_and_kept_within_their_slopes(columns):
    sensor = rendered_sensors()[0]
    taught, light = balls(sensor, columns, own=0.2)
    seen, _ = rendered_pixels(taught, light, np.nan, 4000, seed=0)
    here, there = found_again(seen)
    place, slopes = sensor.position[there], sensor.slopes[there]
    steepness = np.linalg.norm(slopes, axis=1)
    gentle = steepness < 0.6
    blank = blank_colors(light, place)
    by_mix = mixed(sensor.change[there], place, columns)
    missed = np.abs(seen.color[here] / blank - by_mix - 0.2 * twisted(slopes))[gentle]
    assert missed.mean() < 0.15 * np.abs(0.2 * twisted(slopes))[gentle].mean()
    beyond = np.abs(seen.color[here] / blank - by_mix)[steepness > 1.2]
    assert len(beyond) > 20 and beyond.max() < 0.2 * np.abs(twisted(taught.slopes)).max() * 1.5


def test_a_sensor_whose_gel_follows_as_far_is_drawn_from_most():
    one, *_, other = sorted(rendered_sensors(), key=lambda sensor: float(sensor.collar[0]))
    assert abs(np.log(one.collar[0] / other.collar[0])) > 0.3
    taught, light = balls(one, noise=0.3)  # neither explains much
    places = [set(described(sensor)) for sensor in (one, other)]

    def shares(collar):
        drawn, _ = rendered_pixels(taught, light, float(collar), 3000, seed=0)
        seen = list(described(drawn))
        return [sum(pixel in known for pixel in seen) / len(seen) for known in places]

    unknown, as_one, as_other = (shares(at) for at in (np.nan, one.collar[0], other.collar[0]))
    assert as_one[0] > unknown[0] > as_other[0] and as_other[1] > unknown[1] > as_one[1]
    beyond = shares(100 * max(one.collar[0], other.collar[0]))
    assert beyond[int(one.collar[0] < other.collar[0])] > 0.95  # the nearest, however far


def test_the_less_a_light_is_like_any_rendered_one_the_fewer_pixels_come():
    taught, light = balls(rendered_sensors()[0], noise=0.3)
    some, unexplained = rendered_pixels(taught, light, np.nan, 1000, seed=0)
    assert len(some.slopes) == round(1000 * (1 - unexplained)) and 0.3 < unexplained < 1
    dark = Taught(**{**vars(taught), "color": np.zeros_like(taught.color)})
    none, everything = rendered_pixels(dark, light, np.nan, 1000, seed=0)
    assert len(none.slopes) == 0 and everything == 1


def test_only_a_sensor_lit_as_the_rendered_one_is_like_it():
    standard = next(sensor for sensor in rendered_sensors() if sensor.name == "standard")
    taught, light = balls(standard)
    assert unlike("standard", taught, light) > 0.2  # its colours are mixed
    own = color_changes(standard.shading.shallow, taught.slopes, taught.position)
    blank = blank_colors(light, taught.position)
    as_rendered = replace(taught, color=own * blank)
    assert unlike("standard", as_rendered, light) < 1e-6
    brighter = replace(taught, color=2 * own * blank), fit_light(taught.position, 2 * blank / 1.2)
    assert unlike("standard", *brighter) == pytest.approx((1 - 1 / 1.2) ** 2, abs=0.02)
    assert unlike("finger", as_rendered, light) > 0.05
    assert unlike("standard", replace(taught, color=0 * taught.color), light) == 1


@settings(deadline=None)
@given(things=st.integers(1, 40), count=st.integers(0, 200), seed=st.integers(0, 9))
def test_none_is_drawn_a_second_time_before_all_were_drawn_once(things, count, seed):
    drawn = drawn_evenly(np.random.default_rng(seed), things, count)
    often = np.bincount(drawn, minlength=things)
    assert len(drawn) == count and len(often) == things
    assert often.max() - often.min() <= 1


def test_what_is_drawn_is_left_to_chance():
    first = [drawn_evenly(np.random.default_rng(seed), 20, 5) for seed in range(400)]
    often = np.bincount(np.concatenate(first), minlength=20)
    np.testing.assert_allclose(often, 100, atol=50)


def test_the_same_seed_draws_the_same():
    taught, light = balls(rendered_sensors()[0])
    one, two, other = (
        rendered_pixels(taught, light, np.nan, 50, seed=seed)[0] for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(one.color, two.color)
    assert not np.array_equal(one.color, other.color)


def test_a_file_of_another_version_or_with_other_numbers_is_refused(tmp_path):
    arrays = {"a.change": np.zeros((1, 3), np.float16)}
    good = {"version": VERSION, "sha256": sha256_of(arrays)}
    for made, word in (
        ({**good, "version": "0"}, "is of version 0"),
        ({**good, "sha256": "0"}, "is damaged"),
        ([], "is of version unknown"),
    ):
        path = tmp_path / "rendered.safetensors"
        path.write_bytes(save(arrays, {"rendered": json.dumps(made)}))
        with pytest.raises(WedgeError, match=word):
            read_rendered(path)
    path.write_bytes(FILE.read_bytes()[:5000])
    with pytest.raises(WedgeError, match="cannot be read"):
        read_rendered(path)
    with pytest.raises(WedgeError, match="cannot be read"):
        read_rendered(tmp_path / "none.safetensors")


def test_random_objects_press_into_the_gel_and_come_again():
    design = load_design("standard")
    view = gel_view(design, 320)
    some = random_presses(design, (96,), 4, seed=3)
    again, others = (random_presses(design, (96,), 4, seed=seed) for seed in (3, 4))
    for press, same, other in zip(some, again, others, strict=True):
        skin, twice, else_ = (skin_under(design, view, one) for one in (press, same, other))
        assert 0.5 * press.depth_mm < skin.depth_mm.max() <= press.depth_mm + 1e-9
        assert skin.contact.any() and (skin.depth_mm[skin.contact] > 0).all()
        np.testing.assert_array_equal(skin.depth_mm, twice.depth_mm)
        assert not np.array_equal(skin.depth_mm, else_.depth_mm)


def test_pixels_that_are_kept_have_the_slopes_and_the_colours_of_their_frames(tmp_path):
    balls = make_dataset(tmp_path / "balls", presses=5).folder
    deep = make_deeper_set(tmp_path / "deep", presses=5).folder
    pressed = make_rendered_set(tmp_path / "pressed", presses=2, seed=5, noise_gray_levels=0)
    kept = sensor_arrays(balls, deep, [pressed.folder])
    fewer = sensor_arrays(balls, deep, [pressed.folder], 600)
    assert len(fewer["slopes"]) == 600 and (fewer["shallow"] == kept["shallow"]).all()
    assert np.isfinite(kept["collar"]).all() and kept["collar"].shape == (1,)
    assert 0 < kept["caps"][0] < kept["caps"][1]
    with pytest.raises(WedgeError, match="go in no deeper than"):
        sensor_arrays(deep, balls, [pressed.folder])
    width, height = SIZE_PX
    column, row = ((kept["position"] + 1) * [width, height] / 2 - 0.5).round().astype(int).T
    slopes = np.stack([gradient_of((x.center_x_px, x.center_y_px, x.contact_radius_px))
                       for x in pressed.labels])  # fmt: skip
    of = np.repeat([0, 1], len(row) // 2)
    true = slopes[of, row, column]
    inside = (true != 0).any(1) & (kept["slopes"] != 0).all(1)
    assert inside.sum() > 500
    assert np.abs(kept["slopes"] - true)[inside].mean() < 0.02  # the rim is sharp
    light, blank = np.stack([shaded(one) for one in slopes]), shaded(0 * slopes[0])
    change = light[of, row, column] / blank[row, column] - 1
    assert np.abs(kept["change"] - change)[inside].mean() < 0.03
    told = color_changes(kept["shallow"], true.astype(np.float32), np.float32(kept["position"]))
    assert np.abs(told - change)[inside].mean() < 0.1 * np.abs(change)[inside].mean()
