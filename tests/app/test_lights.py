# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A colour without a light is said, and is dead where a design has one."""

import re
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from app._lights import lights_remark
from recon.images import read_image, write_image
from recon.labels.circles import Circle
from sensor.dataset import read_dataset, write_card, write_labels
from sensor.design import FINGER
from sensor.unit import read_unit_card
from tests.app.commands import run
from tests.synthetic import BALL_RADIUS_MM, LIGHTS_DEG, SIZE_PX, make_dataset

RED_AND_BLUE = {"R": 90.0, "B": -90.0}

pytestmark = pytest.mark.usefixtures("in_this_process")


@pytest.fixture
def frames(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Raw frames of a sensor without green, on the gel plane, whose circles need no search."""
    made = make_dataset(tmp_path / "made", presses=3, lights_deg=RED_AND_BLUE)
    (tmp_path / "frames").mkdir()
    for name in ("background.png", *(label.file for label in made.labels)):
        shutil.copy(made.folder / name, tmp_path / "frames" / name)
    sought = iter(made.labels * 9)

    def circle(*_: object) -> Circle:
        label = next(sought)
        return Circle(center_px=label.center_px, radius_px=label.contact_radius_px, quality=1.0)

    monkeypatch.setattr("recon.labels.capture.find_circle", circle)
    monkeypatch.setattr("recon.labels.find_circles.find_circle", circle)
    return tmp_path / "frames"


def test_two_lights_are_taken_as_two_and_the_third_is_said_to_be_missing(
    frames: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ball, out = ("--ball-radius-mm", BALL_RADIUS_MM), tmp_path / "out"
    pad_mm = ("--pad-size-mm", 0.1 * SIZE_PX[0], 0.1 * SIZE_PX[1])
    for words in (("data", "import"), ("capture",)):
        assert run(*words, frames, "--out", out, *ball, *pad_mm) == 0
        said = capsys.readouterr().out
        assert "Green shows no light: the sensor is taken to have two lights" in said
        lights_deg = read_dataset(out).card.lights_deg
        assert lights_deg is not None and set(lights_deg) == {"R", "B"}
        shutil.rmtree(out)


@pytest.mark.parametrize("greens", [1, 0])
def test_a_light_that_the_design_has_and_no_press_shows_is_dead(
    frames: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], greens: int
) -> None:
    """The unit then has it all the same, so that `wedge accept` asks for its contrast."""
    design = tmp_path / "own.toml"
    design.write_text(
        'base = "finger"\n'
        f"[gel]\npad_length_mm = {0.1 * SIZE_PX[0]}\n"
        f"[lights]\ngreen_base_leds = {greens}\n"
    )
    ball, said = ("--ball-radius-mm", BALL_RADIUS_MM), "design own has one: its LED is dead"
    fitted = ("--design", design, "--estimator", "table")
    assert run("capture", frames, "--out", tmp_path / "set", *ball, "--design", design) == 0
    assert (said in capsys.readouterr().out) == bool(greens)
    shutil.copytree(tmp_path / "set", tmp_path / "two")
    card = read_dataset(tmp_path / "two").card
    write_card(tmp_path / "two" / "dataset.toml", replace(card, lights_deg=RED_AND_BLUE))
    assert run("calibrate", tmp_path / "set", "--out", tmp_path / "unit0", *fitted[2:]) == 0
    capsys.readouterr()
    assert run("calibrate", tmp_path / "two", "--out", tmp_path / "unit1", *fitted) == 0
    assert (said in capsys.readouterr().out) == bool(greens)
    assert run("calibrate", frames, "--out", tmp_path / "unit2", *ball, *fitted) == 0
    assert capsys.readouterr().out.count(said) == greens
    for unit in ("unit0", "unit1", "unit2"):
        assert read_unit_card(tmp_path / unit).channels == ("RGB" if greens else "RB")


def test_a_colour_whose_light_the_design_does_not_have_is_left_out(
    frames: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A camera's filters overlap: blue shows some of red's light, and would pass for a light."""
    design = tmp_path / "own.toml"
    design.write_text(
        'base = "finger"\n'
        f"[gel]\npad_length_mm = {0.1 * SIZE_PX[0]}\n"
        "[lights]\ngreen_base_leds = 0\nblue_side_leds = 0\n"
    )
    words = ("--ball-radius-mm", BALL_RADIUS_MM, "--design", design)
    said = "Blue changes with the presses, but the design own has no such light"
    assert run("capture", frames, "--out", tmp_path / "set", *words) == 0
    assert said in capsys.readouterr().out
    assert set(read_dataset(tmp_path / "set").card.lights_deg or ()) == {"R"}
    fitted = ("--estimator", "table", "--out", tmp_path / "unit")
    assert run("calibrate", frames, *words, *fitted) == 0
    assert said in capsys.readouterr().out
    assert read_unit_card(tmp_path / "unit").channels == "R"


def test_a_light_that_a_card_leaves_out_on_purpose_is_not_dead(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = make_dataset(tmp_path / "set", presses=3)
    assert set(made.card.lights_deg or ()) == set("RGB")
    card = replace(made.card, lights_deg=RED_AND_BLUE)
    write_card(made.folder / "dataset.toml", card)
    words = ("--design", "finger", "--estimator", "table", "--out", tmp_path / "unit")
    assert run("calibrate", made.folder, *words) == 0
    assert "LED" not in capsys.readouterr().out
    assert read_unit_card(tmp_path / "unit").channels == "RB"


@pytest.mark.parametrize("lights_deg", [RED_AND_BLUE, {"R": 45.0}, LIGHTS_DEG])
def test_lights_on_one_line_that_nobody_stated_are_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], lights_deg: dict[str, float]
) -> None:
    made = make_dataset(tmp_path / "set", presses=3, lights_deg=lights_deg)
    card = made.folder / "dataset.toml"
    stated = card.read_text()
    write_card(card, replace(made.card, lights_deg=None))
    words = ("calibrate", made.folder, "--estimator", "table", "--out")
    assert run(*words, tmp_path / "unsaid") == 0
    said = capsys.readouterr().out
    assert read_unit_card(tmp_path / "unsaid").missing_axis == "none"
    if lights_deg == LIGHTS_DEG:
        assert "lights_deg" not in said
        return
    (asked,) = re.findall(r"write (lights_deg = \{.*\})\s+into", said)
    assert tomllib.loads(asked) == {"lights_deg": lights_deg}
    card.write_text(stated)
    assert run(*words, tmp_path / "said") == 0
    assert "along one line only" not in capsys.readouterr().out


