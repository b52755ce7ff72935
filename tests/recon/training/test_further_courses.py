# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import json
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from safetensors import safe_open

from recon.training.further_courses import between, command_of, course_parser, presses_of
from sensor.errors import WedgeError

MODULE = "recon.training.contact_further"


def test_a_course_s_command_names_the_same_course_again():
    parser = course_parser(MODULE, None, seed=1, steps=6000)
    words = "w.safetensors --sensor a/balls b/one two --sensor more set --seed 2 --out c/new"
    told = parser.parse_args(words.split())
    assert told.sensor == [
        [Path("a/balls"), Path("b/one"), Path("two")],
        [Path("more"), Path("set")],
    ]
    command = command_of(MODULE, told, "--after 0.3")
    assert command == (
        "python -m recon.training.contact_further w.safetensors --sensor balls one two "
        "--sensor more set --seed 2 --steps 6000 --after 0.3 --out new"
    )
    begin = f"python -m {MODULE} "
    again = parser.parse_args(command_of(MODULE, told).removeprefix(begin).split())
    assert command_of(MODULE, again, "--after 0.3") == command


def test_the_shipped_networks_commands_are_what_the_programs_would_write():
    for name, further in (("contact", 0), ("missing_axis", 4)):
        with safe_open(files("recon") / "weights" / f"{name}.safetensors", "numpy") as weights:
            (kept,) = (json.loads(text)["command"] for text in weights.metadata().values())
        module, *words = kept.removeprefix("python -m ").split()
        more, words = words[-2 - further : -2], [*words[: -2 - further], *words[-2:]]
        told = course_parser(module, None, seed=0, steps=0).parse_args(words)
        assert command_of(module, told, *more) == kept


def test_that_no_press_is_felt_is_a_sentence():
    sensors = [[Path("balls"), Path("one")], [Path("more"), Path("set"), Path("other")]]
    told = [("balls", 1), ("more", 2)]
    assert presses_of(sensors, lambda balls, sets: [(balls.name, len(sets))]) == told
    with pytest.raises(WedgeError, match="no rendered press is felt"):
        presses_of(sensors, lambda *_: [])


def test_weights_lie_on_the_line_between_two_courses():
    first, after = ({"a": np.full((2, 3), value, np.float32)} for value in (1.0, 5.0))
    for share, expected in ((0.0, 1.0), (0.25, 2.0), (1.0, 5.0)):
        found = between(first, after, share)["a"]
        assert found.dtype == np.float32 and (found == expected).all()
