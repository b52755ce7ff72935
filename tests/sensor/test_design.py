# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import math
from dataclasses import asdict, fields, is_dataclass, replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sensor.design import FINGER, STANDARD, Gel, Wedge
from sensor.errors import WedgeError
from sensor.marked import MarkedFloat, MarkedInt, chosen, datasheet, measured, paper, source_of

DESIGNS = pytest.mark.parametrize("design", [STANDARD, FINGER], ids=["standard", "finger"])


def parts(design):
    return [item.name for item in fields(design) if is_dataclass(getattr(design, item.name))]


def numbers(design):
    """Every (part, field, value) of a design that is a number."""
    return [
        (part, item.name, value)
        for part in parts(design)
        for item in fields(getattr(design, part))
        if isinstance(value := getattr(getattr(design, part), item.name), int | float)
        and not isinstance(value, bool)
    ]


def bounds():
    return [
        pytest.param(part, item.name, item.metadata, id=f"{part}.{item.name}")
        for part in parts(STANDARD)
        for item in fields(getattr(STANDARD, part))
        if "low" in item.metadata
    ]


def with_number(design, part, name, value):
    return replace(design, **{part: replace(getattr(design, part), **{name: value})})


@DESIGNS
def test_every_number_says_where_it_comes_from(design):
    assert len(numbers(design)) > 35
    for part, name, value in numbers(design):
        assert isinstance(value, MarkedFloat | MarkedInt), f"{part}.{name} has no source"
        assert value.source in ("paper", "datasheet", "measured", "chosen"), f"{part}.{name}"


@DESIGNS
def test_every_number_has_bounds(design):
    bounded = {
        (part, item.name)
        for part in parts(design)
        for item in fields(getattr(design, part))
        if "low" in item.metadata
    }
    assert {(part, name) for part, name, _ in numbers(design)} == bounded


def test_the_widths_are_those_of_the_plan():
    assert STANDARD.outer_width_mm == pytest.approx(34.0)
    assert FINGER.outer_width_mm == pytest.approx(17.2)


@DESIGNS
def test_what_the_paper_states_is_marked_so(design):
    stated = {
        "gel.semi_axis_across_mm": 60,
        "gel.semi_axis_normal_mm": 60,
        "gel.semi_axis_along_mm": 100,
        "acrylic.thickness_mm": 4.5,
        "mirror.angle_deg": 30,
        "camera.diagonal_view_deg": 120,
        "camera.width_px": 640,
        "camera.height_px": 480,
        "camera.frames_per_second": 60,
        "lights.led_length_mm": 3.5,
        "lights.led_width_mm": 2.8,
        "lights.gray_filter_transmission": 0.25,
        "wiring.supply_v": 3.3,
    }
    from_paper = {f"{p}.{n}": v for p, n, v in numbers(design) if source_of(v) == "paper"}
    assert from_paper == stated


@pytest.mark.parametrize("mark", [paper, datasheet, measured, chosen])
def test_a_marked_number_computes_like_any_other(mark):
    for plain in (3, 2.5):
        marked = mark(plain)
        assert marked == plain and hash(marked) == hash(plain) and str(marked) == str(plain)
        assert isinstance(marked, type(plain)) and marked * 2 == plain * 2
        assert source_of(marked) == mark.__name__
    assert source_of(1.0) == "chosen"


@pytest.mark.parametrize(("part", "name", "bound"), bounds())
@pytest.mark.parametrize("side", ["low", "high"])
def test_beyond_a_bound_the_field_and_the_bounds_are_named(part, name, bound, side):
    low, high = bound["low"], bound["high"]
    beyond = low - 1 if side == "low" else high + 1
    with pytest.raises(WedgeError) as caught:
        with_number(STANDARD, part, name, beyond)
    assert f"{part}.{name} = {beyond} is outside its bounds {low:g} to {high:g}." == str(
        caught.value
    )


@pytest.mark.parametrize(("part", "name", "bound"), bounds())
@pytest.mark.parametrize("value", [math.nan, math.inf, 10**400, "3", None, True, [1.0]])
def test_what_is_no_number_is_refused_by_field(part, name, bound, value):
    with pytest.raises(WedgeError, match=rf"^{part}\.{name} "):
        with_number(STANDARD, part, name, value)


@pytest.mark.parametrize("name", ["width_px", "height_px"])
def test_counts_are_whole_numbers(name):
    with pytest.raises(WedgeError, match=f"camera.{name} must be a whole number, not 640.0"):
        with_number(STANDARD, "camera", name, 640.0)


