# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Hooks for MkDocs: commands show their own help, and no page loads anything from elsewhere.

A line ``<!-- help: NAME -->`` becomes what ``wedge NAME --help`` prints.
"""

import contextlib
import io
import os
import re
import textwrap
from typing import Any

from mkdocs.exceptions import PluginError

from app.__main__ import main

COLUMNS = 84


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Fill in the help of every command that a page names."""
    return re.sub(r"<!-- help: (\w*) -->", lambda found: _help(found[1]), markdown)


def on_post_page(output: str, page: Any, **_: Any) -> None:
    """Refuse what a browser would fetch from another machine."""
    foreign = re.findall(r"<(?:script|img|iframe)[^>]*\bsrc=.?https?:[^ >]*", output)
    foreign += re.findall(r"<link[^>]*\bhref=.?https?:[^ >]*", output)
    if foreign:
        raise PluginError(f"{page.file.src_path} loads {', '.join(foreign)}")


def _help(name: str) -> str:
    os.environ["COLUMNS"] = str(COLUMNS)
    printed = io.TextIOWrapper(io.BytesIO(), encoding="utf-8")
    with contextlib.redirect_stdout(printed), contextlib.suppress(SystemExit):
        main([name, "--help"] if name else ["--help"])
    printed.seek(0)
    lines = printed.read().strip().splitlines()
    text = "\n".join(_wrapped(line) for line in lines)
    return f"``` {{ .text .terminal }}\n{text}\n```"


def _wrapped(line: str) -> str:
    """Wrap a line of help to the page's width, and keep what follows a name in its column."""
    if len(line) <= COLUMNS:
        return line
    named = re.match(r" +\S+ {2,}", line)
    return textwrap.fill(line, COLUMNS, subsequent_indent=" " * (named.end() if named else 0))
