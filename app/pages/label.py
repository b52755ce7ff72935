# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The browser page of `wedge label`: circles over frames, moved by mouse and keys."""

import json
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from nicegui import ui
from nicegui.events import GenericEventArguments

from app.pages.canvas import Canvas, Place
from app.pages.circle import drawn, grown, moved, new_circle, words
from app.pages.editing import (
    ARROWS,
    FINE_STEP_PX,
    NOTHING_TO_UNDO,
    STEP_PX,
    TALLEST,
    UNDO,
    Complaint,
    Heading,
    arrow_buttons,
    button,
    fitting,
    keys_explained,
    listen,
    run_page,
    small_button,
    when_turned_to,
)
from app.pages.frame_list import FrameList
from app.pages.pictures import FINE_QUALITY, as_url
from recon.images import read_frame
from recon.labels.find_circle import DOUBTFUL
from recon.labels.label_book import (
    CERTAIN,
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
"""Factor on the difference in its view, around middle grey."""
GROW = 1.02
WHEEL = """(e) => {
    if (e.ctrlKey || e.metaKey || Math.abs(e.deltaY) <= Math.abs(e.deltaX)) return;
    e.preventDefault();
    const goesOn = e.timeStamp - (window.turnedAt ?? -Infinity) < 500;
    window.turnedAt = e.timeStamp;
    emit(e.deltaMode ? 100 * Math.sign(e.deltaY) : e.deltaY, goesOn);
}"""
"""With Ctrl the wheel is the browser's zoom, and a swipe to the side scrolls. Turns that follow one
another within half a second are one."""
NOTCH = 100.0
"""What browsers say of one notch of a wheel; a swipe on a trackpad gives many smaller ones."""
SCROLL = """requestAnimationFrame(() => requestAnimationFrame(() => {
    const view = document.getElementById("view"), [x, y] = [%f, %f];
    view.scrollLeft = x * view.scrollWidth - view.clientWidth / 2;
    view.scrollTop = y * view.scrollHeight - view.clientHeight / 2;
}));"""
"""Scrolls two frames later, when the browser has laid out the new size."""
ASKED = "frame"
REMEMBER = f"""{{
    const there = new URL(location);
    there.searchParams.set("{ASKED}", %s);
    history.replaceState(history.state, "", there);
}}"""
"""Keeps the frame in the address: a page that is loaded again, as after a restart, shows it."""
ONCE = ("Enter", "Delete", "Backspace")
"""Keys that judge a frame and turn to the next; held down, they judge none that nobody has seen."""
HELP = (
    ("drag", "move the circle"),
    ("wheel, + and −", "resize it"),
    ("arrow keys", f"move by {STEP_PX:g} px, with Shift by {FINE_STEP_PX:g} px"),
    ("Enter", "confirm it; next frame"),
    ("N, P", "next, previous frame"),
    ("Del, Backspace", "no ball in this frame"),
    ("Ctrl Z", "undo"),
    ("D", "difference or frame"),
    ("Z", "zoom"),
)
CONTACT = (
    "The circle marks the contact. It is smaller than the visible disc, as the gel beside the ball "
    "slopes too."
)
QUALITY = (
    "Quality says from 0 to 1 how well the picture matches a ball pressed into that circle. "
    f"Below {DOUBTFUL:g}, with a triangle in the list, the circle is doubtful: check it. The "
    f"quality is {CERTAIN:.2f} once you move or confirm the circle."
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
                    ui.label(QUALITY)
        self.show(self.file)

    def _middle(self) -> None:
        with ui.column().classes("grow min-w-0"):
            self.heading = Heading()
            with ui.element("div").classes("w-full overflow-auto").props("id=view") as view:
                view.style(f"max-height: calc({TALLEST})")
                self.canvas = Canvas(
                    "picture", "The frame, unwarped", self.reader.unwarp.size_px, self
                )
                self.picture = self.canvas.picture
                self.picture.on("wheel", self.on_wheel, js_handler=WHEEL)
            with ui.row():
                button("Right, next", "check", self.accept, first=True)
                button("No ball", "block", self.remove)
                button("Undo", "undo", self.undo)
                button("Difference / frame", None, self.switch)
                button("Zoom", "zoom_in", self.magnify)
                with ui.row().classes("no-wrap gap-2"):
                    small_button("Smaller circle", "remove", lambda: self.resize(1 / GROW))
                    small_button("Larger circle", "add", lambda: self.resize(GROW))
                    small_button("Previous frame", "chevron_left", lambda: self.turn(-1))
                    small_button("Next frame", "chevron_right", lambda: self.turn(1))
                arrow_buttons(self.on_key)

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
        self.file, self.moved = file, None
        self.canvas.let_go()
        try:
            self.book.catch_up()
            frame = self.reader.unwarped(file, read_frame(self.reader.dataset.folder, file))
        except (WedgeError, OSError) as error:
            self.seen = False
            self.picture.set_visibility(False)
            self.heading.say_why(f"cannot be shown: {error}", file)
            self.mark()
            return
        if self.view == "difference":
            frame = np.clip(0.5 + CONTRAST * self.reader.difference(frame), 0, 1)
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
        self.looked_at.set_text(f"{self.book.looked_at} of {len(self.files)} frames checked")

    def look_again(self) -> None:
        """Draw what others have changed meanwhile; not while a circle is held."""
        if self.canvas.is_held:
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
            known = "no ball, as marked" if self.book.has_no_ball(self.file) else "no circle"
            self.heading.say(self.file, f"{known}; click where the ball touches")
            self.canvas.draw("", ())
            return
        known = "not scored" if label.quality is None else f"quality {label.quality:.2f}"
        known = "let go to save" if self.moved else known
        said = words(label, self.reader.dataset.card.mm_per_px)
        held = self.moved is not None
        self.heading.say(self.file, f"{said}, {known}", held=held)
        grip = label.center_px, label.contact_radius_px
        self.canvas.draw(drawn(label), [grip], held=held)

    def take(self, place_px: Place) -> Place | None:
        """The circle; on a frame without one, a new one is placed here."""
        if not self.seen:
            return None
        label = self.book.label(self.file)
        if label is None:
            first = self.reader.dataset.label(self.file)
            ball_mm = None if first is None else first.ball_radius_mm
            label = new_circle(self.file, *place_px, self.largest_px / 2, ball_mm)
            label = self.moved = moved(label, *place_px, self.reader.unwarp.size_px)
            self.draw()
        return label.center_px

    def drag(self, place_px: Place) -> None:
        """Show the circle elsewhere."""
        label = self.moved or self.book.label(self.file)
        if label is not None:
            self.moved = moved(label, *place_px, self.reader.unwarp.size_px)
            self.draw()

    def drop(self) -> None:
        """Keep the circle where it is shown."""
        if self.moved is not None:
            self.keep(self.moved)

    def put_back(self) -> None:
        """Show the circle that is kept."""
        self.moved = None
        self.draw()

    def on_wheel(self, event: GenericEventArguments) -> None:
        """Resize the circle by as much as the wheel turns, a notch at most."""
        turned, goes_on = event.args
        self.resize(GROW ** -(min(max(turned, -NOTCH), NOTCH) / NOTCH), goes_on)

    def on_key(self, key: str, step_px: float, held: bool) -> None:
        """Every edit by a key; those of one that is held are taken back together."""
        plain: dict[str, Callable[[], object]] = {
            "Enter": self.accept,
            "Delete": self.remove,
            "Backspace": self.remove,
            "n": lambda: self.turn(1),
            "p": lambda: self.turn(-1),
            "d": self.switch,
            "z": self.magnify,
            "+": lambda: self.resize(GROW, held),
            "=": lambda: self.resize(GROW, held),  # the same key without Shift
            "-": lambda: self.resize(1 / GROW, held),
            UNDO: self.undo,
        }
        label = self.book.label(self.file)
        if held and key in ONCE:
            return
        if key in ARROWS and label is not None:
            x_px, y_px = label.center_px
            dx, dy = (step_px * by for by in ARROWS[key])
            self.keep(moved(label, x_px + dx, y_px + dy, self.reader.unwarp.size_px), held)
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
            ui.notify(f"The change to {file}, which is not in this list, was undone.")
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

    def resize(self, factor: float, held: bool = False) -> None:
        """Grow or shrink the circle."""
        label = self.book.label(self.file)
        if label is not None:
            self.keep(grown(label, factor, self.largest_px), held)

    @property
    def largest_px(self) -> float:
        """A contact circle is smaller than its ball."""
        dataset = self.reader.dataset
        return largest_radius_px(dataset, dataset.label(self.file))

    def keep(self, label: BallLabel, held: bool = False) -> bool:
        """Write a label; whether it could be written."""
        return self.edit(lambda: self.book.put(label, held=held))

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
