# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the page of `wedge label` draws over frames of any size, and how it names them."""

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Page, expect

from recon.images import read_image, write_image
from sensor.dataset import Dataset, read_dataset, write_card, write_labels
from tests.app.served import opened, served
from tests.browser import needs_chromium
from tests.synthetic import SIZE_PX, make_dataset

pytestmark = needs_chromium


def enlarged(dataset: Dataset, times: int) -> Dataset:
    """The same in finer pixels, of gel at rest: its difference is grey."""
    card = dataset.card
    rest = read_image(dataset.folder / card.background[0])
    for path in dataset.folder.glob("*.png"):
        write_image(path, np.repeat(np.repeat(rest, times, axis=0), times, axis=1))
    x_mm, y_mm = (mm / times for mm in card.mm_per_px)
    write_card(dataset.folder / "dataset.toml", replace(card, mm_per_px=(x_mm, y_mm)))
    (label,) = dataset.labels
    finer = replace(
        label,
        center_x_px=times * 60.5 - 0.5,
        center_y_px=times * 45.5 - 0.5,
        contact_radius_px=times * 15.0,
    )
    write_labels(dataset.folder / "labels.csv", [finer])
    return read_dataset(dataset.folder)


def drawn_over(page: Page) -> np.ndarray:
    """Which pixels of the screen's picture are not the frame's grey."""
    page.locator("#picture img").first.scroll_into_view_if_needed()
    shown = Image.open(io.BytesIO(page.locator("#picture").screenshot())).convert("L")
    return np.asarray(abs(np.asarray(shown, float) - 127.5) > 20)


@pytest.mark.parametrize("times", [1, 12])
def test_a_circle_and_its_cross_are_seen_in_frames_of_any_size(tmp_path: Path, times: int) -> None:
    dataset = enlarged(make_dataset(tmp_path / "set", presses=1), times)
    with served("label", dataset.folder) as address, opened(address) as page:
        page.locator("#picture circle").first.wait_for()
        page.wait_for_function("document.querySelector('#picture img').naturalWidth > 0")
        for width_px in (360, 1400):
            page.set_viewport_size({"width": width_px, "height": 800})
            page.wait_for_function(f"innerWidth === {width_px}")
            drawn = drawn_over(page)
            scale = drawn.shape[1] / SIZE_PX[0]
            row, column, radius = 45.5 * scale, 60.5 * scale, 15 * scale
            y, x = np.indices(drawn.shape) + 0.5
            away = np.hypot(x - column, y - row)
            turns = np.arctan2(y - row, x - column)[drawn & (abs(away - radius) < 3)]
            assert np.histogram(turns, 36, (-np.pi, np.pi))[0].all()  # all around
            across = drawn & (away < 0.4 * radius)
            rows, columns = np.nonzero(across)
            assert 8 <= np.ptp(rows) + 1 <= 12 and 8 <= np.ptp(columns) + 1 <= 12
            assert not (drawn & (abs(away - radius) > 3) & (away > 0.4 * radius)).any()


def test_a_long_name_is_cut_and_told_whole(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=1)
    (label,) = dataset.labels
    name = f"{'long' * 40}.png"
    (dataset.folder / label.file).rename(dataset.folder / name)
    write_labels(dataset.folder / "labels.csv", [replace(label, file=name)])
    with served("label", dataset.folder) as address, opened(address) as page:
        for width_px in (360, 1400):
            page.set_viewport_size({"width": width_px, "height": 800})
            page.wait_for_function(f"innerWidth === {width_px}")
            assert page.evaluate("document.documentElement.scrollWidth") <= width_px
            heading = page.locator("#heading")
            expect(heading.get_by_title(name)).to_be_visible()
            (dataset.folder / name).rename(dataset.folder / "away")
            page.keyboard.press("n")
            expect(heading).to_contain_text("cannot be shown")
            assert page.evaluate("document.documentElement.scrollWidth") <= width_px
            (dataset.folder / "away").rename(dataset.folder / name)
            page.keyboard.press("n")
            expect(heading).to_contain_text("centre")
