# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the pages that edit a dataset share: how they are served, their words, keys and buttons."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from typing import Any

from nicegui import ui
from nicegui.events import KeyEventArguments

from app.pages.serving import run
from sensor.errors import WedgeError

STEP_PX, FINE_STEP_PX = 1.0, 0.25
UNDO = "Ctrl z"
ARROWS = {
    "ArrowLeft": (-1, 0),
    "ArrowRight": (1, 0),
    "ArrowUp": (0, -1),
    "ArrowDown": (0, 1),
}
ARROW_BUTTONS = {
    "ArrowLeft": ("Move left", "arrow_back"),
    "ArrowRight": ("Move right", "arrow_forward"),
    "ArrowUp": ("Move up", "arrow_upward"),
    "ArrowDown": ("Move down", "arrow_downward"),
}
CLOSE = {"label": "Close", "color": "white"}
"""The button that closes a message, in a colour that can be read on it."""
BLUE = "#1565c0"
"""Colour of buttons: white can be read on it, and it on white."""
TALLEST = "100vh - 14rem"
"""Height of a picture at most, so that its heading and its buttons are seen with it."""
STYLE = """
#heading { container-type: inline-size; width: 100%; font-variant-numeric: tabular-nums; }
#heading .words { font-size: 1rem; line-height: 1.5rem; height: 1.5rem; overflow: hidden; }
@container (max-width: 38rem) {
    #heading .words { font-size: .875rem; line-height: 1.25rem; height: 2.5rem;
        text-wrap: balance; }
}
#heading .why { height: auto; overflow-wrap: anywhere; }
"""
"""The heading above a picture is as high whatever it says, as the picture must not move under a
pointer that drags; only the reason why there is no picture may take more room."""
NOTHING_TO_UNDO = "There is nothing left to undo since this command was started."
STILL = """(e) => {
    if (e.key.startsWith("Arrow") && !e.ctrlKey && !e.metaKey && !e.altKey)
        e.event.preventDefault();
}"""
"""Arrow keys move what is drawn: the page and its list stay where they are."""
TURNED_TO = "turned-to"
WATCH = f"""window.addEventListener("focus", () => emitEvent("{TURNED_TO}"));"""


def run_page(build: Callable[[], object], title: str, port: int) -> None:
    """Serve a page on this computer until Ctrl-C, built anew for every tab.

    Raises:
        WedgeError: the port is in use.
    """
    import socket

    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
        except OSError as error:
            raise WedgeError(f"port {port} is in use: choose another with --port.") from error

    @ui.page("/")
    def page() -> None:
        ui.colors(primary=BLUE)
        ui.add_css(STYLE)
        try:
            build()
        except WedgeError as error:
            Heading().say_why(str(error))

    with suppress(KeyboardInterrupt):  # so it ends, as said
        print(
            f"Open http://127.0.0.1:{port} and end with Ctrl-C; every change is saved at once.",
            flush=True,
        )
        run(title, "127.0.0.1", port, show=False)


def listen(on_key: Callable[[str, float, bool], None]) -> None:
    """Call ``on_key`` with every key that is the page's and not the browser's.

    Its arguments are the key, the pixels that an arrow moves by, and whether the key is held down.
    """

    def pressed(event: KeyEventArguments) -> None:
        if (key := key_of(event)) is not None:
            step_px = FINE_STEP_PX if event.modifiers.shift else STEP_PX
            on_key(key, step_px, event.action.repeat)

    # A button that Tab has reached keeps Enter and Space to itself: other keys stay the page's.
    keyboard = ui.keyboard(pressed, repeating=True, ignore=["input", "select", "textarea"])
    keyboard.on("key", js_handler=STILL)


def when_turned_to(look_again: Callable[[], None]) -> None:
    """Call ``look_again`` when somebody comes back to the tab: its files may have changed."""
    ui.on(TURNED_TO, look_again)
    ui.add_body_html(f"<script>{WATCH}</script>")


