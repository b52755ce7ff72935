# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The browser page of `wedge label`: circles over frames, moved by mouse and keys."""

import json
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from nicegui import ui
from nicegui.events import GenericEventArguments, MouseEventArguments

from app.pages.editing import (
    ARROWS,
    DRAG_ENDS,
    DRAG_IS_NONE,
    DRAWN,
    FINE_STEP_PX,
    HALO,
    NOTHING_TO_UNDO,
    STEP_PX,
    TALLEST,
    UNDO,
    Complaint,
    button,
    canvas,
    fitting,
    heading,
    keys_explained,
    listen,
    run_page,
    when_turned_to,
)
from app.pages.frame_list import FrameList
from app.pages.pictures import FINE_QUALITY, as_url
from recon.images import read_frame
from recon.labels.label_book import (
    CERTAIN,
    DOUBTFUL,
    Change,
    LabelBook,
    doubtful_first,
    largest_radius_px,
    pressed_frames,
)
from recon.presses import PressReader
from sensor.dataset import BallLabel
from sensor.errors import WedgeError

VIEWS = ("difference", "frame")
CONTRAST = 2.0
"""Of the difference view, around middle grey."""
GROW = 1.02
WHEEL = """(e) => {
    if (e.ctrlKey || e.metaKey || Math.abs(e.deltaY) <= Math.abs(e.deltaX)) return;
    e.preventDefault();
    emit(e.deltaMode ? 100 * Math.sign(e.deltaY) : e.deltaY);
}"""
"""With Ctrl the wheel is the browser's zoom, and a swipe to the side scrolls."""
NOTCH = 100.0
"""What browsers say of one; of a swipe on a trackpad they say less, many times."""
SCROLL = """requestAnimationFrame(() => requestAnimationFrame(() => {
    const view = document.getElementById("view"), [x, y] = [%f, %f];
    view.scrollLeft = x * view.scrollWidth - view.clientWidth / 2;
    view.scrollTop = y * view.scrollHeight - view.clientHeight / 2;
}));"""
"""Two frames on, when the browser has laid out the new size."""
ASKED = "frame"
REMEMBER = f"""{{
    const there = new URL(location);
    there.searchParams.set("{ASKED}", %s);
    history.replaceState(history.state, "", there);
}}"""
"""So a page that is loaded anew, as after its server was, shows the frame that it showed."""
HELP = (
    ("drag", "move the circle"),
    ("wheel, + and −", "resize it"),
    ("arrow keys", f"move by {STEP_PX:g} px, with Shift by {FINE_STEP_PX:g} px"),
    ("Enter", "this one is right; next"),
    ("N, P", "next, previous frame"),
    ("Del, Backspace", "no ball touches here"),
    ("Ctrl Z", "undo"),
    ("D", "difference or frame"),
    ("Z", "zoom"),
)
CONTACT = (
    "The circle is the contact. It is smaller than the disc that shows, as the gel beside the ball "
    "slopes too."
)


def serve(reader: PressReader, port: int) -> None:
    """Serve the page on this computer until Ctrl-C.

    Raises:
        WedgeError: the port is in use.
    """
    history: list[Change] = []
    run_page(lambda: LabelPage(reader, history), f"Labels of {reader.dataset.card.name}", port)


