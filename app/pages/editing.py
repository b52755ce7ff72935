# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What the pages that edit a dataset share: how they are served, their keys and their buttons."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

from nicegui import ui
from nicegui.events import KeyEventArguments, MouseEventArguments

from app.pages.serving import run
from sensor.errors import WedgeError

STEP_PX, FINE_STEP_PX = 1.0, 0.25
DRAWN = "#111111"
HALO = "#ffffff"
UNDO = "Ctrl z"
ARROWS = {
    "ArrowLeft": (-1, 0),
    "ArrowRight": (1, 0),
    "ArrowUp": (0, -1),
    "ArrowDown": (0, 1),
}
DRAG_ENDS = ("pointerup", "pointerleave")
DRAG_IS_NONE = "pointercancel"
"""The browser has taken the finger for one of its own gestures, such as a pinch."""
POINTER_EVENTS = ["pointerdown", "pointermove", *DRAG_ENDS, DRAG_IS_NONE]
"""Of a mouse, a pen or a finger."""
CLOSE = {"label": "Close", "color": "white"}
"""Of a message: to be read on its ground."""
BLUE = "#1565c0"
"""Of buttons: white on it, and it on white, can be read."""
TALLEST = "100vh - 14rem"
"""Of a picture: it, its heading and its buttons are seen at once."""
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
        try:
            build()
        except WedgeError as error:
            heading().set_text(str(error))

    with suppress(KeyboardInterrupt):  # so it ends, as said
        print(
            f"Open http://127.0.0.1:{port} and end with Ctrl-C; every change is saved at once.",
            flush=True,
        )
        run(title, "127.0.0.1", port, show=False)


def listen(on_key: Callable[[str, float, bool], None]) -> None:
    """Call with every key that is the page's.

    With it go the pixels that an arrow moves by, and whether the key is held and comes again.
    """

    def pressed(event: KeyEventArguments) -> None:
        if (key := key_of(event)) is not None:
            step_px = FINE_STEP_PX if event.modifiers.shift else STEP_PX
            on_key(key, step_px, event.action.repeat)

    # A button that Tab has reached keeps Enter and Space to itself: other keys stay the page's.
    keyboard = ui.keyboard(pressed, repeating=True, ignore=["input", "select", "textarea"])
    keyboard.on("key", js_handler=STILL)


def when_turned_to(look_again: Callable[[], None]) -> None:
    """Call when somebody comes back to the tab: others may have changed what it shows."""
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


def canvas(
    name: str,
    meaning: str,
    size_px: tuple[int, int],
    on_mouse: Callable[[MouseEventArguments], None],
) -> tuple[ui.interactive_image, ui.interactive_image]:
    """A picture to draw on, and what is drawn: that moves without the picture being sent anew.

    ``add_layer`` would have the browser send each picture back, and complain of a large one.
    """
    picture = ui.interactive_image(
        size=size_px, on_mouse=on_mouse, events=POINTER_EVENTS, sanitize=False
    ).props(f'id={name} draggable=false role=img aria-label="{meaning}"')
    picture.style("touch-action: pinch-zoom")  # one finger draws, two are the browser's
    with picture:
        drawn = ui.interactive_image(size=size_px, events=[], sanitize=False)
    return picture, drawn.classes("nicegui-interactive-image-layer")


def heading() -> ui.label:
    """The page's first line, which says what is shown."""
    return ui.label().classes("text-lg").props("id=heading role=heading aria-level=1")


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
    """One that shows its icon alone, and says its meaning to who rests on it or hears the page."""
    with button("", icon, on_click).props(f'aria-label="{meaning}"'):
        ui.tooltip(meaning)


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
        self._shown = ui.notification(options=told)

    def withdraw(self) -> None:
        """Show nothing any more."""
        if self._shown is not None:
            self._shown.dismiss()
            self._shown = None
