# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A page of the project as Chromium shows it, for the pictures of pages."""

import shutil
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from playwright.sync_api import Error, Page, ViewportSize, sync_playwright


@contextmanager
def opened(url: str, size_px: ViewportSize, options: Sequence[str] = ()) -> Iterator[Page]:
    """The page at an address, whose server may still be starting."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox", *options]
        )
        page = browser.new_page(viewport=size_px)
        for _ in range(200):
            try:
                page.goto(url)
                break
            except Error:
                time.sleep(0.1)
        yield page