@pytest.mark.parametrize(
    ("part", "changes", "sentence"),
    [
        ("gel", {"pad_length_mm": 36.5}, r"gel\.pad_length_mm = 36\.5 .* acrylic\.length_mm = 36"),
        ("gel", {"pad_width_mm": 27.5}, r"gel\.pad_width_mm = 27\.5 .* acrylic\.width_mm = 27"),
        (
            "gel",
            {"thickness_mm": 2.4},
            r"gel\.thickness_mm = 2\.4 leaves 0\.14 mm .* at least 0\.3 mm",
        ),
        ("gel", {"semi_axis_across_mm": 12.0}, r"gel\.pad_width_mm = 25\.5 reach beyond"),
        ("lights", {"led_width_mm": 4.6}, r"lights\.led_width_mm = 4\.6 .* acrylic\.thickness_mm"),
        ("lights", {"red_side_leds": 11}, r"lights\.red_side_leds = 11 .* 36 mm: take fewer\.$"),
        ("lights", {"blue_side_leds": 11}, r"lights\.blue_side_leds = 11 .* 36 mm: take fewer\.$"),
        ("lights", {"green_base_leds": 8}, r"lights\.green_base_leds = 8 .* 27 mm: take fewer\.$"),
        (
            "lights",
            {"red_side_leds": 0, "blue_side_leds": 0, "green_base_leds": 0},
            "lights has no LED",
        ),
        ("camera", {"projection": "fisheye"}, r"camera\.projection = 'fisheye' must be"),
    ],
)
def test_what_cannot_be_built_is_refused_with_the_fields_and_the_bound(part, changes, sentence):
    with pytest.raises(WedgeError, match=sentence):
        replace(STANDARD, **{part: replace(getattr(STANDARD, part), **changes)})


any_value = st.one_of(
    st.floats(),
    st.floats(0, 120),
    st.integers(-5, 200),
    st.integers(),
    st.booleans(),
    st.none(),
    st.text(max_size=3),
)


@given(
    st.sampled_from([STANDARD, FINGER]),
    st.dictionaries(
        st.sampled_from([(p, n) for p, n, _ in numbers(STANDARD)]),
        any_value,
        min_size=1,
        max_size=8,
    ),
)
def test_a_random_design_is_whole_or_refused(base, changes):
    by_part = {}
    for (part, name), value in changes.items():
        by_part.setdefault(part, {})[name] = value
    try:
        design = replace(
            base, **{part: replace(getattr(base, part), **made) for part, made in by_part.items()}
        )
    except WedgeError:
        return
    for derived in (
        design.outer_width_mm,
        design.total_thickness_mm,
        *design.pad_size_mm,
        design.camera.focal_length_px,
        design.gel.corner_thickness_mm,
    ):
        assert math.isfinite(derived) and derived > 0
    assert design.outer_width_mm > design.acrylic.width_mm >= design.gel.pad_width_mm
    assert design.lights.azimuths_deg and len(design.sha256) == 64


@DESIGNS
def test_the_hash_is_of_every_number_and_not_of_the_name(design):
    plain = replace(
        design,
        name="another",
        **{
            part: replace(
                getattr(design, part),
                **{n: type(v).__base__(v) for p, n, v in numbers(design) if p == part},
            )
            for part in parts(design)
        },
    )
    assert plain.sha256 == design.sha256
    hashes = {design.sha256}
    for part, name, value in numbers(design):
        changed = value - 1 if isinstance(value, int) else value + 0.001
        hashes.add(with_number(design, part, name, changed).sha256)
    hashes.add(replace(design, gel=replace(design.gel, curved=False)).sha256)
    assert len(hashes) == len(numbers(design)) + 2


@pytest.mark.parametrize(
    ("part", "name", "values"),
    [("acrylic", "thickness_mm", (3, 3.0)), ("laser", "mirror_kerf_mm", (0.0, -0.0))],
)
def test_equal_designs_have_one_hash(part, name, values):
    whole, same = (with_number(STANDARD, part, name, value) for value in values)
    assert whole == same and whole.sha256 == same.sha256 != STANDARD.sha256


@given(st.floats(-17, 17), st.floats(-12.7, 12.7))
def test_the_skin_lies_on_the_ellipsoid(x_mm, y_mm):
    gel = STANDARD.gel
    height = gel.thickness_at_mm(x_mm, y_mm) - gel.thickness_mm + gel.semi_axis_normal_mm
    assert (
        (x_mm / gel.semi_axis_along_mm) ** 2
        + (y_mm / gel.semi_axis_across_mm) ** 2
        + (height / gel.semi_axis_normal_mm) ** 2
    ) == pytest.approx(1)
    assert gel.corner_thickness_mm <= gel.thickness_at_mm(x_mm, y_mm) <= gel.thickness_mm


def test_a_flat_slab_has_one_thickness_whatever_its_axes():
    flat = Gel(**{**asdict(STANDARD.gel), "curved": False, "semi_axis_across_mm": 10.0})
    assert flat.thickness_at_mm(15.0, 12.0) == flat.corner_thickness_mm == flat.thickness_mm


def test_half_the_diagonal_view_reaches_the_pictures_corner():
    camera = STANDARD.camera
    assert camera.focal_length_px * math.radians(60) == pytest.approx(400)
    pinhole = replace(camera, projection="pinhole")
    assert pinhole.focal_length_px * math.tan(math.radians(60)) == pytest.approx(400)


def test_a_side_without_leds_has_no_azimuth():
    assert STANDARD.lights.azimuths_deg == {"R": 90.0, "G": 180.0, "B": -90.0}
    two = with_number(STANDARD, "lights", "green_base_leds", 0)
    assert set(two.lights.azimuths_deg) == {"R", "B"}


def test_a_design_cannot_be_changed_in_place():
    with pytest.raises(AttributeError):
        STANDARD.gel.thickness_mm = 1.0
    assert isinstance(replace(STANDARD, name="copy"), Wedge)
