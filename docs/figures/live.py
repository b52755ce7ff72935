# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The live page as a browser shows it, on presses of the rendered twin: live.jpg.

They follow each other at one a second, which is the rate that it shows, whatever the machine.

Needs Chromium; run it again when the page has changed:

    python docs/figures/live.py
"""

import io
import socket
import subprocess
import sys
from pathlib import Path

from browser import opened
from PIL import Image
from playwright.sync_api import ViewportSize

HERE = Path(__file__).resolve().parent
SIZE_PX: ViewportSize = {"width": 1280, "height": 933}
TOUCHED = "parseFloat(document.querySelector('.deepest')?.innerText) > 0.8"


def main() -> None:
    """Serve the page, wait for a touch, and keep what is seen."""
    with socket.create_server(("127.0.0.1", 0)) as found:
        port = found.getsockname()[1]
    command = [sys.executable, "-m", "app", "live", "--port", str(port)]
    with subprocess.Popen(command, cwd=HERE.parents[1], stdout=subprocess.PIPE) as process:
        assert process.stdout
        process.stdout.readline()
        try:
            picture = photographed(f"http://127.0.0.1:{port}")
        finally:
            process.terminate()
    image = Image.open(io.BytesIO(picture)).convert("RGB")
    image.save(HERE / "live.jpg", quality=85, optimize=True)


def photographed(url: str) -> bytes:
    """A PNG of the page when its surface has been touched for a while."""
    options = ["--use-gl=swiftshader", "--enable-webgl", "--ignore-gpu-blocklist"]
    with opened(url, SIZE_PX, options) as page:
        page.wait_for_selector("canvas")
        page.wait_for_timeout(15_000)
        page.wait_for_function(TOUCHED, timeout=120_000)
        page.wait_for_timeout(400)
        return page.screenshot()


if __name__ == "__main__":
    main()
