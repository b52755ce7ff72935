# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""`wedge test` notices what it is there to notice."""

from pathlib import Path

import pytest

import app.test
from app.test import CHECKS, ROOT, _passes

PAGES = {"index.md": "# Start\n\n[On](other.md#end)\n", "other.md": "# Other\n\n## End\n"}


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
    pages: dict[str, str],
    complaint: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    settings, _, _ = (ROOT / "mkdocs.yml").read_text().partition("\nnav:")
    (tmp_path / "mkdocs.yml").write_text(f"{settings}\nnav: [index.md, other.md]\n")
    (tmp_path / "docs").mkdir()
    for name in ("hooks.py", "stylesheets"):
        (tmp_path / "docs" / name).symlink_to(ROOT / "docs" / name)
    for name, text in pages.items():
        (tmp_path / "docs" / name).write_text(text)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))  # the hooks import the command line
    monkeypatch.setattr(app.test, "ROOT", tmp_path)
    assert _passes("docs", CHECKS["docs"]) is (not complaint)
    assert complaint in capsys.readouterr().out
