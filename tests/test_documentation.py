# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What README and docs say is true: code runs, commands exist, links lead somewhere."""

import ast
import importlib
import importlib.util
import inspect
import itertools
import json
import re
import runpy
import shlex
import shutil
import sys
import tomllib
from dataclasses import fields, is_dataclass
from pathlib import Path
from types import ModuleType

import matplotlib
import pytest
import trimesh

import app.__main__
from app._words import understood
from recon.calibration import unit_of_set
from recon.images import read_image
from recon.stream import Recorder, open_source
from tests.synthetic import make_dataset
from validation.datasets import DATASETS

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(DOCS.rglob("*.md"))]
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def blocks(page: Path, *languages: str) -> list[str]:
    return [text for name, text in FENCE.findall(page.read_text()) if name in languages]


def ids(page: Path) -> str:
    return str(page.relative_to(ROOT))


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with what the pages speak of: presses, a recording of them, a unit and more."""
    folder = tmp_path_factory.mktemp("desk")
    dataset = make_dataset(folder / "balls")
    for name, source in {"background": "background", "press": "press00"}.items():
        (folder / f"{name}.png").write_bytes((folder / "balls" / f"{source}.png").read_bytes())
    unit = unit_of_set(dataset, "table")
    (folder / "units").mkdir()
    unit.save(folder / "units" / "wedge-001")
    with Recorder(folder / "touch.mcap", {"wedge": folder / "units" / "wedge-001"}) as recorder:
        for frame in open_source(folder / "balls"):
            recorder.add("wedge", frame)
    (text,) = [text for text in blocks(DOCS / "howto" / "design.md", "toml") if "base" in text]
    (folder / "thin.toml").write_text(text)
    trimesh.creation.box((8, 6, 4)).export(folder / "part.stl")
    return folder


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "python")], ids=ids)
def test_the_code_on_a_page_runs(
    page: Path, desk: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(desk)
    names = {
        "frame": read_image(desk / "press.png"),
        "background": read_image(desk / "background.png"),
    }
    for text in blocks(page, "python"):
        exec_block(text, page, names)
    # What a page says that its code prints.
    printed = capsys.readouterr().out
    for said in blocks(page, "text"):
        assert page.parent.name != "howto" or said in printed


def exec_block(text: str, page: Path, names: dict[str, object]) -> None:
    """Run a block as the next cell of its page."""
    exec(compile(text, str(page), "exec"), names)  # noqa: S102


def words_of(line: str) -> list[str]:
    return shlex.split(line.removeprefix("./"), comments=True)[1:]


TYPED = sorted(
    {
        line.strip()
        for page in PAGES
        for text in blocks(page, "sh")
        for line in text.splitlines()
        if re.match(r"(\./)?wedge ", line)
    }
)
MENTIONED = sorted(
    {
        line
        for page in PAGES
        for line in re.findall(r"`(wedge [^`\n]+)`", FENCE.sub("", page.read_text()))
    }
)


@pytest.mark.parametrize("line", TYPED)
def test_a_command_line_is_understood(line: str) -> None:
    name, *arguments = words_of(line)
    if name == "test":  # the words after it are pytest's
        return
    understood(importlib.import_module(f"app.{name}").main, f"wedge {name}", arguments)


@pytest.mark.parametrize("line", MENTIONED)
def test_a_command_that_is_spoken_of_exists(line: str) -> None:
    name, *arguments = words_of(line)
    if name.startswith("-") or name in ("test", "SUBCOMMAND"):
        return
    known = inspect.signature(importlib.import_module(f"app.{name}").main).parameters
    options = {word.partition("=")[0] for word in arguments if word.startswith("--")}
    assert options <= {"--help"} | {f"--{key.replace('_', '-')}" for key in known}


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "")], ids=ids)
def test_a_block_with_a_command_says_that_it_is_typed(page: Path) -> None:
    lines = [line for text in blocks(page, "") for line in text.splitlines()]
    assert [x for x in lines if re.match(r"(\./|sudo |\.venv/bin/)?(wedge|python3?) ", x)] == []


def test_the_commands_page_shows_the_help_of_every_command() -> None:
    shown = re.findall(r"<!-- help: (\w+) -->", (DOCS / "commands.md").read_text())
    assert shown == list(app.__main__.SUBCOMMANDS)


def test_the_floors_that_contributors_read_of_are_those_that_are_checked() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]
    contracts = {each["name"]: each for each in settings["contracts"]}
    floors = contracts["A file imports only from floors below it"]["layers"]
    said = " > ".join(", ".join(f"`{room}`" for room in floor.split(" | ")) for floor in floors)
    assert said in " ".join((ROOT / "CONTRIBUTING.md").read_text().split())


def test_the_frame_rates_of_the_readme_are_those_that_were_measured() -> None:
    measured = json.loads((DOCS / "measured" / "bench.json").read_text())["figures"]
    rates = {
        each["name"].removesuffix(", against its floor"): found[1]
        for each in measured
        if (found := re.search(r"(\d+) frames/s", each["unit"]))
    }
    rows = {
        "`default`, ball presses": " by our estimator, these presses",
        "`default`, the whole pad pressed": " by our estimator, all of the gel pressed",
        "`default`, a gel with dots": " by our estimator, dots at rest",
        "`default`, lights on one line": " by our estimator, red and blue alone",
        "`mlp`, ball presses": ", one thread",
    }
    for row, name in rows.items():
        large = rates[f"fast path: 640x480 JPEG to depth{name}"]
        small = rates[f"fast path: 320x240 JPEG to depth{name}"]
        assert re.search(
            rf"^\| {row} \| {large} \| [\d.]+ \| {small} \| [\d.]+ \|$",
            (ROOT / "README.md").read_text(),
            re.MULTILINE,
        )


def test_no_help_on_the_commands_page_is_wider_than_its_block() -> None:
    hooks = runpy.run_path(str(DOCS / "hooks.py"))
    shown = hooks["on_page_markdown"]((DOCS / "commands.md").read_text())
    helps = re.findall(r"^``` .*?\n(.*?)^```$", shown, re.MULTILINE | re.DOTALL)
    assert len(helps) == len(app.__main__.SUBCOMMANDS) + 1
    lines = [line for text in helps for line in text.splitlines()]
    assert [line for line in lines if len(line) > hooks["COLUMNS"]] == []
    # The words of a subcommand that go on in the next line stand below its first ones.
    (overview,) = [part for part in helps[0].split("\n\n") if part.startswith("  reproduce ")]
    columns = [re.match(r"(  \w+ {2,}| +)\w|", line) for line in overview.splitlines()]
    assert len({found.end() for found in columns if found}) == 1


@pytest.mark.parametrize("page", PAGES, ids=ids)
def test_every_relative_link_leads_somewhere(page: Path) -> None:
    prose = FENCE.sub("", page.read_text())
    targets = re.findall(r"\]\((?!https?://)([^)#\s]+)", prose)
    assert [target for target in targets if not (page.parent / target).exists()] == []


def test_every_picture_is_made_by_a_script_and_is_shown() -> None:
    figures = DOCS / "figures"
    pictures = {path for path in figures.iterdir() if path.suffix in (".svg", ".png", ".jpg")}
    assert [p.name for p in pictures if not p.with_suffix(".py").is_file()] == []
    text = "".join(page.read_text() for page in PAGES)
    assert [p.name for p in pictures if f"figures/{p.name}" not in text] == []
    assert [p.name for p in pictures if p.stat().st_size > 300_000] == []


@pytest.mark.parametrize("picture", sorted((DOCS / "figures").glob("*.svg")), ids=ids)
def test_a_drawing_says_what_the_code_says_today(
    picture: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(picture.parent, tmp_path, dirs_exist_ok=True)
    (tmp_path / picture.name).unlink()
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "style", raising=False)
    with matplotlib.rc_context():
        runpy.run_path(str(tmp_path / picture.with_suffix(".py").name), run_name="__main__")
    written_out = re.compile("<!-- (.*) -->")  # matplotlib notes each label that it draws
    drawn = written_out.findall((tmp_path / picture.name).read_text())
    assert drawn == written_out.findall(picture.read_text())
    assert drawn


def test_a_decision_fits_on_a_page_and_is_listed() -> None:
    pages = sorted((DOCS / "decisions").glob("0*.md"))
    listed = (DOCS / "decisions" / "index.md").read_text()
    for number, page in enumerate(pages, start=1):
        text = page.read_text()
        assert text.startswith(f"# {number}. "), page.name
        assert re.findall(r"^\*\*(\w+)\.\*\*", text, re.MULTILINE) == [
            "Context",
            "Decision",
            "Consequence",
        ], page.name
        assert len(text.splitlines()) <= 60, page.name
        assert f"[{text.splitlines()[0].partition('. ')[2]}]({page.name})" in listed


def test_what_a_decision_took_the_place_of_is_said_on_both_pages_and_in_the_list() -> None:
    def named(text: str) -> set[int]:
        return {int(number) for number in re.findall(r"\[(\d+)\]\(0\d+-", text)}

    newer: dict[int, set[int]] = {}
    older: dict[int, set[int]] = {}
    for page in (DOCS / "decisions").glob("0*.md"):
        number = int(page.name[:4])
        head, _, _ = page.read_text().partition("\n**Context.**")
        for way, found in (("Superseded in part by", newer), ("Supersedes parts of", older)):
            if said := re.search(rf"^\*{way} (.*?)\*$", head, re.MULTILINE | re.DOTALL):
                found[number] = named(said[1])
    rows = re.findall(
        r"^(\d+)\. \[.*?\]\(.*?\), superseded in part by (.*)$",
        (DOCS / "decisions" / "index.md").read_text(),
        re.MULTILINE,
    )
    pairs = {(old, new) for old, several in newer.items() for new in several}
    assert pairs and all(old < new for old, new in pairs)
    assert pairs == {(old, new) for new, several in older.items() for old in several}
    assert newer == {int(number): named(said) for number, said in rows}


def test_every_trial_is_in_the_list_of_trials() -> None:
    pages = sorted({*(DOCS / "tried").glob("*.md")} - {DOCS / "tried" / "index.md"})
    listed = re.findall(r"\]\(([\w-]+\.md)#([\w-]+)\)", (DOCS / "tried" / "index.md").read_text())
    assert {page.name: len(re.findall(r"^## ", page.read_text(), re.M)) for page in pages} == {
        page.name: len({anchor for name, anchor in listed if name == page.name}) for page in pages
    }


def test_the_table_of_datasets_is_the_registry() -> None:
    rows = re.findall(
        r"^\| `([\w-]+)` \| (\d+) \| ([\d.]+|–) \|", (DOCS / "data.md").read_text(), re.M
    )
    radii = ["–" if x.ball_radius_mm is None else f"{x.ball_radius_mm:g}" for x in DATASETS]
    assert rows == [(x.name, str(x.presses), r) for x, r in zip(DATASETS, radii, strict=True)]


@pytest.mark.parametrize(
    "name",
    [
        "recon.pipeline.Reconstruction",
        "recon.fast.reconstructor.Touch",
        "recon.cloud.PointCloud",
        "recon.cloud.Mesh",
        "recon.follower.KeptTouch",
        "recon.follower.Felt",
        "recon.depth.Depth",
        "recon.calibration.Calibration",
        "recon.stream.frame.TimedFrame",
        "recon.pose.estimate.PoseEstimate",
        "recon.markers.tracking.Tracked",
    ],
)
def test_the_reference_has_every_field_of_what_users_are_given(name: str) -> None:
    """It leaves out what has no docstring."""
    module, _, kind = name.rpartition(".")
    assert re.search(rf"^::: {module}$", (DOCS / "api" / "recon.md").read_text(), re.M)
    assert "inherited_members: true" in (ROOT / "mkdocs.yml").read_text()
    given = getattr(importlib.import_module(module), kind)
    said = set().union(*(_fields_said(base) for base in given.__mro__ if is_dataclass(base)))
    assert said == {field.name for field in fields(given)}


def _fields_said(kind: type) -> set[str]:
    """The fields of a class's own that have a docstring."""
    (made,) = ast.parse(inspect.getsource(kind)).body
    assert isinstance(made, ast.ClassDef)
    return {
        field.target.id
        for field, after in itertools.pairwise(made.body)
        if isinstance(field, ast.AnnAssign)
        and isinstance(field.target, ast.Name)
        and isinstance(after, ast.Expr)
        and isinstance(after.value, ast.Constant)
    }


