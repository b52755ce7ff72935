# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A page of the command line, served and opened in a real browser."""

import contextlib
import functools
import os
import re
import socket
import subprocess
import sys
import threading
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO
from urllib.parse import urlsplit

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
    port = _port()
    with running(*words, "--port", port) as output:
        yield _address(output, port)


@contextlib.contextmanager
def serving(*words: object) -> Iterator[tuple[str, "subprocess.Popen[str]"]]:
    """That address, and the process that serves it: one as users start it, which takes longer."""
    port = _port()
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


def _port() -> int:
    """That of the server before, where it is free: what all pages are made of is then known."""
    port = _first_port()
    try:
        socket.create_server(("127.0.0.1", port)).close()
    except OSError:
        return free_port()
    return port


@functools.cache
def _first_port() -> int:
    return free_port()


def _address(output: TextIO, port: int) -> str:
    """Where the page will be, once the command says so."""
    next(line for line in output if line.startswith("Open "))
    return f"http://127.0.0.1:{port}"


def until_it_listens(address: str) -> None:
    """Wait for a server, which says where it will be just before it listens."""
    place, pause = urlsplit(address), threading.Event()
    for _ in range(3000):
        with contextlib.suppress(OSError):
            socket.create_connection((place.hostname, place.port), timeout=5).close()
            return
        pause.wait(0.02)
    pytest.fail(f"nothing listens at {address}")


def until_it_answers(address: str) -> None:
    """Wait until a server has made its page once."""
    until_it_listens(address)
    urllib.request.urlopen(address, timeout=60).close()


@contextlib.contextmanager
def opened(
    address: str, width_px: int = 1400, height_px: int = 800, *, part: str = "#heading"
) -> Iterator[Page]:
    """The page in a browser, its heading or another part there."""
    with chromium() as window:
        page = window.new_page()
        page.set_viewport_size({"width": width_px, "height": height_px})
        page.set_default_timeout(PATIENCE_MS)
        if urlsplit(address).port:  # not a file
            until_it_listens(address)
        page.goto(address)
        page.locator(part).filter(has_text=re.compile(r"\S")).first.wait_for()
        yield page