class LabelPage:
    """One browser tab: the list of frames, the picture with its circle, the numbers.

    It has a book of its own, as if it were another program, but undo takes back what was done in
    any tab, one that was closed or loaded anew too.
    """

    def __init__(self, reader: PressReader, history: list[Change]) -> None:
        """Draw what is in the folder by now.

        Raises:
            WedgeError: it cannot be read, holds no press any more, or circles lie in other pixels
                than the reader's.
        """
        self.reader, self.book = reader, LabelBook(reader.dataset, history)
        self.book.catch_up()
        files = pressed_frames(reader.dataset.folder, reader.dataset.card)
        if not files:
            raise WedgeError(f"{reader.dataset.folder} holds no picture of a press any more.")
        self.files = doubtful_first(files, self.book)
        asked = ui.context.client.request.query_params.get(ASKED, "")
        self.file = asked if asked in self.files else self.files[0]
        self.view = VIEWS[0]
        self.zoom = 1
        self.seen = False
        """Whether the frame is shown: what nobody sees is not edited."""
        self.grip: tuple[float, float] | None = None
        self.moved: BallLabel | None = None
        self.complaint = Complaint()
        listen(self.on_key)
        when_turned_to(self.look_again)
        with ui.element("div").classes("flex flex-col sm:flex-row flex-nowrap gap-4 w-full"):
            self.list = FrameList(self.files, self.standing, self.show)
            self.list.element.classes(
                "w-full sm:w-48 lg:w-72 shrink-0 h-40 sm:h-[calc(100vh-2rem)]"
            )
            self.list.element.classes("overflow-auto sm:sticky sm:top-0")
            with ui.element("div").classes(
                "flex flex-col xl:flex-row flex-nowrap gap-4 grow min-w-0"
            ):
                self._middle()
                with ui.column().classes("w-72 shrink-0"):
                    self.looked_at = ui.label().props("id=looked-at")
                    keys_explained(HELP)
                    ui.label(CONTACT)
        self.show(self.file)

    def _middle(self) -> None:
        with ui.column().classes("grow min-w-0"):
            self.heading = heading()
            with ui.element("div").classes("w-full overflow-auto").props("id=view") as view:
                view.style(f"max-height: calc({TALLEST})")
                self.picture, self.circle = canvas(
                    "picture", "The frame, unwarped", self.reader.unwarp.size_px, self.on_mouse
                )
                self.picture.on("wheel", self.on_wheel, js_handler=WHEEL)
            with ui.row():
                button("Right, next", "check", self.accept, first=True)
                button("No ball", "block", self.remove)
                button("Undo", "undo", self.undo)
                button("Difference / frame", None, self.switch)
                button("Zoom", "zoom_in", self.magnify)

    def standing(self, file: str) -> tuple[str, str]:
        """An icon and a word on a frame's circle."""
        label = self.book.label(file)
        if label is None:
            seen = self.book.has_no_ball(file)
            return ("block", "no ball") if seen else ("radio_button_unchecked", "none")
        if label.quality is None:
            return "help_outline", "not scored"
        if label.quality >= CERTAIN:
            return "check_circle", "seen"
        return ("warning" if label.quality < DOUBTFUL else "adjust"), f"{label.quality:.2f}"

    def show(self, file: str) -> None:
        """Turn to a frame; where it cannot be read, say so in its place."""
        self.file, self.moved, self.grip = file, None, None
        try:
            self.book.catch_up()
            frame = self.reader.unwarp(read_frame(self.reader.dataset.folder, file))
        except (WedgeError, OSError) as error:
            self.seen = False
            self.picture.set_visibility(False)
            self.heading.set_text(f"{file} cannot be shown: {error}")
            self.mark()
            return
        if self.view == "difference":
            frame = np.clip(0.5 + CONTRAST * (frame - self.reader.blank), 0, 1)
        self.picture.set_source(as_url((frame * 255).round().astype(np.uint8), FINE_QUALITY))
        width = f"calc({self.zoom} * {fitting(self.reader.unwarp.size_px)})"
        self.picture.style(f"width: {width}; max-width: none; image-rendering: pixelated")
        self.picture.set_visibility(True)
        self.seen = True
        self.draw()
        self.mark()
        self.bring_into_view()
        self.picture.client.run_javascript(REMEMBER % json.dumps(file))

    def mark(self) -> None:
        """Say in the list how the frame stands, and those that others have changed."""
        self.list.mark(self.file, self.book.news())
        self.looked_at.set_text(f"{self.book.looked_at} of {len(self.files)} frames looked at")

    def look_again(self) -> None:
        """Draw what others have changed meanwhile; not while a circle is held."""
        if self.grip is not None:
            return
        try:
            self.book.catch_up()
        except WedgeError:
            self.seen = False
        if self.seen:
            self.draw()
            self.mark()
        else:
            self.show(self.file)  # says why not

    def bring_into_view(self) -> None:
        """Scroll a magnified picture until its circle is in the middle."""
        width, height = self.reader.unwarp.size_px
        label = self.book.label(self.file)
        at = (0.5, 0.5)
        if label is not None:
            at = ((label.center_x_px + 0.5) / width, (label.center_y_px + 0.5) / height)
        self.picture.client.run_javascript(SCROLL % at)

    def draw(self) -> None:
        """The circle and its numbers."""
        label = self.moved or self.book.label(self.file)
        if label is None:
            known = "no ball, as you said" if self.book.has_no_ball(self.file) else "no circle"
            self.heading.set_text(f"{self.file}: {known}; click where the ball touches")
            self.circle.set_content("")
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
        self.circle.set_content(
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
        if event.type == "pointerdown" and event.button == 0 and self.seen:
            if label is None:
                label = self.moved = self.new_label(x, y)
                self.draw()
            self.grip = (x - label.center_x_px, y - label.center_y_px)
        elif event.type == "pointermove" and self.grip is not None and label is not None:
            self.moved = self.placed(label, x - self.grip[0], y - self.grip[1])
            self.draw()
        elif event.type == DRAG_IS_NONE:
            self.grip = self.moved = None
            self.draw()
        elif event.type in DRAG_ENDS and self.grip is not None:
            self.grip = None
            if self.moved is not None:
                self.keep(self.moved)

    def on_wheel(self, event: GenericEventArguments) -> None:
        """Resize the circle by as much as the wheel turns, a notch at most."""
        self.resize(GROW ** -(min(max(event.args, -NOTCH), NOTCH) / NOTCH))

    def on_key(self, key: str, step_px: float) -> None:
        """Every edit by a key."""
        plain: dict[str, Callable[[], object]] = {
            "Enter": self.accept,
            "Delete": self.remove,
            "Backspace": self.remove,
            "n": lambda: self.turn(1),
            "p": lambda: self.turn(-1),
            "d": self.switch,
            "z": self.magnify,
            "+": lambda: self.resize(GROW),
            "=": lambda: self.resize(GROW),  # the same key without Shift
            "-": lambda: self.resize(1 / GROW),
            UNDO: self.undo,
        }
        label = self.book.label(self.file)
        if key in ARROWS and label is not None:
            x_px, y_px = label.center_x_px, label.center_y_px
            dx, dy = ARROWS[key]
            self.keep(self.placed(label, x_px + step_px * dx, y_px + step_px * dy))
        elif key in plain:
            plain[key]()

    def accept(self) -> None:
        """The circle is right: note it and turn to the next frame; stay where that fails."""
        label = self.book.label(self.file)
        if not self.seen or label is None or self.keep(replace(label, quality=CERTAIN)):
            self.turn(1)

    def remove(self) -> None:
        """No ball touches here."""
        self.edit(lambda: self.book.remove(self.file))

    def undo(self) -> None:
        """Show the frame of the last change made in any tab, and take that back."""
        file = self.book.last_edited
        if file is None:
            ui.notify(NOTHING_TO_UNDO)
            return
        if file in self.files:
            self.show(file)
        if self.attempt(self.book.undo) and file not in self.files:
            ui.notify(f"The change to {file}, which is not in this list, was taken back.")
        self.bring_into_view()

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
        return largest_radius_px(self.reader.dataset, self.file)

    def new_label(self, x_px: float, y_px: float) -> BallLabel:
        """A circle of half the ball's radius, where somebody clicked; its ball stays the same."""
        first = self.reader.dataset.label(self.file)
        new = BallLabel(
            file=self.file,
            center_x_px=x_px,
            center_y_px=y_px,
            contact_radius_px=round(self.largest_px / 2, 2),
            ball_radius_mm=None if first is None else first.ball_radius_mm,
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

    def keep(self, label: BallLabel) -> bool:
        """Write a label; whether it could be written."""
        return self.edit(lambda: self.book.put(label))

    def edit(self, change: Callable[[], object]) -> bool:
        """Change the frame that is seen; whether that was done."""
        if not self.seen:
            ui.notify(f"{self.file} is not shown: nothing was changed.", type="warning")
            return False
        return self.attempt(change)

    def attempt(self, change: Callable[[], object]) -> bool:
        """Make a change and show it, or say why it could not be made; whether it was."""
        done = True
        try:
            change()
        except (WedgeError, OSError) as error:
            self.complaint.say(error)
            done = False
        else:
            self.complaint.withdraw()
        self.moved = None
        if self.seen:
            self.draw()
        self.mark()
        return done