@pytest.mark.parametrize("is_swapped", [True, False])
def test_colours_in_each_other_s_place_are_said_by_whoever_knows_the_design(
    frames: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], is_swapped: bool
) -> None:
    """A camera's blue, green and red, taken for red, green and blue."""
    for path in frames.iterdir():
        write_image(path, read_image(path)[..., :: -1 if is_swapped else 1])
    design = tmp_path / "own.toml"
    design.write_text(
        'base = "finger"\n'
        f"[gel]\npad_length_mm = {0.1 * SIZE_PX[0]}\n"
        "[lights]\ngreen_base_leds = 0\n"
    )
    ball, said = ("--ball-radius-mm", BALL_RADIUS_MM), "Red and blue lie in each other's place"
    fitted = ("--estimator", "table", "--out", tmp_path / "unit")
    captured = tmp_path / "set"
    for words in (
        ("capture", frames, "--out", captured, *ball),
        ("data", "import", frames, "--out", tmp_path / "imported", *ball),
        ("calibrate", frames, *fitted, *ball),
        ("calibrate", captured, *fitted),
    ):
        shutil.rmtree(tmp_path / "unit", ignore_errors=True)
        assert run(*words, "--design", design) == 0
        assert " ".join(capsys.readouterr().out.split()).count(said) == is_swapped


