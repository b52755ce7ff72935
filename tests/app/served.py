# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A page of the command line, served and opened in a real browser."""

import contextlib
import os
import re
import subprocess
import sys
import threading
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.browser import chromium
from tests.recon.stream.servers import free_port

ROOT = Path(__file__).resolve().parents[2]
PATIENCE_MS = 60_000
expect.set_options(timeout=30_000)


@contextlib.contextmanager
def served(*words: object) -> Iterator[str]:
    """The address of the page that a command serves."""
    with serving(*words) as (address, _):
        yield address


@contextlib.contextmanager
def serving(*words: object) -> Iterator[tuple[str, "subprocess.Popen[str]"]]:
    """That address, and the process that serves it."""
    port = free_port()
    command = [sys.executable, "-P", "-m", "app", *map(str, words), "--port", str(port)]
    # NiceGUI serves otherwise where it sees pytest.
    environment = {key: value for key, value in os.environ.items() if "PYTEST" not in key}
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, text=True, env=environment
    ) as server:
        try:
            assert server.stdout is not None
            next(line for line in server.stdout if line.startswith("Open "))
            yield f"http://127.0.0.1:{port}", server
        finally:
            server.terminate()


def until_it_answers(address: str) -> None:
    """Wait for a server, which says where it will be just before it listens."""
    pause = threading.Event()
    for _ in range(1000):
        with contextlib.suppress(OSError):
            urllib.request.urlopen(address, timeout=5).close()
            return
        pause.wait(0.05)
    pytest.fail(f"nothing answers at {address}")


@contextlib.contextmanager
def opened(
    address: str, width_px: int = 1400, height_px: int = 800, *, part: str = "#heading"
) -> Iterator[Page]:
    """The page in a browser, its heading or another part there."""
    with chromium() as browser:
        page = browser.new_page(viewport={"width": width_px, "height": height_px})
        page.set_default_timeout(PATIENCE_MS)
        until_it_answers(address)
        page.goto(address)
        page.locator(part).filter(has_text=re.compile(r"\S")).first.wait_for()
        yield page
