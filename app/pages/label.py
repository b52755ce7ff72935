# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The browser page of `wedge label`: circles over frames, moved by mouse and keys."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from nicegui import ui
from nicegui.events import GenericEventArguments, KeyEventArguments, MouseEventArguments
from PIL import Image

from recon.images import read_frame
from recon.labelling import CERTAIN, DOUBTFUL, LabelBook, doubtful_first
from recon.presses import PressReader
from sensor.dataset import BallLabel
from sensor.errors import WedgeError

VIEWS = ("difference", "frame")
CONTRAST = 2.0
"""Of the difference view, around middle grey."""
STEP_PX, FINE_STEP_PX = 1.0, 0.25
GROW = 1.02
DRAWN = "#111111"
HALO = "#ffffff"
HELP = (
    ("drag", "move the circle"),
    ("wheel, + and −", "resize it"),
    ("arrow keys", f"move by {STEP_PX:g} px, with Shift by {FINE_STEP_PX:g} px"),
    ("Enter", "this one is right; next"),
    ("N, P", "next, previous frame"),
    ("Del", "no ball touches here"),
    ("Ctrl Z", "undo"),
    ("D", "difference or frame"),
    ("Z", "zoom"),
)


def serve(reader: PressReader, book: LabelBook, files: Sequence[str], port: int) -> None:
    """Serve the page on this computer until Ctrl-C.

    Raises:
        WedgeError: the port is in use.
    """
    title = f"Labels of {reader.dataset.card.name}"
    run_page(lambda: LabelPage(reader, book, files), title, port)


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
        build()

    print(f"Open http://127.0.0.1:{port} and end with Ctrl-C; every change is kept at once.")
    ui.run(
        host="127.0.0.1",
        port=port,
        title=title,
        show=False,
        reload=False,
        show_welcome_message=False,
    )