@pytest.mark.parametrize("design", [(), ("--design", "finger")])
@pytest.mark.parametrize(
    ("stated", "off"),
    [
        ({"R": 0.0, "B": 180.0}, {"R": (90, 0), "B": (-90, 180)}),
        ({"R": 90.0, "G": 0.0, "B": -90.0}, {"G": (180, 0)}),
        ({"R": 450.0, "G": -180.0, "B": 270.0}, {}),
        ({"R": 130.0, "B": -130.0}, {}),
    ],
)
def test_lights_that_are_stated_elsewhere_than_presses_show_them_are_said(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    design: tuple[str, ...],
    stated: dict[str, float],
    off: dict[str, tuple[int, int]],
) -> None:
    made = make_dataset(tmp_path / "set", presses=6)
    write_card(made.folder / "dataset.toml", replace(made.card, lights_deg=stated))
    words = ("--estimator", "table", "--out", tmp_path / "unit", *design)
    assert run("calibrate", made.folder, *words) == 0
    said = " ".join(capsys.readouterr().out.split())
    found = re.findall(r"The presses show lights at (.*), but (.*) states (.*?):", said)
    assert len(found) == bool(off)
    for shown, file, claimed in found:
        assert file == str(made.folder / "dataset.toml")
        assert claimed == ", ".join(f"{color} = {at}°" for color, (_, at) in off.items())
        measured = dict(re.findall(r"(\w) = (-?\d+)°", shown))
        assert measured.keys() == off.keys()
        for color, (at, _) in off.items():
            assert abs((float(measured[color]) - at + 180) % 360 - 180) <= 3


@pytest.mark.parametrize("stated", [LIGHTS_DEG, None])
def test_pictures_upside_down_are_told_by_the_design_though_the_card_repeats_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], stated: dict[str, float] | None
) -> None:
    made = make_dataset(tmp_path / "set", presses=6)
    write_card(made.folder / "dataset.toml", replace(made.card, lights_deg=stated))
    for name in ("background.png", *(label.file for label in made.labels)):
        write_image(made.folder / name, read_image(made.folder / name)[::-1])
    below = [replace(x, center_y_px=SIZE_PX[1] - 1 - x.center_y_px) for x in made.labels]
    write_labels(made.folder / "labels.csv", below)
    words = ("--design", "finger", "--estimator", "table", "--out", tmp_path / "unit")
    assert run("calibrate", made.folder, *words) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert said.count("Red and blue lie in each other's place") == 1
    assert said.count("states R = 90°, B = -90°") == (stated is not None)


def test_a_mirrored_picture_is_told_by_the_design_where_nobody_stated_lights(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = make_dataset(tmp_path / "set", presses=6, lights_deg=LIGHTS_DEG | {"G": 0.0})
    write_card(made.folder / "dataset.toml", replace(made.card, lights_deg=None))
    words = ("--design", "finger", "--estimator", "table", "--out", tmp_path / "unit")
    assert run("calibrate", made.folder, *words) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "but the design finger has G = 180°: the picture is mirrored" in said


def test_several_dark_colours_are_one_sentence() -> None:
    assert lights_remark({"R": 90.0}, FINGER) == (
        "Green and blue show no light, but the design finger has them: their LEDs are dead, and no "
        "slope is inferred in their place. If the sensor has neither on purpose, give a design "
        "file with lights.green_base_leds = 0 and lights.blue_side_leds = 0."
    )
    assert "taken to have one light" in lights_remark({"B": -90.0}, None)
    assert not lights_remark(dict.fromkeys("RGB", 0.0), FINGER)
    lights = replace(FINGER.lights, red_side_leds=0)
    assert lights_remark({"R": 90.0, "B": -90.0}, replace(FINGER, lights=lights)) == (
        "Green shows no light, but the design finger has one: its LED is dead, and no slope is "
        "inferred in its place. If the sensor has none on purpose, give a design file with "
        "lights.green_base_leds = 0. Red changes with the presses, but the design finger has no "
        "such light: what it shows is taken for light of other colours and left out."
    )
    assert not lights_remark(None, None)
