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
from typing import TextIO

import pytest
from playwright.sync_api import Page, expect

from tests.app.forked import running
from tests.browser import chromium
from tests.recon.stream.servers import free_port

ROOT = Path(__file__).resolve().parents[2]
PATIENCE_MS = 60_000
expect.set_options(timeout=30_000)


@contextlib.contextmanager
def served(*words: object) -> Iterator[str]:
    """The address of the page that a command serves."""
    port = free_port()
    with running(*words, "--port", port) as output:
        yield _address(output, port)


@contextlib.contextmanager
def serving(*words: object) -> Iterator[tuple[str, "subprocess.Popen[str]"]]:
    """That address, and the process that serves it: one as users start it, which takes longer."""
    port = free_port()
    command = [sys.executable, "-P", "-m", "app", *map(str, words), "--port", str(port)]
    # NiceGUI serves otherwise where it sees pytest, and few users have lines written at once.
    environment = {
        key: value
        for key, value in os.environ.items()
        if "PYTEST" not in key and key != "PYTHONUNBUFFERED"
    }
    with subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, text=True, env=environment
    ) as server:
        try:
            assert server.stdout is not None
            yield _address(server.stdout, port), server
        finally:
            server.terminate()


def _address(output: TextIO, port: int) -> str:
    """Where the page will be, once the command says so."""
    next(line for line in output if line.startswith("Open "))
    return f"http://127.0.0.1:{port}"


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
