# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A sweep varies what it says, renders nothing twice, and gives one answer wherever it runs."""

import itertools
import shutil
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import sensor
import simulation.engine
from recon.presses import LEAST_RADIUS_PX
from sensor.dataset import LENS_FILE
from sensor.design import FINGER, STANDARD, Wedge
from sensor.errors import WedgeError
from simulation.dataset import Recipe, dent_of, label_of, presses_of, write_set
from simulation.engine import SCALAR, Engine
from tests.simulation.conftest import InLine
from validation.error_table import Row
from validation.figures.png import png_bytes
from validation.figures.sweep import sweep_figure
from validation.lighting import contrast, lit_area, unevenness
from validation.metrics import METRICS, Errors
from validation.sweep import (
    LIBRARIES,
    SEEN_OVER_THE_MIRROR,
    SweepPoint,
    SweepSize,
    key_of,
    planned_presses,
    sweep,
    varied,
)

SIZE = SweepSize(presses=5, samples=16, width_px=48)


class Counting(InLine):
    tasks = 0

    def submit(self, fn, /, *args, **kwargs):
        self.tasks += 1
        return super().submit(fn, *args, **kwargs)


def run(folder: Path, executor: InLine, values: tuple[str, ...] = ("RGB",)):
    field = "lights.lit_sides"
    return sweep(
        [(value, varied(FINGER, field, value)) for value in values],
        field=field,
        folder=folder,
        size=SIZE,
        engine=SCALAR,
        executor=executor,
    )


def test_nothing_is_rendered_twice(tmp_path: Path) -> None:
    pytest.importorskip("mitsuba")
    first, again = Counting(), Counting()
    (point,) = run(tmp_path, first)
    assert first.tasks == SIZE.presses + 4
    same, other = run(tmp_path, again, ("RGB", "RG"))
    assert again.tasks == first.tasks  # of the second value alone
    assert same == point
    assert (point.presses, same.row.configuration, other.row.configuration) == ((4, 1), "RGB", "RG")
    assert not any((tmp_path / "parts").iterdir())
    for frame in (tmp_path / "sets").glob("*/ball_00.jpg"):
        frame.unlink()
    once_more = Counting()
    assert run(tmp_path, once_more) == [point]  # a set that has lost a frame is rendered again
    assert once_more.tasks == first.tasks
    assert 0 < point.lit_area <= other.lit_area + 0.02 <= 1.02  # fewer colours to wait for
    picture = png_bytes(sweep_figure("lights.lit_sides", [same, other]))
    assert picture == png_bytes(sweep_figure("lights.lit_sides", [same, other]))


def test_a_raw_set_that_has_lost_its_lens_is_rendered_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mitsuba")
    monkeypatch.setattr("validation.sweep._judged", lambda *_: point("30", 4))
    executor, tasks = Counting(), []
    for _ in range(3):
        sweep(
            [("30", FINGER)],
            field="mirror.angle_deg",
            folder=tmp_path,
            size=replace(SIZE, samples=1, width_px=64),
            engine=SCALAR,
            executor=executor,
        )
        tasks.append(executor.tasks)
        (lens,) = (tmp_path / "sets").glob(f"*/{LENS_FILE}")
        if len(tasks) == 2:
            lens.unlink()
    assert tasks[1] == tasks[0] and tasks[2] == 2 * tasks[0]


def test_a_value_that_cannot_be_pressed_is_told_before_anything_is_rendered(tmp_path: Path) -> None:
    field, executor = "gel.pad_width_mm", Counting()
    designs = [(value, varied(FINGER, field, value)) for value in ("9.4", "4.85")]
    with pytest.raises(WedgeError, match=r"^gel.pad_width_mm = 4.85: a ball .* leaves no room"):
        sweep(designs, field=field, folder=tmp_path, size=SIZE, engine=SCALAR, executor=executor)
    assert executor.tasks == 0
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("raw", [False, True])
def test_planned_contacts_are_the_labels_that_decide_what_is_used(raw: bool) -> None:
    def widest_px(width_px: int) -> list[float]:
        recipe = Recipe(engine=SCALAR, design=FINGER, width_px=width_px, raw=raw)
        presses = presses_of(FINGER, "balls", count=SIZE.presses, seed=0)
        dents = [(press.name, dent_of(recipe, press).circle_px) for press in presses]
        return sorted(label_of(*dent).contact_radius_px for dent in dents)[-2:]

    least = next(width for width in range(20, 60) if widest_px(width)[0] >= LEAST_RADIUS_PX)
    enough, short = (
        Recipe(engine=SCALAR, design=FINGER, width_px=width, raw=raw)
        for width in (least, least - 1)
    )
    assert len(planned_presses(enough, SIZE)) == SIZE.presses
    with pytest.raises(WedgeError, match=f"1 of 5 contacts .* --width-px above {least - 1}, or"):
        planned_presses(short, SIZE)


