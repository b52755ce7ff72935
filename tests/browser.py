# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A real browser with one window for all tests of a process; each test has tabs of its own."""

import contextlib
import functools
import shutil
from collections.abc import Iterator

import pytest
from playwright.sync_api import BrowserContext, Playwright, sync_playwright

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
needs_chromium = pytest.mark.skipif(
    CHROMIUM is None, reason="no Chromium on this machine: apt install chromium"
)
_ended = contextlib.ExitStack()


@contextlib.contextmanager
def chromium() -> Iterator[BrowserContext]:
    """Its window; the tabs that are opened in it are closed at the end."""
    window = _window()
    others = set(window.pages)
    try:
        yield window
    finally:
        for page in window.pages:
            if page not in others:
                page.close()


def close_browsers() -> None:
    """End what was started."""
    _ended.close()
    _window.cache_clear()
    _playwright.cache_clear()


@functools.cache
def _playwright() -> Playwright:
    return _ended.enter_context(sync_playwright())


@functools.cache
def _window() -> BrowserContext:
    """One that is never without a tab, as to open the next takes longer than most pages."""
    browser = _playwright().chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
    window = _ended.enter_context(contextlib.closing(browser)).new_context()
    window.new_page()
    return window
