# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A real browser, started once for all tests of a process; each test has pages of its own."""

import contextlib
import functools
import shutil
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Playwright, sync_playwright

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
needs_chromium = pytest.mark.skipif(
    CHROMIUM is None, reason="no Chromium on this machine: apt install chromium"
)
_ended = contextlib.ExitStack()


@contextlib.contextmanager
def chromium(*options: str) -> Iterator[Browser]:
    """A browser without any page; those that are opened in it are closed at the end.

    Args:
        options: of Chromium's command line.
    """
    browser = _launched(options)
    others = set(browser.contexts)
    try:
        yield browser
    finally:
        for context in browser.contexts:
            if context not in others:
                context.close()


def close_browsers() -> None:
    """End what was started."""
    _ended.close()
    _launched.cache_clear()
    _playwright.cache_clear()


@functools.cache
def _playwright() -> Playwright:
    return _ended.enter_context(sync_playwright())


@functools.cache
def _launched(options: tuple[str, ...]) -> Browser:
    browser = _playwright().chromium.launch(
        executable_path=CHROMIUM, args=["--no-sandbox", *options]
    )
    return _ended.enter_context(contextlib.closing(browser))