@pytest.mark.parametrize("n_presses", [(8, 8), (8, 1), (1, 1)])
def test_one_press_is_drawn_without_an_interval(n_presses: tuple[int, int]) -> None:
    points = [
        point(value, presses) for value, presses in zip(("2.0", "3.0"), n_presses, strict=True)
    ]
    errors, _ = sweep_figure("gel.thickness_mm", points).axes
    for bars in errors.containers:
        assert bars.has_yerr == (max(n_presses) > 1)
        spans = [path for lines in bars.lines[2] for path in lines.get_segments()]
        lengths = [np.ptp(span[:, 1]) for span in spans if len(span)]
        assert [length for length in lengths if length > 0] == pytest.approx(
            [0.3 for count in n_presses if count > 1]
        )
        assert 0 not in lengths


@pytest.mark.parametrize("values", [("2.0", "3.0", "4.5"), ("red", "green", "blue")])
def test_neither_axis_hides_the_other_s_interval(values: tuple[str, ...]) -> None:
    errors, _ = sweep_figure("gel.thickness_mm", [point(value, 8) for value in values]).axes
    figure = errors.figure
    figure.canvas.draw()
    spans_px = [
        errors.transData.transform(span)[:, 0].mean()
        for bars in errors.containers
        for lines in bars.lines[2]
        for span in lines.get_segments()
    ]
    apart_pt = np.diff(np.sort(spans_px)) * 72 / figure.dpi
    assert len(spans_px) == 2 * len(values) and apart_pt.min() > 1.2  # a line's width


def point(value: str, n_presses: int) -> SweepPoint:
    """What a value predicts, of the presses that were judged."""
    row = Row(
        configuration="RGB",
        missing_axis="none",
        estimator="mlp",
        pixels="contact",
        errors=Errors(
            values=dict.fromkeys(METRICS, 0.2),
            ci95=dict.fromkeys(METRICS, (0.1, 0.4) if n_presses > 1 else None),
            mean_abs_gradient=0.4,
            curvature=1.0,
            n_pixels=100,
            n_presses=n_presses,
        ),
    )
    return SweepPoint(
        value=value, row=row, contact=row, lit_area=1.0, presses=(4, n_presses), inferred=None
    )


@pytest.mark.parametrize(
    ("field", "value", "part", "name", "number"),
    [
        ("mirror.angle_deg", "31.5", "mirror", "angle_deg", 31.5),
        ("lights.red_side_leds", "5", "lights", "red_side_leds", 5),
        ("gel.curved", "false", "gel", "curved", False),
        ("camera.projection", "pinhole", "camera", "projection", "pinhole"),
        ("lights.lit_sides", "RB", "lights", "green_base_leds", 0),
    ],
)
def test_one_number_is_varied(field, value, part, name, number) -> None:
    changed = varied(STANDARD, field, value)
    assert getattr(getattr(changed, part), name) == number
    assert changed.sha256 != STANDARD.sha256


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("mirror", "1", "no field 'mirror'"),
        ("mirror.angel_deg", "30", "no field .* did you mean mirror.angle_deg?"),
        ("gel.thicknes", "3", "no field .* did you mean gel.thickness_mm?"),
        ("lights.lit_side", "RG", "no field .* did you mean lights.lit_sides?"),
        ("name", "30", "no field"),
        ("mirror.__class__", "30", "no field"),
        ("mirror.angle_deg", "steep", "must be a number"),
        ("lights.red_side_leds", "2.5", "must be a whole number"),
        ("gel.curved", "yes", "must be true or false"),
        ("mirror.angle_deg", "80", "outside its bounds"),
        ("lights.lit_sides", "RX", "letters R, G and B"),
        ("lights.lit_sides", "", "letters R, G and B"),
        ("lights.lit_sides", "RB", "lit: the design has lights.blue_side_leds = 0; leave that"),
    ],
)
def test_what_cannot_be_varied_is_refused(field, value, words) -> None:
    without_blue = varied(STANDARD, "lights.blue_side_leds", "0")
    assert varied(without_blue, "lights.lit_sides", "R").lights.green_base_leds == 0
    with pytest.raises(WedgeError, match=words):
        varied(without_blue, field, value)


FLAT = replace(FINGER, gel=replace(FINGER.gel, curved=False))
BARE = replace(FINGER, lights=replace(FINGER.lights, diffuser=False))


