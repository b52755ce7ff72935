# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The browser page of `wedge label --corners`: the pad's corners over a raw frame."""

from collections.abc import Callable, Sequence

import numpy as np
from nicegui import ui

from app.pages.canvas import DRAWN, HALO, STROKES, Canvas, Place
from app.pages.editing import (
    ARROWS,
    CLOSE,
    FINE_STEP_PX,
    NOTHING_TO_UNDO,
    STEP_PX,
    UNDO,
    Complaint,
    Heading,
    arrow_buttons,
    button,
    fitting,
    keys_explained,
    listen,
    run_page,
    when_turned_to,
)
from app.pages.pictures import FINE_QUALITY, as_url
from recon.arrays import Frame
from recon.geometry.unwarp import Corners
from recon.images import read_frame
from recon.labels.corner_book import CornerBook, Move
from recon.presses import PressReader
from sensor.errors import WedgeError

PREVIEW_TALLEST = "60vh"
LABEL_PX, DIGIT_PX = 11, 9
"""From a corner to the middle of its digit, past its ring, and the digit's size; of 240 columns."""
NAMES = ("top left", "top right", "bottom right", "bottom left")
HELP = (
    ("drag", "move the nearest corner"),
    ("arrow keys", f"move the chosen corner by {STEP_PX:g} px, with Shift by {FINE_STEP_PX:g} px"),
    ("1 to 4", "choose a corner"),
    ("N, P", "next, previous frame"),
    ("F", "find the corners in the blank frame"),
    ("T", "turn: make another side the base"),
    ("M", "mirror"),
    ("Ctrl Z", "undo"),
)


def serve(reader: PressReader, files: Sequence[str], port: int) -> None:
    """Serve the page on this computer until Ctrl-C.

    Raises:
        WedgeError: the port is in use.
    """
    dataset = reader.dataset
    history: list[Move] = []

    def build() -> CornersPage:
        return CornersPage(CornerBook(dataset, reader.background, reader.lens, history), files)

    run_page(build, f"Corners of {dataset.card.name}", port)


