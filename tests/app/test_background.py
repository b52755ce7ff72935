# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A background in another light, or on which something touches, is taken, and that is said once."""

import json
from pathlib import Path

import numpy as np
import pytest

from app._remarks import background_remarks
from recon.calibration import load_calibration, unit_of_set
from recon.fast import FastReconstructor
from recon.images import read_image, write_image
from tests.app.commands import run
from tests.app.test_watching import _Endless, until, watching
from tests.recon.fast.units import make_unit
from tests.shading import pressed
from tests.synthetic import make_dataset


def dimmed(image: np.ndarray, share: float, colors: str = "RGB") -> np.ndarray:
    gains = [1 - share if color in colors else 1.0 for color in "RGB"]
    return np.rint(image * gains).astype(np.uint8)


@pytest.fixture(scope="module")
def workplace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A unit, the blank gel and a press, both as bright as then, dimmer, and too dim."""
    folder = tmp_path_factory.mktemp("workplace")
    dataset = make_dataset(folder / "set", presses=8)
    unit_of_set(dataset, "table").save(folder / "unit")
    for name, share in (("same", 0.0), ("near", 0.2), ("dim", 0.6)):
        for index, file in enumerate(("background.png", dataset.labels[0].file)):
            (folder / name).mkdir(exist_ok=True)
            write_image(
                folder / name / f"frame-{index}.png",
                dimmed(read_image(dataset.folder / file), share, "RG"),
            )
    return folder


@pytest.mark.parametrize("light", ["same", "near", "dim"])
@pytest.mark.parametrize("command", ["reconstruct", "cloud", "track", "track first"])
def test_commands_say_once_that_the_light_is_another(
    command: str,
    light: str,
    workplace: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    frames, numbers = workplace / light, tmp_path / "numbers.json"
    name, _, first = command.partition(" ")
    source = frames if name == "track" else frames / "frame-1.png"
    blank = first or frames / "frame-0.png"
    words = [name, workplace / "unit", source, "--background", blank, "--json", numbers]
    assert run(*words, "--out", tmp_path / "out") == 0
    said = [line for line in capsys.readouterr().err.splitlines() if "brightness" in line]
    remarks = [line for line in json.loads(numbers.read_text())["remarks"] if "brightness" in line]
    assert said == remarks and len(said) == (light == "dim")
    if said:
        assert said[0].startswith("The first frame" if first else str(blank))
        assert "by 60% in red, 60% in green: slopes and depth" in said[0]


def test_the_units_own_background_and_colours_without_a_light_are_not_judged() -> None:
    unit = make_unit((160, 120), channels="RB")
    assert background_remarks(unit, None, "it") == []
    assert background_remarks(unit, dimmed(unit.background, 0.5, "G"), "it") == []
    (said,) = background_remarks(unit, dimmed(unit.background, 0.6, "GB"), "it")
    assert said.startswith("it differs in brightness") and "by 60% in blue:" in said


@pytest.mark.parametrize("command", ["reconstruct", "cloud", "track", "track first"])
def test_commands_say_once_that_something_touches_on_the_background(
    command: str, workplace: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    frames, numbers = tmp_path / "frames", tmp_path / "numbers.json"
    for index, file in enumerate(("frame-1.png", "frame-0.png")):  # the press comes first
        write_image(frames / f"frame-{index}.png", read_image(workplace / "near" / file))
    name, _, first = command.partition(" ")
    source = frames if name == "track" else frames / "frame-1.png"
    blank = first or frames / "frame-0.png"
    words = [name, workplace / "unit", source, "--background", blank, "--json", numbers]
    assert run(*words, "--out", tmp_path / "out") == 0
    said = [line for line in capsys.readouterr().err.splitlines() if "something touches" in line]
    assert len(said) == 1 and said[0] in json.loads(numbers.read_text())["remarks"]
    assert said[0].startswith("The first frame" if first else str(blank))


@pytest.mark.parametrize("dim", [0.0, 0.2, 0.6])
def test_a_touch_on_a_background_is_told_from_its_light(dim: float, workplace: Path) -> None:
    unit = load_calibration(workplace / "unit")
    blank, touched = (read_image(workplace / "same" / f"frame-{i}.png") for i in (0, 1))
    bare = background_remarks(unit, dimmed(blank, dim, "RG"), "it")
    assert not any("something touches" in said for said in bare)
    said = background_remarks(unit, dimmed(touched, dim, "RG"), "it")
    assert [("brightness" in x, "something touches" in x) for x in said] == [(dim > 0.5, dim < 0.5)]


def test_a_large_touch_on_a_background_is_not_taken_for_another_light() -> None:
    unit = make_unit((160, 120))
    touched = unit.background + 255 * pressed((160, 120), (80.0, 60.0), 26.0, 32.0, noise=0.0)
    (said,) = background_remarks(unit, touched.clip(0, 255).round().astype(np.uint8), "it")
    assert "something touches" in said


def test_the_page_says_until_the_next_background_that_something_touched(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    unit, depth = make_unit((160, 120)), 1.0

    def picture(index: int) -> np.ndarray:
        noise = np.random.default_rng(index).normal(0, 1, unit.background.shape)
        press = 255 * depth * pressed((160, 120), (80.0, 60.0), 18.0, 30.0, noise=0.0)
        return np.clip(unit.background + press + noise, 0, 255).round().astype(np.uint8)

    FastReconstructor(unit)  # compiled before anything is waited for
    seen = watching(monkeypatch, tmp_path, lambda: _Endless(picture), unit)
    seen.start()
    try:
        until(lambda: seen.live)
        seen.take_background()
        until(lambda: seen.message[0] == 1)
        assert seen.message[1].startswith("Saved") and "something touches" in seen.remark
        depth = 0.0
        bare = unit.background.astype(float)
        until(lambda: seen.frame is not None and np.abs(seen.frame - bare).max() < 9)
        seen.take_background()
        until(lambda: seen.message[0] == 2)
        assert seen.remark == ""
    finally:
        seen.close()


def test_the_page_says_so_until_a_background_is_taken_in_the_light_of_the_calibration(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    unit, share = make_unit((160, 120)), 0.3

    def picture(index: int) -> np.ndarray:
        noise = np.random.default_rng(index).integers(0, 2, unit.background.shape, np.uint8)
        ramp = np.linspace(1 - share, 1, 160)[None, :, None]  # one side's lights have dimmed
        return np.rint(unit.background * ramp).astype(np.uint8) + noise

    FastReconstructor(unit)  # compiled before anything is waited for
    seen = watching(monkeypatch, tmp_path, lambda: _Endless(picture), unit)
    seen.start()
    try:
        until(lambda: seen.live)
        assert seen.remark == ""
        seen.take_background()
        until(lambda: seen.message[0] == 1)
        assert "The background differs in brightness" in seen.remark
        share = 0.0
        until(lambda: seen.frame is not None and seen.frame.mean() > unit.background.mean() - 1)
        seen.take_background()
        until(lambda: seen.message[0] == 2)
        assert seen.remark == ""
    finally:
        seen.close()