@pytest.mark.parametrize("design", [FINGER, FLAT, BARE], ids=["finger", "flat gel", "bare LEDs"])
def test_the_fields_that_can_be_varied_are_those_that_the_twin_looks_at(
    design: Wedge, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mitsuba")
    parts = {item.name: getattr(design, item.name) for item in fields(design)}
    parts = {name: part for name, part in parts.items() if is_dataclass(part)}
    known = {(name, item.name) for name, part in parts.items() for item in fields(part)}
    looked_at: set[tuple[str, str]] = set()

    def watch(name: str) -> None:
        def read(part: object, key: str) -> object:
            looked_at.add((name, key))
            return object.__getattribute__(part, key)

        monkeypatch.setattr(type(parts[name]), "__getattribute__", read)

    shown: set[tuple[str, str]] = set()
    with monkeypatch.context() as monkeypatch:
        for name in parts:
            watch(name)
        for raw in (False, True):
            looked_at.clear()
            recipe = Recipe(engine=SCALAR, design=design, width_px=16, samples=1, raw=raw)
            presses = presses_of(design, "balls", count=1, seed=0)
            write_set(tmp_path, recipe, presses, source="", executor=InLine())
            shown |= {each for each in looked_at if (each[0] in SEEN_OVER_THE_MIRROR) == raw}

    def can_be_varied(name: str, key: str) -> bool:
        try:
            return bool(varied(design, f"{name}.{key}", str(getattr(parts[name], key))))
        except WedgeError as error:
            assert f"does not use {name}.{key}" in str(error)
            return False

    assert {each for each in known if can_be_varied(*each)} == known & shown


def test_a_sets_name_tells_everything_that_decides_it() -> None:
    recipes = [
        Recipe(engine=SCALAR, design=FINGER),
        Recipe(engine=SCALAR, design=STANDARD),
        Recipe(engine=SCALAR, design=FINGER, samples=4),
        Recipe(engine=SCALAR, design=FINGER, seed=1),
        Recipe(engine=SCALAR, design=FINGER, raw=True),
        Recipe(engine=SCALAR, design=FINGER, width_px=64),
    ]
    names = [key_of(recipe, 5) for recipe in recipes] + [key_of(recipes[0], 6)]
    assert len(set(names)) == len(names)
    assert key_of(recipes[0], 5) == names[0]


def test_a_set_that_another_mitsuba_rendered_is_another(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(simulation.engine, "version", lambda package: f"{package} 0.1")
    engines = SCALAR, Engine(variant=SCALAR.variant), Engine(variant=SCALAR.variant)
    names = [key_of(Recipe(engine=engine, design=FINGER), 5) for engine in engines]
    assert names[0] != names[1] == names[2]


@pytest.mark.parametrize("floor", [sensor, simulation], ids=["sensor", "simulation"])
def test_a_set_that_other_code_rendered_is_another(
    floor: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recipe = Recipe(engine=SCALAR, design=FINGER)
    names = [key_of(recipe, 5)]
    leave_out = shutil.ignore_patterns("sets", "__pycache__")
    copy = shutil.copytree(floor.__path__[0], tmp_path / floor.__name__, ignore=leave_out)
    monkeypatch.setattr(floor, "__path__", [str(copy)])
    assert key_of(recipe, 5) == names[0]  # wherever it lies
    files = list(copy.glob("*.py"))
    for file in files:
        file.write_text(file.read_text(encoding="utf-8") + "# changed\n", encoding="utf-8")
        names.append(key_of(recipe, 5))
    assert len(set(names)) == 1 + len(files) > 10


@pytest.mark.parametrize("library", LIBRARIES, ids=lambda library: library.__name__)
def test_a_set_that_another_library_computed_is_another(
    library: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    recipe = Recipe(engine=SCALAR, design=FINGER)
    before = key_of(recipe, 5)
    monkeypatch.setattr(library, "__version__", "0.1")
    assert key_of(recipe, 5) != before


def test_lit_area_is_the_share_that_every_colour_reaches() -> None:
    light = np.ones((10, 20, 3), np.float32) * 0.2
    light[:, :5, 0] = 0.01  # red misses a quarter of the pad
    light[5:, :, 2] = 0.01  # blue misses half
    background = light ** np.float32(1 / 2.2)
    assert lit_area(background, "G") == 1
    assert lit_area(background, "R") == pytest.approx(0.75)
    assert lit_area(background) == pytest.approx(0.375)
    of_red, of_blue = (0.95 * np.sqrt(m * (1 - m)) / (1 - 0.95 * m) for m in (1 / 4, 1 / 2))
    assert unevenness(background) == pytest.approx((of_red + of_blue) / 3, abs=1e-5)


def test_contrast_is_in_grey_levels_of_the_contact() -> None:
    difference = np.zeros((4, 4, 3), np.float32)
    difference[1] = 20 / 255
    contact = np.zeros((4, 4), bool)
    contact[1] = True
    assert contrast(difference, contact) == pytest.approx(20, rel=1e-5)


def test_values_are_drawn_in_their_order_with_ticks_that_can_be_read() -> None:
    values = ("4.5", "0.05", "0.01", "0.02", "1")
    errors, area = sweep_figure("gel.thickness_mm", [point(value, 1) for value in values]).axes
    for line in [bars.lines[0] for bars in errors.containers] + list(area.lines):
        assert list(line.get_xdata()) == sorted(line.get_xdata())
        assert max(line.get_ydata()) < line.axes.get_ylim()[1]
    figure = errors.figure
    figure.canvas.draw()
    boxes = [label.get_window_extent() for label in errors.get_xticklabels() if label.get_text()]
    assert len(boxes) >= 3
    assert all(one.x1 < other.x0 for one, other in itertools.pairwise(boxes))
