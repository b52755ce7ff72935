# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Pictures come in the order in which a person counts them, whatever order a disk lists them in."""

import itertools
from pathlib import Path

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from recon.picture_names import in_order, picture_names

NAMES = st.text("0019ab.#-_é²٣", min_size=1, max_size=12)


@given(st.lists(NAMES, unique=True, max_size=8), st.randoms())
@example(["press1.png", "press1.jpg", "press01.png"], None)
@example(["a1", "a01", "a"], None)
def test_order_depends_on_the_names_alone(names: list[str], random: object) -> None:
    orders = itertools.permutations(names) if random is None else [random.sample(names, len(names))]
    assert all(sorted(order, key=in_order) == sorted(names, key=in_order) for order in orders)
    assert len({in_order(name) for name in names}) == len(names)


@given(st.lists(NAMES, min_size=3, max_size=3))
def test_the_order_is_one(names: list[str]) -> None:
    first, second, third = sorted(map(in_order, names))
    assert first <= second <= third and first <= third


@given(st.integers(0, 10**25), st.integers(0, 10**25), st.text("ab._", max_size=3))
def test_numbers_count_by_their_value(one: int, other: int, text: str) -> None:
    first, second = (in_order(f"{text}press{number}{text}.png") for number in (one, other))
    assert (first < second) == (one < other)


@pytest.mark.parametrize(
    "names",
    [
        ["press.png", "press1.png", "press2.png", "press10.png"],
        ["1_2.png", "1_10.png", "2_1.png"],
        ["frames.npz#2", "frames.npz#10"],
        ["1700000000123456788.jpg", "1700000000123456789.jpg"],
        ["press9" + 5000 * "9" + ".png", "press10" + 5000 * "0" + ".png"],
    ],
)
def test_two_comes_before_ten(names: list[str]) -> None:
    assert sorted(reversed(names), key=in_order) == names


def test_hidden_files_and_what_is_no_picture_are_passed_over(tmp_path: Path) -> None:
    for name in ("10.PNG", "2.jpeg", "._2.jpeg", ".png", "notes.txt", "frames.npz", "1.tif"):
        (tmp_path / name).touch()
    assert picture_names(tmp_path) == ["1.tif", "2.jpeg", "10.PNG"]
