# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the commands write: JSON that every reader takes, one file for each thing."""

import json
from pathlib import Path

import pytest

from app._output import output_names, write_json
from sensor.errors import WedgeError


def refuse_constant(word: str) -> None:
    raise AssertionError(f"{word} is not JSON")


def test_what_is_no_finite_number_is_written_as_null(tmp_path: Path) -> None:
    infinite = float("inf")
    document = {"mean": 0.5, "ci95": (-infinite, infinite), "rows": [{"a": float("nan"), "b": 1}]}
    write_json(tmp_path / "a.json", document)
    text = (tmp_path / "a.json").read_text()
    read = json.loads(text, parse_constant=refuse_constant)
    assert read == {"mean": 0.5, "ci95": [None, None], "rows": [{"a": None, "b": 1}]}


def test_names_are_those_of_the_images_and_of_the_frame_in_an_archive() -> None:
    images = ["a/press.png", "b/frames.npz#17", "frames.npz#1"]
    assert output_names(images, [".npy"]) == ["press", "frames-17", "frames-1"]


@pytest.mark.parametrize(
    ("images", "twice"),
    [
        (("a/press.png", "b/press.jpg"), "press.npy"),
        (("frames.npz#1", "frames-1.png"), "frames-1.npy"),
        (("press.png", "press-doubt.png"), "press-doubt.png"),
        (("press-doubt.png", "press.png"), "press-doubt.png"),
    ],
)
def test_two_images_of_one_file_are_refused(images: tuple[str, ...], twice: str) -> None:
    with pytest.raises(WedgeError, match=f"two images would be written to {twice}: rename one"):
        output_names(images, (".npy", ".png", "-doubt.png"))
