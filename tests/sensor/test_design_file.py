# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from sensor.design import FINGER, STANDARD
from sensor.design_file import design_text, load_design
from sensor.errors import WedgeError
from sensor.toml import toml_text

BASE = 'base = "standard"\n'


def written(tmp_path, text):
    path = tmp_path / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return str(path)


def test_known_designs_are_found_by_name():
    assert load_design("standard") is STANDARD and load_design("finger") is FINGER


def test_a_file_changes_some_numbers_of_its_base(tmp_path):
    path = written(tmp_path, 'base = "finger"\nname = "thin"\n[acrylic]\nthickness_mm = 3\n')
    expected = replace(FINGER, name="thin", acrylic=replace(FINGER.acrylic, thickness_mm=3.0))
    assert load_design(path) == expected
    assert load_design(path).sha256 == expected.sha256  # 3 in the file is 3.0


def test_a_file_without_a_name_is_named_after_the_file(tmp_path):
    assert load_design(written(tmp_path, BASE)) == replace(STANDARD, name="mine")


@pytest.mark.parametrize("text", ["", "[mirror]\nlength_mm = 25.0\n", "name = 'standard'"])
def test_a_file_without_a_base_is_no_design(tmp_path, text):
    with pytest.raises(WedgeError, match=r"mine\.toml has no base"):
        load_design(written(tmp_path, text))


@pytest.mark.parametrize("name", ["R&D", "Größe 2", "it's", "v1.2 (thin)", "指" * 60])
def test_a_name_is_any_line_of_text_that_a_folder_can_have(name, tmp_path):
    design = load_design(written(tmp_path, toml_text({"base": "standard", "name": name})))
    assert design.name == name
    (tmp_path / design.name).mkdir()


def test_every_value_can_be_written_and_read(tmp_path):
    for design in (STANDARD, FINGER):
        again = load_design(written(tmp_path, design_text(design)))
        assert (again, again.sha256) == (design, design.sha256)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("color = 1", "unknown key color"),
        (
            "[gel]\nthicknes_mm = 3.0",
            r"unknown key gel\.thicknes_mm; did you mean gel\.thickness_mm",
        ),
        ("[gel]\nthickness_mm = 'thick'", r"gel\.thickness_mm must be a number, not 'thick'"),
        (
            "[gel]\nthickness_mm = 99.0",
            r"gel\.thickness_mm = 99\.0 is outside its bounds 0\.5 to 10",
        ),
        ("[gel]\nthickness_mm = [1.0]", r"gel\.thickness_mm must be a number"),
        ("[gel]\nthickness_mm = 2026-01-01", r"gel\.thickness_mm must be a number"),
        ("[gel]\nthickness_mm = nan", r"gel\.thickness_mm = nan is outside"),
        ("[gel]\nthickness_mm = 1" + "0" * 400, r"gel\.thickness_mm must be a finite number"),
        ("[gel.thickness_mm]\na = 1", r"gel\.thickness_mm must be a value"),
        ("[gel]\ncurved = 1", r"gel\.curved must be true or false, not 1"),
        ("[camera]\nwidth_px = 640.5", r"camera\.width_px must be a whole number"),
        ("[camera]\nprojection = 3", r"camera\.projection must be text"),
        ("gel = 3", "gel must be a table"),
        ("name = 3", "name must be text"),
        ("name = ''", "name = '' must be 1 to 60 printable characters"),
        ("name = '../../esc'", r"name = '\.\./\.\./esc' must be .* without / and"),
        (r"name = 'a\b'", r"name = 'a\\\\b' must be"),
        ('name = "a\\u0000b"', r"name = 'a\\x00b' must be"),
        ('name = "two\\nlines"', r"name = 'two\\nlines' must be"),
        ("name = '..'", r"name = '\.\.' must be .* no dot at its start"),
        ("name = ' '", "name = ' ' must be .* no space at its ends"),
        (f"name = '{'n' * 61}'", "must be 1 to 60 printable"),
        ('base = "large"', "base = 'large' must be one of standard, finger"),
        ('base = ["standard"]', "base = .* must be one of standard, finger"),
        ("base = {}", "base = .* must be one of"),
        ("gel = ", "is not valid TOML"),
        ("[gel]\n[gel]\n", "is not valid TOML"),
    ],
)
def test_a_file_that_cannot_work_is_refused_by_its_name_and_key(tmp_path, text, sentence):
    with pytest.raises(WedgeError, match=rf"mine\.toml.*{sentence}"):
        load_design(written(tmp_path, text if "base" in text else BASE + text))


def test_what_is_neither_a_design_nor_a_file_is_refused(tmp_path):
    with pytest.raises(WedgeError, match=r"'small' is neither a design \(standard, finger\)"):
        load_design("small")
    with pytest.raises(WedgeError, match=r"none\.toml cannot be read"):
        load_design(str(tmp_path / "none.toml"))


scalars = st.one_of(st.floats(), st.integers(), st.booleans(), st.text(max_size=4))
values = scalars | st.lists(scalars, max_size=2) | st.dictionaries(st.text(max_size=3), scalars)
parts = st.sampled_from(["gel", "acrylic", "mirror", "camera", "lights", "housing"])
names = st.sampled_from(["thickness_mm", "curved", "projection", "width_px", "led_width_mm", "x"])


@given(
    st.dictionaries(parts, st.dictionaries(names, values, max_size=3) | values, max_size=3),
    st.dictionaries(st.sampled_from(["base", "name", "colour"]), values, max_size=2),
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_document_is_a_design_or_a_sentence(tmp_path, tables, others):
    path = written(tmp_path, toml_text({"base": "standard", **others, **tables}))
    try:
        assert load_design(path).outer_width_mm > 0
    except WedgeError as error:
        assert str(error).startswith(path)


@pytest.mark.parametrize("design", [None, ["standard"], 3])
def test_what_is_neither_a_name_nor_a_file_is_refused(design):
    with pytest.raises(WedgeError, match=r"a design is a name .* or a \.toml file, not "):
        load_design(design)
