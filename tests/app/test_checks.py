# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge test` and `wedge bench` fail where they ought to; the pages built can be read."""

from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import pytest
from playwright.sync_api import expect

import app.test
from app import bench
from app.test import CHECKS, ROOT, _passes
from benchmarks.measurement import Measurement
from tests.app.commands import run
from tests.app.served import opened
from tests.browser import needs_chromium

PAGES = {"index.md": "# Start\n\n[On](other.md#end)\n", "other.md": "# Other\n\n## End\n\nGlue.\n"}
Built = Callable[[dict[str, str]], bool]


@pytest.fixture
def built(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Built:
    """Whether the docs check passes of some pages, two of which the menu names."""

    def passes(pages: dict[str, str]) -> bool:
        settings, _, _ = (ROOT / "mkdocs.yml").read_text().partition("\nnav:")
        (tmp_path / "mkdocs.yml").write_text(f"{settings}\nnav: [index.md, other.md]\n")
        (tmp_path / "docs").mkdir()
        for name in ("hooks.py", "javascripts", "stylesheets"):
            (tmp_path / "docs" / name).symlink_to(ROOT / "docs" / name)
        for name, text in pages.items():
            (tmp_path / "docs" / name).write_text(text)
        monkeypatch.setenv("PYTHONPATH", str(ROOT))  # the hooks import the command line
        monkeypatch.setattr(app.test, "ROOT", tmp_path)
        return _passes("docs", CHECKS["docs"])

    return passes


@pytest.mark.parametrize(
    ("pages", "complaint"),
    [
        (PAGES, ""),
        (PAGES | {"other.md": "# Other\n"}, "#end"),
        (PAGES | {"alone.md": "# Alone\n"}, "alone.md"),
    ],
    ids=["whole", "broken anchor", "page missing in nav"],
)
def test_the_docs_check_fails_where_a_reader_is_led_nowhere(
    pages: dict[str, str], complaint: str, built: Built, capsys: pytest.CaptureFixture[str]
) -> None:
    assert built(pages) is (not complaint)
    told = capsys.readouterr().out
    assert complaint in told
    assert "Zensical" not in told  # MkDocs Material's advertisement for its successor


@needs_chromium
def test_pages_opened_from_the_disk_are_searched(built: Built, tmp_path: Path) -> None:
    assert built(PAGES)
    site = tmp_path / "build" / "docs"
    with opened((site / "index.html").as_uri(), part="article") as page:
        page.locator(".md-search__input").press_sequentially("glue")
        found = page.locator(".md-search-result__link").first
        expect(found).to_have_attribute("href", (site / "other.html").as_uri())


@pytest.mark.parametrize("broken", [None, "ruff", "mypy", "pytest", "mkdocs"])
def test_any_check_that_fails_fails_the_command_and_the_others_run_all_the_same(
    broken: str | None, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    ran: list[str] = []

    def tool_run(tool: str, *arguments: str, output: int | None = None) -> CompletedProcess[str]:
        ran.append(tool)
        # Of pytest, any status but 0: 5 is that it found no test.
        failed = {"pytest": 5}.get(tool, 1) if tool == broken else 0
        return CompletedProcess(tool, failed, stdout=f"{tool} was here\n")

    monkeypatch.setattr(app.test, "_run", tool_run)
    assert run("test") == (1 if broken else 0)
    *checks, last = ran  # the checks run beside each other
    assert sorted(checks) == sorted(command.split()[0] for command in CHECKS.values())
    assert last == "pytest"
    told = capsys.readouterr()
    assert (f"{broken} was here" in told.out) is (broken not in (None, "pytest"))
    assert ("wedge: failed: " in told.err) is bool(broken)
    assert run("test", "-k", "poisson") == (5 if broken == "pytest" else 0)


@pytest.mark.parametrize(
    ("value", "missed"), [(0.9, False), (1.0, False), (1.1, True), (float("inf"), True)]
)
def test_a_figure_that_misses_its_bar_fails_the_bench(
    value: float,
    missed: bool,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    figures = [
        Measurement(name="one", value=value, unit="s", bar=1.0),
        Measurement(name="other", value=9.0, unit="s"),
    ]
    monkeypatch.setattr(bench, "_all", lambda: iter([(0.5, x) for x in figures]))
    assert run("bench") == int(missed)
    shown = capsys.readouterr().out
    assert ("MISSED" in shown) is missed
    assert ("none" in shown) is (value == float("inf"))
