# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of `wedge label` as a browser shows it, on frames of the rendered twin: label.jpg.

Needs Chromium; run it again when the page has changed:

    python docs/figures/label.py
"""

import io
import shutil
import socket
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from browser import opened
from PIL import Image
from playwright.sync_api import ViewportSize

HERE = Path(__file__).resolve().parent
TWIN = HERE.parents[1] / "simulation" / "sets" / "standard"
FRAMES = ("dataset.toml", "background_*", "ball_0*", "m2_screw.jpg", "prism.jpg")
SIZE_PX: ViewportSize = {"width": 1400, "height": 620}


def main() -> None:
    """Label a few frames, serve the page, turn to the first ball, and keep what is seen."""
    with socket.create_server(("127.0.0.1", 0)) as found:
        port = found.getsockname()[1]
    with TemporaryDirectory() as folder:
        for pattern in FRAMES:
            for path in TWIN.glob(pattern):
                shutil.copy(path, folder)
        command = [sys.executable, "-m", "app", "label", folder, "--port", str(port)]
        with subprocess.Popen(
            command, cwd=HERE.parents[1], stdout=subprocess.PIPE, text=True
        ) as process:
            assert process.stdout
            while not process.stdout.readline().startswith("Open "):
                pass
            try:
                picture = photographed(f"http://127.0.0.1:{port}")
            finally:
                process.terminate()
    image = Image.open(io.BytesIO(picture)).convert("RGB").resize((1050, 465))
    image.save(HERE / "label.jpg", quality=82, optimize=True)


def photographed(url: str) -> bytes:
    """A PNG of the page at the third frame."""
    with opened(url, SIZE_PX) as page:
        page.wait_for_selector("#picture img")
        for key in ("n", "n"):
            page.keyboard.press(key)
            page.wait_for_timeout(1500)
        return page.screenshot()


if __name__ == "__main__":
    main()
