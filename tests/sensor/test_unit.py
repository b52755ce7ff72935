# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sensor.errors import WedgeError
from sensor.unit import UnitCard, read_unit_card, write_unit_card
from tests.synthetic import KEYSTONE_PX

CARD = UnitCard(
    serial="wedge-001",
    created="2026-03-01",
    design_sha256="ab" * 32,
    dataset="a set",
    dataset_sha256="cd" * 32,
    estimator="mlp",
    channels="RGB",
    missing_axis="none",
    mm_per_px=(0.1, 0.1),
    frame_size_px=(160, 120),
    size_px=(120, 90),
    metrics={"theta_x_deg": 3.25},
    corners_px=KEYSTONE_PX,
    pad_size_mm=(12.0, 9.0),
    lights_deg={"R": 90.0, "G": 180.0, "B": -90.0},
    markers={"count": 63, "spacing_mm": 1.5, "diameter_mm": 0.5},
    learnt_frames=("ef", "01"),
    learnt_truths=("23", "45"),
)
lines = st.text(min_size=1, max_size=20).filter(lambda x: x.strip() and x.splitlines() == [x])
sides = st.integers(1, 8192)
pairs = st.tuples(st.floats(1e-6, 100), st.floats(1e-6, 100))


@given(
    st.builds(
        UnitCard,
        serial=lines,
        created=st.dates().map(str),
        design_sha256=st.none() | lines,
        dataset=lines,
        dataset_sha256=lines,
        estimator=lines,
        channels=st.sampled_from(["R", "G", "B", "RG", "RB", "GB", "RGB"]),
        missing_axis=st.sampled_from(["none", "zero", "network"]),
        mm_per_px=pairs,
        frame_size_px=st.tuples(sides, sides),
        size_px=st.tuples(sides, sides),
        metrics=st.dictionaries(st.text(max_size=8), st.floats(0, 1e9), max_size=4),
        corners_px=st.just(KEYSTONE_PX),
        lights_deg=st.none() | st.just({"R": 90.0, "G": 180.0, "B": -90.0}),
    ),
    st.booleans(),
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_card_comes_back_as_written(tmp_path, card, keystone):
    length, width = (n * pitch for n, pitch in zip(card.size_px, card.mm_per_px, strict=True))
    card = replace(card, pad_size_mm=(length, width))
    if not keystone:
        card = replace(card, corners_px=None, pad_size_mm=None)
    write_unit_card(tmp_path, card)
    assert read_unit_card(tmp_path) == card


def test_it_says_that_it_is_measured_and_not_for_editing(tmp_path):
    write_unit_card(tmp_path, CARD)
    assert (tmp_path / "unit.toml").read_text().startswith("# Written by `wedge calibrate`")


def test_numbers_of_numpy_are_numbers(tmp_path):
    numpy = pytest.importorskip("numpy")
    write_unit_card(tmp_path, replace(CARD, metrics={"theta_x_deg": numpy.float64(3.25)}))
    assert read_unit_card(tmp_path) == CARD


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"metrics": {"rmse_mm": float("nan")}}, r"metrics\.rmse_mm must be a finite number"),
        ({"serial": "wedge-\udcff"}, "cannot be written as text"),
        ({"metrics": {"\udcff": 1.0}}, "cannot be written as text"),
        ({"metrics": {"theta_x_deg": -1.0}}, r"metrics\.theta_x_deg = -1 must not be negative"),
        (
            {"lights_deg": {"R": 90.0, "G": 180.0}},
            "lights_deg must say where the light of B is, too",
        ),
        ({"size_px": (100, 400)}, "gives 120 pixels, but size_px says 100"),
    ],
)
def test_a_card_that_could_not_be_read_back_is_not_written(tmp_path, wrong, sentence):
    with pytest.raises(WedgeError, match=sentence):
        write_unit_card(tmp_path, replace(CARD, **wrong))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('serial = "wedge-001"', "", "the key serial is missing"),
        ('serial = "wedge-001"', "serial = 1", "serial must be a line of text"),
        ("serial", "seriel", "unknown key seriel; did you mean serial"),
        ('created = "2026-03-01"', "created = 2026-03-01", "created must be a line of text"),
        ('"2026-03-01"', '"soon"', 'created = "soon" must be a day, such as "2026-03-01"'),
        ('"2026-03-01"', '"2026-02-30"', 'created = "2026-02-30" must be a day'),
        ('"2026-03-01"', '"20260301"', 'created = "20260301" must be a day'),
        ('channels = "RGB"', 'channels = "BGR"', 'channels = "BGR" must be some of R, G and B'),
        ('channels = "RGB"', 'channels = ""', "channels must be a line of text"),
        ('missing_axis = "none"', 'missing_axis = "z"', "must be one of none, zero, network"),
        ('missing_axis = "none"', "missing_axis = []", "must be one of none, zero, network"),
        ("mm_per_px = [0.1, 0.1]", "mm_per_px = [0.1]", "mm_per_px must be a pair"),
        ("[160, 120]", "[160, 0]", r"frame_size_px must be \[width, height\] in whole pixels"),
        ("[160, 120]", "[160.0, 120.0]", r"frame_size_px must be \[width, height\]"),
        ("[160, 120]", "[160, true]", r"frame_size_px must be \[width, height\]"),
        ("size_px = [120, 90]", "size_px = [120, 1000000000]", "1 to 8192, not"),
        ("size_px = [120, 90]", "size_px = [100, 400]", "gives 120 pixels, but size_px says 100"),
        ("size_px = [120, 90]", "size_px = [118, 90]", "gives 120 pixels, but size_px says 118"),
        ("mm_per_px = [0.1, 0.1]", "mm_per_px = [0.1, 1.0]", "gives 9 pixels, but size_px says 90"),
        ("{theta_x_deg = 3.25}", "{theta_x_deg = nan}", r"metrics\.theta_x_deg must be a finite"),
        ("{theta_x_deg = 3.25}", "3.25", "metrics must be a table of numbers"),
        ("[20.0, 10.0]", "[20.0]", "corners_px must be four"),
        ("pad_size_mm = [12.0, 9.0]", "", "corners_px and pad_size_mm must be given together"),
        ("corners_px = ", "# ", "corners_px and pad_size_mm must be given together"),
        ("[20.0, 10.0]", "[200.0, 200.0]", "convex pad"),
        ("R = 90.0", "X = 90.0", "lights_deg must be a table"),
        ("diameter_mm = 0.5", "diameter_mm = 0.0", "markers: every number must be above zero"),
        ('["ef", "01"]', '"ef"', "learnt_frames must be a list of fingerprints"),
        ('["ef", "01"]', '["ef", 1]', "learnt_frames must be a line of text"),
        ('["23", "45"]', '["23"]', "learnt_truths must have one fingerprint for each"),
        ("serial = ", "serial == ", "is not valid TOML"),
    ],
)
def test_a_card_that_is_wrong_is_refused_by_file_and_key(tmp_path, old, new, sentence):
    write_unit_card(tmp_path, CARD)
    path = tmp_path / "unit.toml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(WedgeError, match=rf"unit\.toml.*{sentence}"):
        read_unit_card(tmp_path)


def test_another_folder_is_no_unit(tmp_path):
    with pytest.raises(WedgeError, match=r"is not a unit folder: it has no unit\.toml"):
        read_unit_card(tmp_path)
    with pytest.raises(WedgeError, match=r"nowhere does not exist: name a unit folder"):
        read_unit_card(tmp_path / "nowhere")
