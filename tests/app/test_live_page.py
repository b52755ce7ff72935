# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The live page in browsers that are slow, that are two, that have lost their server."""

import signal
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import Page, WebSocket, expect

from recon.images import write_image
from tests.app.served import opened, served, serving, until_it_answers
from tests.browser import needs_chromium
from tests.recon.fast.units import make_unit, pressed

pytestmark = needs_chromium
SOURCE = "document.querySelector('.raw img').src"
HOLD = "window.held = []; window.emit = emitEvent; window.emitEvent = (...x) => held.push(x); 0"
LET_GO = "window.emitEvent = emit; emit(...held[0])"
FILLED = """() => [...document.querySelectorAll(".picture:has(img)")].every(
    place => Math.abs(place.clientHeight - place.querySelector("img").clientHeight) < 2)"""
NO_WEBGL = """HTMLCanvasElement.prototype.getContext = (usual => function (kind, ...how) {
    return kind.includes("webgl") ? null : usual.call(this, kind, ...how);
})(HTMLCanvasElement.prototype.getContext)"""
TWICE = """() => {
    const ids = [...document.querySelectorAll("#app [id]")].map(x => x.id);
    return ids.filter((id, at) => ids.indexOf(id) !== at);
}"""


@contextmanager
def live(folder: Path, *words: object) -> Iterator[tuple[Page, str]]:
    """The page of frames that are still but for their noise, and its address."""
    blank = make_unit((160, 120)).background
    for index in range(20):
        write_image(folder / "frames" / f"{index}.png", pressed(blank, (60, 60), index))
    words = (folder / "frames", *words, "--captures", folder / "kept")
    with served("live", *words) as address, opened(address, part=".state") as page:
        yield page, address


def test_a_browser_that_owes_an_answer_is_sent_nothing_more(tmp_path: Path) -> None:
    received: list[str] = []

    def listen(socket: WebSocket) -> None:
        socket.on("framereceived", lambda message: received.append(str(message)))

    with live(tmp_path) as (page, address):
        slow = page.context.new_page()
        slow.on("websocket", listen)
        slow.goto(address)
        expect(slow.locator(".age")).to_contain_text("s old")
        slow.evaluate(HOLD)
        slow.wait_for_function("held.length")
        received.clear()
        before = slow.evaluate(SOURCE)
        for _ in range(3):
            page.wait_for_function(f"before => {SOURCE} != before", arg=page.evaluate(SOURCE))
        assert not any("data:image" in message for message in received)
        assert slow.evaluate("held.length") == 1
        slow.evaluate(LET_GO)
        slow.wait_for_function(f"before => {SOURCE} != before", arg=before)


def test_both_tabs_are_told_of_a_new_background(tmp_path: Path) -> None:
    with live(tmp_path) as (page, address):
        other = page.context.new_page()
        other.goto(address)
        for tab in (page, other):
            expect(tab.locator(".state")).to_have_text("live")
        page.get_by_text("Take background").click()
        for tab in (page, other):
            tab.get_by_text("Saved ").wait_for()


def test_a_page_without_its_server_does_not_look_live(tmp_path: Path) -> None:
    write_image(tmp_path / "frames" / "0.png", make_unit((160, 120)).background)
    with (
        serving("live", tmp_path / "frames") as (address, server),
        opened(address, part=".state") as page,
    ):
        expect(page.locator(".state")).to_have_text("live")
        gone = page.get_by_text("The page has lost its server")
        expect(gone).to_be_hidden()
        server.kill()
        gone.wait_for()
        expect(page.locator(".state")).to_be_hidden()
        assert page.locator(".picture").first.evaluate("x => getComputedStyle(x).opacity") < "0.5"


@pytest.mark.parametrize("alone", [True, False])
def test_every_part_has_a_name_of_its_own(alone: bool, tmp_path: Path) -> None:
    make_unit((160, 120)).save(tmp_path / "unit")
    units = ["--unit", *[tmp_path / "unit"] * (2 - alone)]
    with live(tmp_path, *[tmp_path / "frames"] * (not alone), *units) as (page, _):
        expect(page.locator(".state").first).to_have_text("live")
        assert page.evaluate(TWICE) == []
        assert page.evaluate("document.documentElement.lang") == "en-US"
        page.get_by_role("heading", name="GelSight Wedge", level=1).wait_for()
        sensor = page.locator("#sensor-0")
        for name in ("Raw", "Difference", "Depth", "Pose and markers", "Surface", "Deepest point"):
            sensor.get_by_role("heading", name=name, exact=True, level=3).wait_for()
        assert sensor.locator("[role=img][aria-label]").count() == 5


def test_pictures_fill_their_place_and_buttons_stay_side_by_side(tmp_path: Path) -> None:
    make_unit((160, 120)).save(tmp_path / "unit")
    words = [tmp_path / "frames", "--unit", *[tmp_path / "unit"] * 2]
    with live(tmp_path, *words) as (page, _):
        page.wait_for_function("document.querySelectorAll('.picture img[src^=data]').length == 8")
        for width_px in (1280, 390):
            page.set_viewport_size({"width": width_px, "height": 800})
            page.wait_for_function(FILLED)
            tops = [page.get_by_text(x).first.bounding_box() for x in ("Take back", "Save frame")]
            assert tops[0] and tops[1] and abs(tops[0]["y"] - tops[1]["y"]) < 1


def test_two_sensors_buttons_are_told_apart_and_long_names_fit_a_phone(tmp_path: Path) -> None:
    other = tmp_path / ("long" * 30)
    write_image(other / "0.png", make_unit((160, 120)).background)
    with live(tmp_path, other) as (page, _):
        buttons = page.get_by_role("button").all()
        names = {button.get_attribute("aria-label") for button in buttons}
        assert names == {
            f"{what} of {whose}"
            for what in ("Take background", "Save frame")
            for whose in ("frames", other.name)
        }
        for width_px in (1280, 390):
            page.set_viewport_size({"width": width_px, "height": 800})
            page.wait_for_function(
                "width => document.documentElement.scrollWidth === width", arg=width_px
            )


def test_a_browser_without_webgl_is_told_so(tmp_path: Path) -> None:
    make_unit((160, 120)).save(tmp_path / "unit")
    with live(tmp_path, "--unit", tmp_path / "unit") as (page, _):
        page.add_init_script(NO_WEBGL)
        page.reload()
        page.get_by_text("This browser has no WebGL 2").wait_for()
        expect(page.locator(".surface")).to_be_hidden()
        expect(page.get_by_text("drag to turn")).to_be_hidden()


def test_a_browser_that_hangs_up_is_no_news_and_ctrl_c_ends_the_page_well(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    write_image(tmp_path / "frames" / "0.png", make_unit((160, 120)).background)
    asked = "POST /_nicegui_ws/socket.io/?EIO=4&transport=polling HTTP/1.1\r\nHost: x\r\n"
    with serving("live", tmp_path / "frames") as (address, server):
        until_it_answers(address)
        host, _, port = address.removeprefix("http://").partition(":")
        with socket.create_connection((host, int(port))) as browser:
            browser.sendall(f"{asked}Content-Length: 9\r\n\r\n".encode())
        until_it_answers(address)
        server.send_signal(signal.SIGINT)
        assert server.wait(timeout=60) == 0
    assert capfd.readouterr().err == ""
