# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The page of `wedge label` under fingers, on a tablet without keys or a wheel."""

from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.app.served import opened, served
from tests.app.test_label_page import labels, shown_file
from tests.browser import needs_chromium
from tests.synthetic import make_dataset

pytestmark = needs_chromium


def test_a_pinch_moves_and_makes_no_circle(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=2)
    with served("label", dataset.folder) as address, opened(address) as page:
        heading, picture = page.locator("#heading"), page.locator("#picture img").first
        box = picture.bounding_box()

        def finger(*kinds: str) -> None:
            for step, kind in enumerate(kinds):
                place = {"clientX": box["x"] + 60 + 20 * step, "clientY": box["y"] + 60}
                picture.dispatch_event(kind, {"button": 0, **place})

        before = heading.inner_text()
        finger("pointerdown", "pointermove")
        expect(heading).to_contain_text("let go to save")
        finger("pointercancel")
        expect(heading).to_have_text(before)
        page.get_by_text("No ball", exact=True).click()
        expect(heading).to_contain_text("no ball")
        none = heading.inner_text()
        finger("pointerdown")
        expect(heading).to_contain_text("let go to save")
        finger("pointercancel")
        expect(heading).to_have_text(none)
        assert len(labels(dataset)) == 1
        finger("pointerdown", "pointerup")  # a tap places one
        expect(heading).to_contain_text("quality 1.00")
        assert len(labels(dataset)) == 2


def test_a_finger_drags_the_circle(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=1)
    with served("label", dataset.folder) as address, opened(address) as page:
        picture, circle = page.locator("#picture img").first, page.locator("#picture circle").first
        picture.wait_for()
        box = circle.bounding_box()
        assert box is not None
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        finger = page.context.new_cdp_session(page)
        for kind, places in (
            ("touchStart", [(x, y)]),
            ("touchMove", [(x + 20, y)]),
            ("touchMove", [(x + 40, y + 20)]),
            ("touchEnd", []),
        ):
            points = [{"x": at, "y": down} for at, down in places]
            finger.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
        expect(page.locator("#heading")).to_contain_text("quality 1.00")
        after = circle.bounding_box()
        assert after is not None
        assert after["x"] - box["x"] == pytest.approx(40, abs=3)
        assert after["y"] - box["y"] == pytest.approx(20, abs=3)


def test_buttons_do_what_keys_and_wheel_do(tmp_path: Path) -> None:
    dataset = make_dataset(tmp_path / "set", presses=2)
    with served("label", dataset.folder) as address, opened(address, 820, 1180) as page:
        heading, first = page.locator("#heading"), shown_file(page)
        radius_px = labels(dataset)[first].contact_radius_px
        page.get_by_role("button", name="Larger circle").click()
        expect(heading).to_contain_text(f"radius {1.02 * radius_px:.2f} px")
        page.get_by_role("button", name="Smaller circle").click()
        expect(heading).to_contain_text(f"radius {radius_px:.2f} px")
        page.get_by_role("button", name="Next frame").click()
        expect(heading).not_to_contain_text(first)
        page.get_by_role("button", name="Previous frame").click()
        expect(heading).to_contain_text(first)
        page.get_by_role("button", name="Undo").click()  # a tap is a step
        expect(heading).to_contain_text(f"radius {1.02 * radius_px:.2f} px")
