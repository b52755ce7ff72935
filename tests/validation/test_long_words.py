# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Pages written to disk keep within a phone and a sheet of paper whatever words they are given."""

from collections.abc import Callable
from pathlib import Path
from typing import Literal

import pytest

from cad.exports.page import guide_html
from tests.browser import chromium, needs_chromium
from validation.report.page import (
    Section,
    Tile,
    bullets,
    code,
    paragraph,
    table_html,
    tiles_html,
    write_report,
)

pytestmark = needs_chromium
LONG = "x" * 150


def report(folder: Path) -> Path:
    parts = (
        paragraph(LONG),
        bullets([LONG]),
        code(LONG),
        tiles_html([Tile(label=LONG, value="1", note=LONG)]),
        table_html(f"Errors of {LONG}", ["set", *["configuration"] * 4], [["a", *"1234"]]),
    )
    sections = [Section(title=LONG, html="".join(parts))]
    return write_report(folder, title=LONG, lead=LONG, sections=sections)


def guide(folder: Path) -> Path:
    (folder / "guide.html").write_text(guide_html(f"# Guide\n\n```\n{'word ' * 60}\n```\n"))
    return folder / "guide.html"


@pytest.mark.parametrize("written", [report, guide])
@pytest.mark.parametrize(("media", "width_px"), [("screen", 375), ("print", 718)])
def test_a_long_word_makes_no_page_wider(
    tmp_path: Path,
    written: Callable[[Path], Path],
    media: Literal["screen", "print"],
    width_px: int,
) -> None:
    path = written(tmp_path)
    with chromium() as window:
        page = window.new_page()
        page.set_viewport_size({"width": width_px, "height": 800})
        page.emulate_media(media=media)
        page.goto(path.as_uri())
        assert page.evaluate("document.documentElement.scrollWidth") == width_px
        if media == "print":  # paper does not scroll
            assert page.locator("pre").evaluate("x => x.scrollWidth <= x.clientWidth")
        lines = page.locator("thead th").evaluate_all(
            "all => all.map(x => x.clientHeight / parseFloat(getComputedStyle(x).lineHeight))"
        )
        assert all(count < 2 for count in lines)  # short words stay whole
