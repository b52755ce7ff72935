# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Sections to one page that needs nothing beside it: style and pictures are inside.

A section is text, numbers and pictures of one topic::

    section = Section(title="Integrators", html=paragraph("…") + figure_html(picture))
    write_report(Path("build"), title="…", lead="…", sections=[section])
"""

import base64
import html
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from sensor.documents import text_bytes
from sensor.files import write_atomic

PAGE = "index.html"
STYLE = Path(__file__).with_name("page.css")


@dataclass(frozen=True, kw_only=True)
class Section:
    """A part of the page, with an entry in its contents."""

    title: str
    html: str


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A PNG, WebP or SVG with the words that stand for it and below it."""

    content: bytes
    alt: str
    """What it shows, for those who do not see it."""
    caption: str
    """Plain text: data, number of presses, and how it was made."""
    wide: bool = False
    """Takes the whole line."""
    wordless: bool = False
    """Shrinks on narrow screens, which scroll others sideways lest their words shrink."""


@dataclass(frozen=True, kw_only=True)
class Tile:
    """One number in large type."""

    label: str
    value: str
    note: str


def write_report(folder: Path, *, title: str, lead: str, sections: Sequence[Section]) -> Path:
    """Write the page, whole or not at all, and return its path.

    Args:
        folder: made where it is missing.
        title: of the page.
        lead: one or two sentences below the title, plain text.
        sections: in their order on the page.

    Raises:
        WedgeError: the page cannot be written.
    """
    anchored = list(zip(_anchors([section.title for section in sections]), sections, strict=True))
    contents = "".join(
        f'<li><a href="#{anchor}">{html.escape(section.title)}</a></li>'
        for anchor, section in anchored
    )
    body = "\n".join(
        f'<section id="{anchor}" aria-labelledby="{anchor}-title">\n'
        f'<h2 id="{anchor}-title">{html.escape(section.title)}</h2>\n'
        f"{section.html}\n</section>"
        for anchor, section in anchored
    )
    page = (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n'
        f"<title>{html.escape(title)}</title>\n<style>\n{STYLE.read_text(encoding='utf-8')}</style>\n"
        '</head>\n<body>\n<a class="skip" href="#content">Skip to the content</a>\n'
        f"<header>\n<h1>{html.escape(title)}</h1>\n<p>{html.escape(lead)}</p>\n"
        f'<nav aria-label="Contents"><ul>{contents}</ul></nav>\n</header>\n'
        f'<main id="content">\n{body}\n</main>\n</body>\n</html>\n'
    )
    path = folder / PAGE
    write_atomic(path, text_bytes(page))
    return path


def _anchors(titles: Iterable[str]) -> list[str]:
    """Addresses inside the page, each once: titles may be alike but for their case and dots."""
    found: list[str] = []
    for title in titles:
        plain = re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-") or "section"
        tries = (plain, *(f"{plain}-{number}" for number in range(2, len(found) + 3)))
        found.append(next(anchor for anchor in tries if anchor not in found))
    return found


def paragraph(text: str) -> str:
    """Plain text as a paragraph."""
    return f"<p>{html.escape(text)}</p>\n"


def bullets(items: Iterable[str]) -> str:
    """Plain texts as a list."""
    return f"<ul>{''.join(f'<li>{html.escape(item)}</li>' for item in items)}</ul>\n"


def links_html(links: Iterable[tuple[str, str]]) -> str:
    """Words and addresses, relative to the page, as a list."""
    items = (
        f'<li><a href="{html.escape(address)}">{html.escape(words)}</a></li>'
        for words, address in links
    )
    return f"<ul>{''.join(items)}</ul>\n"


def code(text: str) -> str:
    """A command to copy."""
    return f'<pre tabindex="0"><code>{html.escape(text)}</code></pre>\n'


def tiles_html(tiles: Iterable[Tile]) -> str:
    """Numbers in large type, side by side."""
    parts = (
        f"<div><dt>{html.escape(tile.label)}</dt>"
        f"<dd><strong>{html.escape(tile.value)}</strong> "
        f"<span>{html.escape(tile.note)}</span></dd></div>"
        for tile in tiles
    )
    return f'<dl class="tiles">{"".join(parts)}</dl>\n'


def figure_html(picture: Picture) -> str:
    """A picture with its caption."""
    kinds = {b"RIFF": "webp", b"\x89PNG": "png"}
    kind = kinds.get(picture.content[:4], "svg+xml")
    image = (
        f'<img alt="{html.escape(picture.alt)}" '
        f'src="data:image/{kind};base64,{base64.b64encode(picture.content).decode()}">'
    )
    if not picture.wordless:
        image = _scrollable(image, picture.alt)
    wide = ' class="wide"' if picture.wide else ""
    return (
        f"<figure{wide}>{image}<figcaption>{html.escape(picture.caption)}</figcaption></figure>\n"
    )


def gallery_html(pictures: Iterable[Picture]) -> str:
    """Pictures side by side where there is room, one below the other where there is not."""
    return f'<div class="gallery">{"".join(map(figure_html, pictures))}</div>\n'


def table_html(
    caption: str,
    headings: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    notes: Sequence[str] = (),
    of_words: bool = False,
) -> str:
    """A table whose first column names its rows.

    Args:
        caption: plain text above the table.
        headings: plain texts.
        rows: plain texts, as many as there are headings; a line break parts a number from its
            interval, which is set smaller.
        notes: names of rows that are set back, such as values from elsewhere.
        of_words: cells are words, which may wrap, instead of numbers, which line up.
    """
    head = "".join(f'<th scope="col">{html.escape(heading)}</th>' for heading in headings)
    body = "\n".join(_row_html(row, row[0] in notes) for row in rows)
    kind = ' class="words"' if of_words else ""
    table = (
        f"<table{kind}><caption><span>{html.escape(caption)}</span></caption>\n"
        f"<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody></table>"
    )
    return _scrollable(table, caption) + "\n"


def _row_html(row: Sequence[str], set_back: bool) -> str:
    kind = ' class="set-back"' if set_back else ""
    cells = "".join(f"<td>{_cell_html(cell)}</td>" for cell in row[1:])
    return f'<tr{kind}><th scope="row">{_cell_html(row[0])}</th>{cells}</tr>'


def _cell_html(cell: str) -> str:
    number, _, interval = cell.partition("\n")
    small = f"<small>{html.escape(interval)}</small>" if interval else ""
    return html.escape(number) + small


def _scrollable(content: str, name: str) -> str:
    """Content that narrow screens scroll sideways, with keys too."""
    label = html.escape(name.partition(".")[0])
    return f'<div class="scroll" role="region" aria-label="{label}" tabindex="0">{content}</div>'
