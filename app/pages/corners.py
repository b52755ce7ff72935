# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The browser page of `wedge label --corners`: the pad's corners over a raw frame."""

from collections.abc import Callable, Sequence

import numpy as np
from nicegui import ui
from nicegui.events import KeyEventArguments, MouseEventArguments
from PIL import Image

from app.pages.label import DRAWN, FINE_STEP_PX, HALO, STEP_PX, run_page
from recon.corner_book import CornerBook
from recon.images import read_frame
from recon.unwarp import Corners
from sensor.errors import WedgeError

NAMES = ("top left", "top right", "bottom right", "bottom left")
HELP = (
    ("drag", "move the corner that is nearest"),
    ("arrow keys", f"move the chosen corner by {STEP_PX:g} px, with Shift by {FINE_STEP_PX:g} px"),
    ("1 to 4", "choose a corner"),
    ("N, P", "next, previous frame"),
    ("F", "find the corners in the blank frame"),
    ("T", "turn: another side is the base's"),
    ("M", "mirror"),
    ("Ctrl Z", "undo"),
)


def serve(book: CornerBook, files: Sequence[str], port: int) -> None:
    """Serve the page on this computer until Ctrl-C.

    Raises:
        WedgeError: the port is in use.
    """
    run_page(lambda: CornersPage(book, files), f"Corners of {book.card.name}", port)


class CornersPage:
    """One browser tab: the raw frame with its corners, and the unwarped picture that they make."""

    def __init__(self, book: CornerBook, files: Sequence[str]) -> None:
        self.book, self.files = book, list(files)
        self.index = 0
        self.chosen = 0
        self.held: Corners | None = None
        self.dragging = False
        ui.keyboard(on_key=self.on_key, repeating=True)
        self.heading = ui.label().classes("text-lg").props("id=heading")
        with ui.row().classes("w-full no-wrap items-start"):
            self.raw = ui.interactive_image(
                on_mouse=self.on_mouse,
                events=["mousedown", "mousemove", "mouseup", "mouseleave"],
                sanitize=False,
            ).props("id=raw draggable=false")
            with ui.column():
                ui.label("Unwarped: base and green light on the left")
                self.preview = ui.interactive_image().props("id=preview")
                for key, meaning in HELP:
                    with ui.row().classes("no-wrap gap-2"):
                        ui.label(key).classes("font-bold w-24 shrink-0")
                        ui.label(meaning)
        with ui.row():
            ui.button("Find", icon="search", on_click=self.find)
            ui.button("Turn", icon="rotate_right", on_click=self.turn).props("outline")
            ui.button("Mirror", icon="flip", on_click=self.mirror).props("outline")
            ui.button("Undo", icon="undo", on_click=self.undo).props("outline")
            ui.button("Next frame", on_click=lambda: self.step(1)).props("outline")
        self.show()

    def show(self) -> None:
        """The frame, and what the corners make of it."""
        try:
            self.frame = read_frame(self.book.folder, self.files[self.index])
        except WedgeError as error:
            ui.notify(str(error), type="negative")
            return
        height, width = self.frame.shape[:2]
        self.raw.set_source(Image.fromarray(self.frame))
        shown = min(3.0, 640 / height, 720 / width)
        self.raw.style(f"width: {shown * width:.0f}px; max-width: none")
        self.draw()

    def draw(self) -> None:
        """Corners, heading and preview."""
        corners = self.held or self.book.corners_px
        points = " ".join(f"{x + 0.5},{y + 0.5}" for x, y in corners)
        size = self.frame.shape[1] / 240
        parts = []
        for color, width in ((HALO, 1.4 * size), (DRAWN, 0.5 * size)):
            stroke = f'stroke="{color}" stroke-width="{width}"'
            parts.append(f'<polygon points="{points}" fill="none" {stroke}/>')
            for index, (x, y) in enumerate(corners):
                radius = (5 if index == self.chosen else 3) * size
                parts.append(
                    f'<circle cx="{x + 0.5}" cy="{y + 0.5}" r="{radius}" fill="none" {stroke}/>'
                )
        for index, (x, y) in enumerate(corners):
            parts.append(
                f'<text x="{x + 0.5}" y="{y - 6 * size}" font-size="{9 * size}" fill="{HALO}"'
                f' stroke="{DRAWN}" stroke-width="{0.2 * size}">{index + 1}</text>'
            )
        self.raw.set_content("".join(parts))
        x, y = corners[self.chosen]
        self.heading.set_text(
            f"{self.files[self.index]}: corner {self.chosen + 1}, {NAMES[self.chosen]} of the"
            f" unwarped picture, at ({x:.2f}, {y:.2f}) px"
        )
        if self.held is None:
            seen = np.clip(self.book.unwarp(self.frame) * 255, 0, 255).astype(np.uint8)
            self.preview.set_source(Image.fromarray(seen))
            self.preview.style(f"width: {max(320, seen.shape[1])}px; max-width: none")

    def on_mouse(self, event: MouseEventArguments) -> None:
        """Drag the nearest corner."""
        place = (event.image_x - 0.5, event.image_y - 0.5)
        if event.type == "mousedown":
            self.chosen, self.dragging = self.book.nearest(place), True
        elif event.type == "mousemove" and self.dragging:
            self.held = self.book.moved(self.chosen, place)
        elif event.type in ("mouseup", "mouseleave") and self.dragging:
            self.dragging = False
            if self.held is not None:
                held = self.held
                self.attempt(lambda: self.book.put(held))
        self.draw()

    def on_key(self, event: KeyEventArguments) -> None:
        """Every edit by a key."""
        if not event.action.keydown:
            return
        name = event.key.name if len(event.key.name) > 1 else event.key.name.lower()
        step = FINE_STEP_PX if event.modifiers.shift else STEP_PX
        steps = {
            "ArrowLeft": (-step, 0),
            "ArrowRight": (step, 0),
            "ArrowUp": (0, -step),
            "ArrowDown": (0, step),
        }
        plain: dict[str, Callable[[], None]] = {
            "n": lambda: self.step(1),
            "p": lambda: self.step(-1),
            "f": self.find,
            "t": self.turn,
            "m": self.mirror,
        }
        if name == "z" and (event.modifiers.ctrl or event.modifiers.meta):
            self.undo()
        elif name in steps:
            x, y = self.book.corners_px[self.chosen]
            moved = self.book.moved(self.chosen, (x + steps[name][0], y + steps[name][1]))
            self.attempt(lambda: self.book.put(moved))
        elif name in ("1", "2", "3", "4"):
            self.chosen = int(name) - 1
            self.draw()
        elif name in plain and not event.modifiers.ctrl:
            plain[name]()

    def step(self, by: int) -> None:
        """Another frame."""
        self.index = (self.index + by) % len(self.files)
        self.show()

    def find(self) -> None:
        """The corners as the blank frame shows them."""
        self.attempt(lambda: self.book.put(self.book.found()))

    def turn(self) -> None:
        """Another side is the base's."""
        self.attempt(self.book.turn)

    def mirror(self) -> None:
        """Turn the picture over."""
        self.attempt(self.book.mirror)

    def undo(self) -> None:
        """Take the last change back."""

        def back() -> None:
            if not self.book.undo():
                ui.notify("There is nothing left to undo.")

        self.attempt(back)

    def attempt(self, change: Callable[[], None]) -> None:
        """Make a change and show it, or say why it could not be made."""
        try:
            change()
        except (WedgeError, OSError) as error:
            ui.notify(str(error), type="negative", timeout=0, close_button=True)
        self.held = None
        self.draw()