def key_of(event: KeyEventArguments) -> str | None:
    """The key that was pressed, a letter in lower case; ``UNDO`` for Ctrl Z and Cmd Z.

    Returns:
        ``None`` where a key is let go, and for all that Ctrl, Cmd or Alt make the browser's own.
    """
    if not event.action.keydown:
        return None
    held = event.modifiers
    name = event.key.name if len(event.key.name) > 1 else event.key.name.lower()
    if held.ctrl or held.meta:
        return UNDO if name == "z" and not (held.alt or held.shift) else None
    return None if held.alt else name


class Heading:
    """The page's first lines: the frame that is shown, and what is drawn in it.

    Screen readers tell the same, but not every step of a drag.
    """

    def __init__(self) -> None:
        with ui.element("div").props("id=heading role=heading aria-level=1"):
            self._name = ui.label().classes("text-lg truncate")
            self._words = ui.label().classes("words")
        self._spoken = ui.label().classes("sr-only").props("id=spoken aria-live=polite")

    def say(self, file: str, words: str, *, held: bool = False) -> None:
        """Name the frame, and tell of what is drawn; ``held`` while it is dragged."""
        self._words.classes(remove="why")
        self._set(f"{file}: ", words)
        if not held:
            self._spoken.set_text(f"{file}: {words}")

    def say_why(self, reason: str, file: str = "") -> None:
        """Tell why there is nothing to see of a frame, or at all."""
        self._words.classes(add="why")
        self._set(f"{file} ", reason)
        self._spoken.set_text(f"{file} {reason}".strip())

    def _set(self, name: str, words: str) -> None:
        self._name.set_text(name)
        self._name.props["title"] = name.strip(": ")
        self._words.set_text(words)


def fitting(size_px: tuple[int, int], tallest: str = TALLEST) -> str:
    """The CSS width of a picture, width by height, that fills its column or is so tall."""
    width, height = size_px
    return f"min(100%, max(8rem, ({tallest}) * {width / height:.4f}))"


def button(
    text: str, icon: str | None, on_click: Callable[[], Any], *, first: bool = False
) -> ui.button:
    """A button that a click gives no focus: Enter stays the page's, where Tab has not gone."""
    made = ui.button(text, icon=icon, on_click=lambda: on_click())
    made.props("" if first else "outline")
    return made.on("mousedown", js_handler="(e) => e.preventDefault()")


def small_button(meaning: str, icon: str, on_click: Callable[[], Any]) -> None:
    """A button with an icon alone; a tooltip and screen readers tell its meaning."""
    with button("", icon, on_click).props(f'aria-label="{meaning}"'):
        ui.tooltip(meaning)


def arrow_buttons(on_key: Callable[[str, float, bool], None]) -> None:
    """Buttons that do what arrow keys do."""
    with ui.row().classes("no-wrap gap-2"):
        for key, (meaning, icon) in ARROW_BUTTONS.items():
            small_button(meaning, icon, partial(on_key, key, STEP_PX, False))


def keys_explained(lines: Sequence[tuple[str, str]]) -> None:
    """A line for each key and what it does."""
    for key, meaning in lines:
        with ui.row().classes("no-wrap gap-2"):
            ui.label(key).classes("font-bold w-28 shrink-0")
            ui.label(meaning)


class Complaint:
    """Why a change could not be made, shown until somebody closes it or a change is made."""

    def __init__(self) -> None:
        self._shown: ui.notification | None = None

    def say(self, error: Exception) -> None:
        """Show it in place of what was shown."""
        self.withdraw()
        told = {"message": str(error), "type": "negative", "timeout": 0, "actions": [CLOSE]}
        # One of a group must not be changed, which dismissing is for the browser.
        self._shown = ui.notification(options={**told, "group": False})

    def withdraw(self) -> None:
        """Show nothing any more."""
        if self._shown is not None:
            self._shown.dismiss()
            self._shown = None