class LabelPage:
    """One browser tab: the list of frames, the picture with its circle, the numbers."""

    def __init__(self, reader: PressReader, book: LabelBook, files: Sequence[str]) -> None:
        self.reader, self.book = reader, book
        self.files = doubtful_first(files, book)
        self.file = self.files[0]
        self.view = VIEWS[0]
        self.zoom = 1
        self.grip: tuple[float, float] | None = None
        self.moved: BallLabel | None = None
        ui.keyboard(on_key=self.on_key, repeating=True)
        with ui.row().classes("w-full no-wrap items-start"):
            with ui.column().classes("w-72 h-screen overflow-auto").props("id=frames"):
                self.listing()
            with ui.column().classes("grow"):
                self.heading = ui.label().classes("text-lg").props("id=heading")
                with ui.element("div").classes("w-full overflow-auto max-h-[80vh]"):
                    self.picture = ui.interactive_image(
                        on_mouse=self.on_mouse,
                        events=["mousedown", "mousemove", "mouseup", "mouseleave"],
                        sanitize=False,
                    ).props("id=picture draggable=false")
                    self.picture.on("wheel.prevent", self.on_wheel, ["deltaY"])
                with ui.row():
                    ui.button("Right, next", icon="check", on_click=self.accept)
                    ui.button("No ball", icon="block", on_click=self.remove).props("outline")
                    ui.button("Undo", icon="undo", on_click=self.undo).props("outline")
                    ui.button("Difference / frame", on_click=self.switch).props("outline")
                    ui.button("Zoom", icon="zoom_in", on_click=self.magnify).props("outline")
            with ui.column().classes("w-72"):
                for key, meaning in HELP:
                    with ui.row().classes("no-wrap gap-2"):
                        ui.label(key).classes("font-bold w-28 shrink-0")
                        ui.label(meaning)
        self.show(self.file)

    @ui.refreshable_method
    def listing(self) -> None:
        """The frames, the doubtful ones first, each with what is known of its circle."""
        for file in self.files:
            label = self.book.label(file)
            icon, words = _standing(label)
            chosen = "bg-blue-100" if file == self.file else ""
            with (
                ui.row()
                .classes(f"w-full no-wrap cursor-pointer items-center gap-2 px-2 {chosen}")
                .on("click", lambda _, file=file: self.show(file))
            ):
                ui.icon(icon)
                ui.label(file).classes("grow truncate")
                ui.label(words)

    def show(self, file: str) -> None:
        """Turn to a frame."""
        self.file, self.moved, self.grip = file, None, None
        try:
            frame = self.reader.unwarp(read_frame(self.reader.dataset.folder, file))
        except WedgeError as error:
            ui.notify(str(error), type="negative")
            return
        if self.view == "difference":
            frame = np.clip(0.5 + CONTRAST * (frame - self.reader.blank), 0, 1)
        pixels = (frame * 255).round().astype(np.uint8)
        self.picture.set_source(Image.fromarray(pixels))
        width = max(640, frame.shape[1]) * self.zoom
        self.picture.style(f"width: {width}px; max-width: none; image-rendering: pixelated")
        self.draw()
        self.listing.refresh()

    def draw(self) -> None:
        """The circle and its numbers."""
        label = self.moved or self.book.label(self.file)
        if label is None:
            self.heading.set_text(f"{self.file}: no circle; click where the ball touches")
            self.picture.set_content("")
            return
        x, y, radius = label.center_x_px, label.center_y_px, label.contact_radius_px
        scale = float(np.sqrt(np.prod(self.reader.dataset.card.mm_per_px)))
        known = "not scored" if label.quality is None else f"quality {label.quality:.2f}"
        known = "let go to keep" if self.moved else known
        self.heading.set_text(
            f"{self.file}: centre ({x:.2f}, {y:.2f}) px, radius {radius:.2f} px"
            f" = {radius * scale:.2f} mm, {known}"
        )
        ring = f'cx="{x + 0.5}" cy="{y + 0.5}" r="{radius}" fill="none"'
        cross = f"M {x - 1.5} {y + 0.5} h 4 M {x + 0.5} {y - 1.5} v 4"
        self.picture.set_content(
            "".join(
                f'<circle {ring} stroke="{color}" stroke-width="{width}"/>'
                f'<path d="{cross}" stroke="{color}" stroke-width="{width}"/>'
                for color, width in ((HALO, 1.2), (DRAWN, 0.5))
            )
        )

    def on_mouse(self, event: MouseEventArguments) -> None:
        """Drag the circle; a click on a frame without one places it."""
        label = self.moved or self.book.label(self.file)
        x, y = event.image_x - 0.5, event.image_y - 0.5
        if event.type == "mousedown":
            if label is None:
                self.keep(self.new_label(x, y))
            else:
                self.grip = (x - label.center_x_px, y - label.center_y_px)
        elif event.type == "mousemove" and self.grip is not None and label is not None:
            self.moved = self.placed(label, x - self.grip[0], y - self.grip[1])
            self.draw()
        elif event.type in ("mouseup", "mouseleave") and self.grip is not None:
            self.grip = None
            if self.moved is not None:
                self.keep(self.moved)

    def on_wheel(self, event: GenericEventArguments) -> None:
        """Resize the circle."""
        self.resize(GROW if event.args["deltaY"] < 0 else 1 / GROW)

    def on_key(self, event: KeyEventArguments) -> None:
        """Every edit by a key."""
        if not event.action.keydown:
            return
        key, fine = event.key, FINE_STEP_PX if event.modifiers.shift else STEP_PX
        steps = {
            "ArrowLeft": (-1, 0),
            "ArrowRight": (1, 0),
            "ArrowUp": (0, -1),
            "ArrowDown": (0, 1),
        }
        name = key.name if len(key.name) > 1 else key.name.lower()
        plain: dict[str, Any] = {
            "Enter": self.accept,
            "Delete": self.remove,
            "n": lambda: self.turn(1),
            "p": lambda: self.turn(-1),
            "d": self.switch,
            "+": lambda: self.resize(GROW),
            "-": lambda: self.resize(1 / GROW),
        }
        label = self.book.label(self.file)
        if name == "z":
            self.undo() if event.modifiers.ctrl or event.modifiers.meta else self.magnify()
        elif name in steps and label is not None:
            dx, dy = steps[name]
            self.keep(
                self.placed(label, label.center_x_px + fine * dx, label.center_y_px + fine * dy)
            )
        elif name in plain and not event.modifiers.ctrl:
            plain[name]()

    def accept(self) -> None:
        """The circle is right: note it and turn to the next frame."""
        label = self.book.label(self.file)
        if label is not None:
            self.keep(replace(label, quality=CERTAIN))
        self.turn(1)

    def remove(self) -> None:
        """No ball touches here."""
        self.attempt(lambda: self.book.remove(self.file))

    def undo(self) -> None:
        """Take the last change back and show the frame it was made on."""

        def back() -> None:
            file = self.book.undo()
            if file is None:
                ui.notify("There is nothing left to undo.")
            else:
                self.show(file)

        self.attempt(back)

    def turn(self, by: int) -> None:
        """Turn to the frame after or before."""
        self.show(self.files[(self.files.index(self.file) + by) % len(self.files)])

    def switch(self) -> None:
        """The other view."""
        self.view = VIEWS[1 - VIEWS.index(self.view)]
        self.show(self.file)

    def magnify(self) -> None:
        """Twice, three times, and back."""
        self.zoom = self.zoom % 3 + 1
        self.show(self.file)

    def resize(self, factor: float) -> None:
        """Grow or shrink the circle."""
        label = self.book.label(self.file)
        if label is not None:
            radius = min(max(label.contact_radius_px * factor, 2.0), self.largest_px)
            self.keep(replace(label, contact_radius_px=round(radius, 2), quality=CERTAIN))

    @property
    def largest_px(self) -> float:
        """A contact circle is smaller than its ball."""
        card = self.reader.dataset.card
        return 0.98 * card.ball_radius_mm / float(np.sqrt(np.prod(card.mm_per_px)))

    def new_label(self, x_px: float, y_px: float) -> BallLabel:
        """A circle of half the ball's radius, where somebody clicked."""
        new = BallLabel(
            file=self.file,
            center_x_px=x_px,
            center_y_px=y_px,
            contact_radius_px=round(self.largest_px / 2, 2),
            quality=CERTAIN,
        )
        return self.placed(new, x_px, y_px)

    def placed(self, label: BallLabel, x_px: float, y_px: float) -> BallLabel:
        """The label moved, its centre kept inside the frame."""
        width, height = self.reader.unwarp.size_px
        return replace(
            label,
            center_x_px=round(min(max(x_px, 0.0), width - 1.0), 2),
            center_y_px=round(min(max(y_px, 0.0), height - 1.0), 2),
            quality=CERTAIN,
        )

    def keep(self, label: BallLabel) -> None:
        """Write a label."""
        self.attempt(lambda: self.book.put(label))

    def attempt(self, change: Any) -> None:
        """Make a change and show it, or say why it could not be made."""
        try:
            change()
        except (WedgeError, OSError) as error:
            ui.notify(str(error), type="negative", timeout=0, close_button=True)
        self.moved = None
        self.draw()
        self.listing.refresh()


def _standing(label: BallLabel | None) -> tuple[str, str]:
    """An icon and a word on a frame's circle."""
    if label is None:
        return "radio_button_unchecked", "none"
    if label.quality is None:
        return "help_outline", "not scored"
    if label.quality >= CERTAIN:
        return "check_circle", "seen"
    return ("warning" if label.quality < DOUBTFUL else "adjust"), f"{label.quality:.2f}"
