# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import json

import pytest

from sensor.documents import json_bytes


def test_what_is_no_finite_number_is_written_as_null() -> None:
    infinite = float("inf")
    document = {"mean": 0.5, "ci95": (-infinite, infinite), "rows": [{"a": float("nan"), "b": 1}]}
    read = json.loads(json_bytes(document), parse_constant=pytest.fail)
    assert read == {"mean": 0.5, "ci95": [None, None], "rows": [{"a": None, "b": 1}]}


def test_words_stand_as_they_are_and_the_last_line_ends() -> None:
    text = json_bytes(["θx, Müller"]).decode()
    assert "θx, Müller" in text and text.endswith("\n")
