# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""While MkDocs builds: a line ``<!-- help: NAME -->`` becomes what ``wedge NAME --help`` prints."""

import contextlib
import io
import os
import re
import textwrap
from typing import Any

from app.__main__ import main

COLUMNS = 84


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Fill in the help of every command that a page names."""
    return re.sub(r"<!-- help: (\w*) -->", lambda found: _help(found[1]), markdown)


def _help(name: str) -> str:
    os.environ["COLUMNS"] = str(COLUMNS)
    printed = io.TextIOWrapper(io.BytesIO(), encoding="utf-8")
    with contextlib.redirect_stdout(printed), contextlib.suppress(SystemExit):
        main([name, "--help"] if name else ["--help"])
    printed.seek(0)
    lines = printed.read().strip().splitlines()
    text = "\n".join(
        line if line[:1] in ("", " ") else textwrap.fill(line, COLUMNS) for line in lines
    )
    return f"```text\n{text}\n```"
