# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
import argparse
from pathlib import Path

import numpy as np

from recon.training.further_courses import between, name_sensors, words_of


def test_sensors_are_named_by_the_words_that_name_them_again():
    parser = argparse.ArgumentParser()
    name_sensors(parser)
    told = parser.parse_args("--sensor a/balls b/one two --sensor more set".split()).sensor
    assert told == [[Path("a/balls"), Path("b/one"), Path("two")], [Path("more"), Path("set")]]
    words = words_of(told)
    assert words == "--sensor balls one two --sensor more set"
    assert words_of(parser.parse_args(words.split()).sensor) == words


def test_weights_lie_on_the_line_between_two_courses():
    first, after = ({"a": np.full((2, 3), value, np.float32)} for value in (1.0, 5.0))
    for share, expected in ((0.0, 1.0), (0.25, 2.0), (1.0, 5.0)):
        found = between(first, after, share)["a"]
        assert found.dtype == np.float32 and (found == expected).all()
