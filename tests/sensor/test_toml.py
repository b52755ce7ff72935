# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import math
import os
import tomllib

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from sensor.errors import WedgeError, printable, shown
from sensor.marked import paper
from sensor.toml import (
    MOST_BYTES,
    finite,
    located,
    positive,
    positive_pair,
    read_toml,
    refuse_missing_keys,
    refuse_unknown_keys,
    text_line,
    toml_changed,
    toml_text,
)

bare_keys = st.text("abcXYZ019_-", min_size=1, max_size=8)
keys = st.text(max_size=6)
scalars = st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text()
values = st.recursive(
    scalars, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(keys, inner, max_size=4)
)


@given(st.dictionaries(bare_keys, values, max_size=6))
@example({"text": '"quoted" \\ back\tslash\n\r\0\x1f\x7f é 漢 🙂 \x85 \u2028 #'})
@example({"numbers": [1e-07, -0.0, 1e300, 5e-324, math.inf, -math.inf, 10**30, 0.1 + 0.2]})
def test_what_is_written_is_read_back(document):
    again = tomllib.loads(toml_text(document))
    assert again == document
    assert repr(again) == repr(document)  # types and the sign of zero too


def test_nan_is_written_as_toml_has_it():
    assert math.isnan(tomllib.loads(toml_text({"value": math.nan}))["value"])


def line_of(key, value):
    return toml_text({key: value}).rstrip("\n")


@given(st.data(), st.dictionaries(bare_keys, values, min_size=1, max_size=6))
def test_lines_that_stay_are_kept_to_the_letter_and_so_are_comments(data, before):
    end = data.draw(st.sampled_from(["\n", "\r\n"]))
    above = st.sampled_from(["", f"# it's \"[{{ or '''{end}", end, f" \t{end}"])
    around = st.sampled_from([("", ""), ("  ", "\t# \" it's } {"), (" ", " #")])
    after, given_lines, wanted_lines = {}, [], []
    for key, value in before.items():
        what = data.draw(st.sampled_from(["stays", "changes", "goes"]))
        (space, behind), comment = data.draw(around), data.draw(above)
        stays = space + line_of(key, value) + behind + end
        after |= {} if what == "goes" else {key: value if what == "stays" else ["other", 0.5]}
        changed = line_of(key, ["other", 0.5]) + behind + end
        given_lines += [comment, stays]
        wanted_lines += [comment, {"stays": stays, "changes": changed, "goes": ""}[what]]
    new = data.draw(st.dictionaries(bare_keys.filter(lambda key: key not in before), scalars))
    wanted_lines += [line_of(key, value) + end for key, value in new.items()]
    assert toml_changed("".join(given_lines), after | new) == "".join(wanted_lines)


EDITED = [
    'text = "a # no comment"  # a comment\n',
    "pair = [1, 2.50]\n",
    "many = [  # of which\n  1, # one\n  [ 2, ']' ],\n]  # behind\n",
    'long = """\n# no [comment\n\\""" nor here ""\n"""\n',
    "raw = '''# ' \" ''''\n\n",
    'inline = { a = [1], "b # c" = "}" } # {\n',
    "# of the table, \"it's\n[table] # head\n  x = 1 # one\n  # in between\n  y = { z = 2 }\n",
]
"""Each holds one value of a document as somebody may have written it."""


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("changed", range(len(EDITED)))
def test_a_document_written_by_hand_is_changed_where_it_must_be(changed, end):
    text = "".join(EDITED).replace("\n", end)
    document = tomllib.loads(text)
    assert toml_changed(text, document) == text
    assert toml_changed(text.removesuffix(end), document) == text
    found = toml_changed(text, document | {list(document)[changed]: 7})
    assert tomllib.loads(found) == document | {list(document)[changed]: 7}
    before, _, after = (
        "".join(part).replace("\n", end)
        for part in (EDITED[:changed], EDITED[changed], EDITED[changed + 1 :])
    )
    assert found.startswith(before) and found.endswith(after)
    comments = ["# a comment", "", "# behind", "", "", "# {", "# head"]
    assert comments[changed] in found and found.count("\n") == found.count(end)


def test_what_is_new_stands_before_the_tables():
    text = "name = 'x' # a\n\n# of the lights\n[lights]\nR = 1\n"
    found = toml_changed(text, {"name": "x", "lights": {"R": 1}, "size": [1.0, 2.0]})
    assert found == "name = 'x' # a\nsize = [1.0, 2.0]\n\n# of the lights\n[lights]\nR = 1\n"


@pytest.mark.parametrize(
    "text",
    ["[a]\nx = 1\n[b]\nx = 1 # kept\n", "a.x = 1\nb.x = 1\n", "[a]\nx = 1\n[a.b]\nx = 1\n"],
)
def test_no_layout_is_worth_a_wrong_value(text):
    document = tomllib.loads(text) | {"b": {"x": 2}, "c": 3}
    assert tomllib.loads(toml_changed(text, document)) == document


def test_numbers_of_subclasses_are_written_as_plain_numbers():
    numpy = pytest.importorskip("numpy")
    document = {"a": numpy.float64(0.25), "b": paper(60.0), "c": paper(7), "d": (1.0, 2.0)}
    assert tomllib.loads(toml_text(document)) == {"a": 0.25, "b": 60.0, "c": 7, "d": [1.0, 2.0]}


def test_a_value_without_a_form_is_refused():
    for value in (None, b"bytes", {1, 2}, object()):
        with pytest.raises(TypeError):
            toml_text({"key": value})


