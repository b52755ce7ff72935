# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge test` notices what it is there to notice, and the pages that it builds can be read."""

from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import expect

import app.test
from app.test import CHECKS, ROOT, _passes
from tests.app.served import needs_chromium, opened

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
    assert complaint in capsys.readouterr().out


@needs_chromium
def test_pages_opened_from_the_disk_are_searched(built: Built, tmp_path: Path) -> None:
    assert built(PAGES)
    site = tmp_path / "build" / "docs"
    with opened((site / "index.html").as_uri(), part="article") as page:
        page.locator(".md-search__input").press_sequentially("glue")
        found = page.locator(".md-search-result__link").first
        expect(found).to_have_attribute("href", (site / "other.html").as_uri())