class CornersPage:
    """One browser tab: the raw frame with its corners, and the unwarped picture that they make.

    It has a book of its own, as if it were another program, but undo takes back what was done in
    any tab, one that was closed or loaded anew too.
    """

    def __init__(self, book: CornerBook, files: Sequence[str]) -> None:
        self.book, self.files = book, list(files)
        self.index = 0
        self.chosen = 0
        self.frame: Frame | None = None
        """As shown, ``None`` where it cannot be read: what nobody sees is not edited."""
        self.held: Corners | None = None
        self.complaint = Complaint()
        listen(self.on_key)
        when_turned_to(self.look_again)
        self.heading = Heading()
        with ui.element("div").classes(
            "grid grid-cols-1 lg:grid-cols-[minmax(0,3fr)_minmax(0,2fr)] gap-4 w-full"
        ):
            with ui.column().classes("min-w-0"):
                size_px = self.book.frame_size_px
                self.canvas = Canvas("raw", "The raw frame", size_px, self)
                self.raw = self.canvas.picture
                self.raw.style(f"width: {fitting(size_px)}")
                with ui.row():
                    button("Find", "search", self.find, first=True)
                    button("Turn", "rotate_right", self.turn)
                    button("Mirror", "flip", self.mirror)
                    button("Undo", "undo", self.undo)
                    button("Previous frame", None, lambda: self.step(-1))
                    button("Next frame", None, lambda: self.step(1))
                    arrow_buttons(self.on_key)
            with ui.column().classes("min-w-0"):
                ui.label("Unwarped: base and green light on the left")
                self.preview = ui.interactive_image()
                self.preview.props('id=preview role=img aria-label="The unwarped picture"')
                keys_explained(HELP)
        self.show()

    def show(self) -> None:
        """The frame, and what the corners make of it; where it cannot be read, why."""
        file = self.files[self.index]
        self.held = None
        self.canvas.let_go()
        try:
            self.book.catch_up()
            self.frame = read_frame(self.book.folder, file)
            self.book.unwarp.check(self.frame)
        except (WedgeError, OSError) as error:
            self.frame = None
            self.heading.say_why(f"cannot be shown: {error}", file)
        else:
            self.raw.set_source(as_url(self.frame, FINE_QUALITY))
            self.draw()
        for picture in (self.raw, self.preview):
            picture.set_visibility(self.frame is not None)

    def draw(self) -> None:
        """Corners, heading and preview."""
        if self.frame is None:
            return
        corners = self.held or self.book.corners_px
        points = " ".join(f"{x + 0.5},{y + 0.5}" for x, y in corners)
        size = self.frame.shape[1] / 240
        parts = []
        chosen_px, other_px = 5 * size, 3 * size
        radii = [chosen_px if index == self.chosen else other_px for index in range(len(corners))]
        for color, width in STROKES:
            line = (
                f'fill="none" stroke="{color}" stroke-width="{width}"'
                ' vector-effect="non-scaling-stroke"'
            )
            parts.append(f'<polygon points="{points}" {line}/>')
            parts += [
                f'<circle cx="{x + 0.5}" cy="{y + 0.5}" r="{radius}" {line}/>'
                for (x, y), radius in zip(corners, radii, strict=True)
            ]
        for index, (x, y) in enumerate(label_places(corners, self.book.frame_size_px)):
            parts.append(
                f'<text x="{x + 0.5}" y="{y + 0.5}" font-size="{DIGIT_PX * size}" fill="{HALO}"'
                f' text-anchor="middle" dominant-baseline="central" stroke="{DRAWN}"'
                f' stroke-width="{0.2 * size}">{index + 1}</text>'
            )
        held = self.held is not None
        self.canvas.draw("".join(parts), [(corner, chosen_px) for corner in corners], held=held)
        x, y = corners[self.chosen]
        self.heading.say(
            self.files[self.index],
            f"corner {self.chosen + 1}, {NAMES[self.chosen]} of the unwarped picture,"
            f" at ({x:.2f}, {y:.2f}) px",
            held=held,
        )
        if self.held is None:
            unwarp = self.book.unwarp
            seen = np.clip(unwarp(self.frame) * 255, 0, 255).astype(np.uint8)
            self.preview.set_source(as_url(seen, FINE_QUALITY))
            self.preview.style(f"width: {fitting(unwarp.size_px, PREVIEW_TALLEST)}")

    def take(self, place_px: Place) -> Place:
        """The nearest corner."""
        self.chosen = self.book.nearest(place_px)
        self.draw()
        return self.book.corners_px[self.chosen]

    def drag(self, place_px: Place) -> None:
        """Show it elsewhere."""
        self.held = self.book.moved(self.chosen, place_px)
        self.draw()

    def drop(self) -> None:
        """Keep it where it is shown."""
        if (held := self.held) is not None:
            self.move(lambda: self.book.put(held))

    def put_back(self) -> None:
        """Show the corners that are kept."""
        self.held = None
        self.draw()

    def on_key(self, key: str, step_px: float, held: bool) -> None:
        """Every edit by a key; those of one that is held are taken back together."""
        plain: dict[str, Callable[[], object]] = {
            "n": lambda: self.step(1),
            "p": lambda: self.step(-1),
            "f": self.find,
            "t": self.turn,
            "m": self.mirror,
            UNDO: self.undo,
        }
        if key in ARROWS:
            x_px, y_px = self.book.corners_px[self.chosen]
            dx, dy = ARROWS[key]
            place = (x_px + step_px * dx, y_px + step_px * dy)
            self.move(lambda: self.book.put(self.book.moved(self.chosen, place), held=held))
        elif key in ("1", "2", "3", "4"):
            self.chosen = int(key) - 1
            self.draw()
        elif key in plain:
            plain[key]()

    def look_again(self) -> None:
        """Show what others have changed meanwhile; not while a corner is held."""
        if not self.canvas.is_held:
            self.show()

    def step(self, by: int) -> None:
        """Another frame."""
        self.index = (self.index + by) % len(self.files)
        self.show()

    def find(self) -> None:
        """The corners as the blank frame shows them."""
        self.move(lambda: self.book.put(self.book.found()))

    def turn(self) -> None:
        """Another side is the base's."""
        self.move(self.book.turn)

    def mirror(self) -> None:
        """Turn the picture over."""
        self.move(self.book.mirror)

    def undo(self) -> None:
        """Take back the last change made in any tab."""

        def back() -> None:
            if not self.book.undo():
                ui.notify(NOTHING_TO_UNDO)

        self.attempt(back)

    def move(self, change: Callable[[], int]) -> None:
        """Move corners, and say what becomes of the circles found in pixels of the old ones."""

        def say_dropped() -> None:
            if dropped := change():
                ui.notify(
                    f"{dropped} circles were dropped, as they lay in pixels of the old corners: "
                    "undo brings them back, wedge label finds them again.",
                    timeout=15_000,
                    actions=[CLOSE],
                )

        self.attempt(say_dropped)

    def attempt(self, change: Callable[[], object]) -> None:
        """Make a change to what is seen and show it, or say why it could not be made."""
        if self.frame is None:
            ui.notify(
                f"{self.files[self.index]} is not shown: nothing was changed.", type="warning"
            )
            return
        try:
            change()
        except (WedgeError, OSError) as error:
            self.complaint.say(error)
            self.show()  # others may have moved the corners anywhere
        else:
            self.complaint.withdraw()
            self.held = None
            self.draw()


def label_places(corners: Corners, size_px: tuple[int, int]) -> list[tuple[float, float]]:
    """Where the corners' digits stand: outward, or inward where that leaves the frame."""
    width, height = size_px
    away, room = LABEL_PX * width / 240, DIGIT_PX / 2 * width / 240
    middle = np.mean(corners, axis=0)
    places = []
    for corner in np.asarray(corners, float):
        step = away * (corner - middle) / max(float(np.hypot(*(corner - middle))), 1e-9)
        x, y = corner + step
        is_seen = room <= x <= width - 1 - room and room <= y <= height - 1 - room
        x, y = corner + step if is_seen else corner - step
        places.append((float(x), float(y)))
    return places