@given(st.binary(max_size=60) | st.text(max_size=60).map(lambda text: text.encode()))
@example(b"a = " + b"[" * 20_000)
@example(b"a = " + b"9" * 5000)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_bytes_are_a_document_or_a_sentence_that_names_the_file(tmp_path, content):
    path = tmp_path / "some.toml"
    path.write_bytes(content)
    try:
        assert isinstance(read_toml(path), dict)
    except WedgeError as error:
        assert str(error).startswith(f"{path} is not valid TOML")


def test_a_byte_order_mark_is_no_part_of_the_document(tmp_path):
    (tmp_path / "windows.toml").write_bytes(b"\xef\xbb\xbfname = 'x'\r\n")
    assert read_toml(tmp_path / "windows.toml") == {"name": "x"}


def test_a_missing_file_and_a_folder_are_sentences(tmp_path):
    with pytest.raises(WedgeError, match=r"none\.toml cannot be read: No such file"):
        read_toml(tmp_path / "none.toml")
    with pytest.raises(WedgeError, match="cannot be read"):
        read_toml(tmp_path)


def test_an_unknown_key_is_refused_with_the_nearest_known_one():
    with pytest.raises(WedgeError, match=r"unknown key licens; did you mean licence\?"):
        refuse_unknown_keys({"licens": 1}, ["name", "licence"], "")
    with pytest.raises(WedgeError, match=r"here: unknown key zzz; known: name, licence\."):
        refuse_unknown_keys({"zzz": 1}, ["name", "licence"], "here: ")
    refuse_unknown_keys({"name": 1}, ["name", "licence"], "")


def test_the_missing_key_is_named():
    with pytest.raises(WedgeError, match="the key b is missing"):
        refuse_missing_keys({"a": 1}, ("a", "b"))


def test_a_fault_is_located_once(tmp_path):
    path = tmp_path / "file.toml"
    once = located(path, WedgeError("a fault."))
    assert str(once) == f"{path}: a fault." == str(located(path, once))


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 10**400, True, "1", None, [1]])
def test_what_is_no_finite_number_is_refused_by_key(value):
    for check in (finite, positive):
        with pytest.raises(WedgeError, match="mm must be a finite number"):
            check(value, "mm")
    with pytest.raises(WedgeError, match="mm must be a finite number"):
        positive_pair([1.0, value], "mm")


def test_zero_and_less_are_not_positive():
    for value in (0, -0.0, -1e-9):
        with pytest.raises(WedgeError, match="mm must be a positive number"):
            positive(value, "mm")
    assert positive(2, "mm") == 2.0 and isinstance(positive(2, "mm"), float)


@pytest.mark.parametrize("value", [1.0, [1.0], [1.0, 2.0, 3.0], (1.0, 2.0), "12", {"x": 1, "y": 2}])
def test_what_is_no_pair_is_refused(value):
    with pytest.raises(WedgeError, match=r"mm must be a pair \[x, y\]"):
        positive_pair(value, "mm")


@pytest.mark.parametrize("value", ["", "  \n", "a\nb", "a\n", "a\u2028b", 3, None, ["a"]])
def test_what_is_no_line_of_text_is_refused(value):
    with pytest.raises(WedgeError, match="name must be a line of text"):
        text_line(value, "name")


HOSTILE = {
    "more digits than can be printed": "name = 0x" + "F" * 4000,
    "more than 64 bits in a table": "[gel]\nsizes = [1, 9223372036854775808]",
    "a key of many parts": "a" + ".a" * 20_000 + " = 1",
    "the same within a table": "x = {a" + " . a" * 20_000 + " = 1}",
    "quoted parts": '"a b"' + '. "a b"' * 20_000 + " = 1",
    "parts with quotes in them": r'"\""' + r' . "\""' * 20_000 + " = 1",
    "lists in each other": "x = " + "[" * 40 + "]" * 40,
    "tables in each other": "x = " + "{a = " * 40 + "1" + "}" * 40,
    "more than a file of ours": "x = '''" + "a\n" * MOST_BYTES + "'''",
}


@pytest.mark.parametrize("text", HOSTILE.values(), ids=HOSTILE)
def test_what_no_file_of_ours_has_is_one_short_sentence(tmp_path, text):
    (tmp_path / "file.toml").write_text(text)
    with pytest.raises(WedgeError, match=r"^[^\n]*file\.toml [^\n]*$") as said:
        read_toml(tmp_path / "file.toml")
    assert len(str(said.value)) < 300


def test_a_pipe_and_a_device_without_end_are_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "endless.toml").symlink_to("/dev/zero")
    for name, why in (("pipe", "is a pipe"), ("endless", "is longer than 4 MB")):
        with pytest.raises(WedgeError, match=why):
            read_toml(tmp_path / f"{name}.toml")


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_lines_may_end_as_on_any_system(tmp_path, end):
    text = f"# first.line.of.a.comment{end}a = 1{end}[b]{end}c.d.e = '''x{end}y'''{end}"
    (tmp_path / "file.toml").write_bytes(b"\xef\xbb\xbf" + text.encode())
    assert read_toml(tmp_path / "file.toml") == {"a": 1, "b": {"c": {"d": {"e": "x\ny"}}}}


@given(values)
def test_any_value_is_shown_in_a_line_and_not_all_of_a_long_one(value):
    said = shown(value)
    assert said.isprintable() and len(said) <= 101
    assert said == repr(value) or len(said) == 101 or not repr(value).isprintable()


def test_values_that_cannot_be_printed_are_named_by_their_kind():
    nested: list = []
    for _ in range(100_000):
        nested = [nested]
    assert shown(int("f" * 8000, 16)) == "a int too large to show"
    assert shown(nested) == "a list too large to show"
    instead = "\N{REPLACEMENT CHARACTER}"
    assert printable("\x1b[2J\x07ok") == f"{instead}[2J{instead}ok"
