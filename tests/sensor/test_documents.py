# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import json
import os

import pytest

from sensor.documents import json_bytes, text_bytes


def test_what_is_no_finite_number_is_written_as_null() -> None:
    infinite = float("inf")
    document = {"mean": 0.5, "ci95": (-infinite, infinite), "rows": [{"a": float("nan"), "b": 1}]}
    read = json.loads(json_bytes(document), parse_constant=pytest.fail)
    assert read == {"mean": 0.5, "ci95": [None, None], "rows": [{"a": None, "b": 1}]}


def test_words_stand_as_they_are_and_the_last_line_ends() -> None:
    text = json_bytes(["θx, Müller"]).decode()
    assert "θx, Müller" in text and text.endswith("\n")


def test_a_name_that_is_not_utf_8_is_written_as_utf_8_and_read_back() -> None:
    name = os.fsdecode(b"press \xff.png")
    written = json_bytes({name: [name]})
    assert json.loads(written.decode("utf-8")) == {name: [name]}
    assert text_bytes(f"θ {name}").decode("utf-8") == "θ press \\udcff.png"