@pytest.fixture
def tables() -> ModuleType:
    spec = importlib.util.spec_from_file_location("tables", DOCS / "measured" / "tables.py")
    assert spec and spec.loader
    tables = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tables)
    return tables


def test_measured_tables_are_what_was_measured(tables: ModuleType) -> None:
    for page in tables.PAGES:
        assert tables.filled(page.read_text()) == page.read_text(), (
            f"run docs/measured/tables.py: {ids(page)} is not what its JSON says"
        )


def test_a_figure_that_there_is_none_of_is_shown_with_its_bar(
    tables: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    figure = {"name": "back (lost)", "value": None, "unit": "°", "bar": 1.0}
    (tmp_path / "bench.json").write_text(json.dumps({"figures": [figure]}))
    monkeypatch.setattr(tables, "HERE", tmp_path)
    page = tables.filled("<!-- bench -->\n<!-- end of bench -->")
    assert "| back (lost) | none | ≤ 1 | ° |" in page


def test_a_measured_table_of_one_press_has_no_intervals(
    tables: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    document = json.loads((DOCS / "measured" / "error_table.json").read_text())["tables"][0]
    name, folds = document["dataset"], {"folds": 1, "presses": {"train": 4, "test": 1}}
    alone = [{**row, "ci95": dict.fromkeys(row["ci95"])} for row in document["rows"]]
    (tmp_path / "error_table.json").write_text(
        json.dumps({"tables": [{**document, **folds, "rows": alone}]})
    )
    monkeypatch.setattr(tables, "HERE", tmp_path)
    page = tables.filled(f"<!-- table: {name} -->\n<!-- end of table -->")
    assert f"{alone[0]['gx_mae']:.3f} |" in page and "<br>" not in page
    assert "(trained on 4 presses, tested on 1 press), 1 press, too few for an interval." in page
