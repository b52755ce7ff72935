# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The browser page of `wedge live`: each sensor's pictures, its touch, and how its stream fares."""

import time
from collections.abc import Callable, Sequence

from nicegui import app, ui
from nicegui.elements.scene.objects.texture import Texture
from nicegui.events import GenericEventArguments

from app.pages import pictures
from app.pages.course import HISTORY_S, Course
from app.pages.following import Followed
from app.pages.serving import run
from app.pages.watching import STEEPNESS, VIEW_S, Glimpse, Watcher
from sensor.errors import WedgeError

SURFACE_S = 0.15
"""Time between two surfaces, which take a browser longer than pictures."""
AGE_S = 0.5
"""Time between two ages of what is shown; nobody reads them more quickly."""
ARRIVED = "arrived"
ARRIVE = f"""requestAnimationFrame(() => emitEvent("{ARRIVED}", %d));"""
"""Answers once all before it is drawn; a tab that nobody looks at does not, and is sent nothing."""
STYLE = """
body { background: #10151c; color: #e6edf3; font-variant-numeric: tabular-nums; }
.sensor { background: #18202a; border: 1px solid #2a3542; border-radius: 14px; }
.picture { background: #0b0f14; border-radius: 8px; overflow: hidden; }
.picture img { width: 100%; display: block; }
.shown:has(img:not([src^=data])) { aspect-ratio: 4 / 3; } /* before the first picture */
.quiet { color: #9fb0c0; }
.stream > :empty { display: none; }
.surface { width: 100% !important; height: auto !important; contain: size; }
.stale { color: #93a3b3; } .stale.shown, .stale :is(.picture, svg) { opacity: .35; }
.big { font-size: 2rem; line-height: 1.1; font-weight: 600; }
.remark { color: #ffcf70; }
.chip { border-radius: 999px; padding: 1px 10px; font-size: .75rem; font-weight: 600; }
.on { background: #123b36; color: #6fe3d0; } .off { background: #47220f; color: #ffb38a; }
.name, .remark { min-width: 0; overflow-wrap: anywhere; }
.gone, .flat { display: none; }
body.no-webgl { .turning { display: none; } .flat { display: block; } }
body:has(#popup[aria-hidden="false"]) { /* while the browser has lost the page's server */
    .gone { display: block; }
    .sensor { color: #93a3b3; }
    .sensor :is(.picture, svg) { opacity: .35; }
    .chip { visibility: hidden; }
}
"""


FLAT = "This browser has no WebGL 2: look at the pictures instead."
NO_WEBGL = """<script>
if (!document.createElement("canvas").getContext("webgl2"))
    document.body.classList.add("no-webgl");
</script>"""


def serve(watchers: Sequence[Watcher], address: str, port: int, *, show: bool) -> None:
    """Serve the page until Ctrl-C."""

    @ui.page("/")
    def page() -> None:
        ui.add_css(STYLE)
        ui.add_body_html(NO_WEBGL)
        ui.dark_mode(True)
        ui.query(".nicegui-content").classes("p-4 gap-4 max-w-[1800px] mx-auto")
        with ui.row().classes("w-full items-baseline gap-3"):
            _heading("GelSight Wedge", 1).classes("text-xl font-semibold")
            ui.label("live").classes("text-xl quiet")
            ui.label("The page has lost its server: what is shown is old.").classes("gone remark")
        columns = "grid-cols-1 xl:grid-cols-2" if len(watchers) > 1 else "grid-cols-1"
        with ui.element("div").classes(f"grid {columns} gap-4 w-full"):
            cards = [
                SensorCard(watcher, number, alone=len(watchers) == 1)
                for number, watcher in enumerate(watchers)
            ]
        Tab(cards)

    for watcher in watchers:
        app.on_startup(watcher.start)
        app.on_shutdown(watcher.close)
    run("GelSight Wedge live", address, port, favicon="👆", show=show)


class Tab:
    """The page of one browser, which is sent what is new once it has drawn what came before.

    So on a slow link it is late by one picture of each sensor, and no queue of them grows.
    """

    def __init__(self, cards: Sequence["SensorCard"]) -> None:
        self.cards = cards
        self.number = 0
        """Of what was sent last."""
        self.is_awaited = False
        ui.on(ARRIVED, self.arrived)
        ui.context.client.on_connect(self.begin_anew)
        ui.timer(VIEW_S, self.update)

    def update(self) -> None:
        """Send what is new, unless the browser still owes an answer."""
        for card in self.cards:
            card.watcher.watched_s = time.monotonic()
        if self.is_awaited:
            return
        self.number, self.is_awaited = self.number + 1, True
        for card in self.cards:
            card.update()
        ui.run_javascript(ARRIVE % self.number)

    def arrived(self, event: GenericEventArguments) -> None:
        """Note that the browser shows what was sent last."""
        if event.args == self.number:
            self.is_awaited = False
            for card in self.cards:
                card.arrived()

    def begin_anew(self) -> None:
        """Wait no more: the answer may have been lost with the connection before."""
        self.is_awaited = False


class SensorCard:
    """One sensor on the page of one browser."""

    def __init__(self, watcher: Watcher, number: int, *, alone: bool) -> None:
        self.watcher = watcher
        self.sent: Glimpse | None = None
        self.seen: Glimpse | None = None
        """The last one that the browser has drawn."""
        self.said = watcher.message[0]
        self.surface_s = self.age_s = 0.0
        with ui.column().classes("sensor w-full p-4 gap-3").props(f"id=sensor-{number}"):
            self._head()
            pictured = "grid-cols-2 lg:grid-cols-4" if watcher.unit and alone else "grid-cols-2"
            with ui.element("div").classes(f"grid {pictured} gap-3 w-full"):
                self.raw = _picture("Raw", "as the camera sees it", "raw")
                blank = "blank gel" if watcher.unit else "first frame, or to a background since"
                about = f"to the {blank}, ×{pictures.CONTRAST:g} about grey"
                self.difference = _picture("Difference", about, "difference")
                self.touch: list[ui.element] = [self.difference]
                """What shows the touch, and fades where frames tell none."""
                if watcher.unit:
                    marks = "contact outlined, cross at the deepest point"
                    self.depth = _picture("Depth", marks, "depth")
                    axes = "axes of the object: x blue, y orange, z green; shifts of dots ×3"
                    self.posed = _picture("Pose and markers", axes, "posed")
                    self.touch += [self.depth, self.posed]
            if watcher.unit is None:
                ui.label(
                    "Depth needs the sensor's unit: wedge live WHERE --unit UNIT. "
                    "`wedge calibrate` makes it from ball presses."
                ).classes("quiet")
            else:
                layout = (
                    "lg:grid-cols-[minmax(0,2fr)_minmax(0,1fr)]"
                    if alone
                    else "sm:grid-cols-[minmax(0,3fr)_minmax(0,2fr)]"
                )
                self.touch.append(
                    ui.element("div").classes(f"grid grid-cols-1 {layout} gap-3 w-full")
                )
                with self.touch[-1]:
                    self._surface(alone)
                    self._numbers()
            self._stream()

    def _head(self) -> None:
        with ui.row().classes("w-full items-center gap-3"):
            whose = self.watcher.title
            _heading(whose, 2).classes("name text-lg font-semibold")
            if self.watcher.name != whose:
                ui.label(self.watcher.name).classes("name quiet text-sm")
                whose = f"{whose}, {self.watcher.name}"
            self.chip = ui.label("waiting").classes("chip off state").props("role=status")
            with ui.row().classes("ml-auto gap-3 no-wrap"):
                blank = "Nothing may touch the gel: the next frames are averaged to the blank frame"
                kept = f"Write the newest frame to {self.watcher.captures}"
                for text, icon, meaning, on_click in (
                    ("Take background", "filter_none", blank, self.take_background),
                    ("Save frame", "photo_camera", kept, self.save_frame),
                ):
                    made = _button(text, icon, meaning, on_click)
                    made.props["aria-label"] = f"{text} of {whose}"
        self.remark = ui.label().classes("remark text-sm").props("role=status")

    def _surface(self, alone: bool) -> None:
        with ui.column().classes("gap-1 w-full min-w-0"):
            _heading("Surface", 3).classes("text-sm font-medium")
            with ui.element("div").classes("picture w-full"):
                size = (980, 420) if alone else (500, 320)
                with ui.scene(*size, grid=False, background_color="#0b0f14") as self.scene:
                    self.texture: Texture | None = None
                self.scene.classes("surface turning").style(f"aspect-ratio: {size[0]} / {size[1]}")
                self.scene.props('role=img aria-label="The depth as a surface that turns"')
                self.scene.move_camera(0, -4.3, 4.3, 0, -0.3, -0.3, 0, 0, 1, duration=0)
                ui.label(FLAT).classes("flat p-4")
            ui.label(f"drag to turn, wheel to zoom; depth drawn {STEEPNESS:g}× steeper").classes(
                "turning quiet text-xs"
            )

    def _numbers(self) -> None:
        with ui.column().classes("gap-2 w-full"):
            self.deepest, self.deepest_line = _figure("Deepest point", "mm", 2, "deepest")
            self.area, self.area_line = _figure("Contact area", "mm²", 1, "contact")
            with ui.row().classes("items-center gap-2"):
                _heading("Object's pose", 3).classes("text-sm font-medium")
                self.pose_state = ui.label("–").classes("chip off pose-state")
            self.pose = ui.label().classes("text-sm pose")
            since = ui.label(
                "since its first touch; lift it for a second, and the next touch is a new object"
            )
            since.classes("quiet text-xs").set_visibility(not self.watcher.apart)
            _heading("Markers", 3).classes("text-sm font-medium")
            self.markers = ui.label().classes("text-sm markers")
            with ui.column().classes("gap-0 w-full"):
                _heading("Colours of depth", 3).classes("text-sm font-medium")
                bar = ui.element("div").classes("w-full h-3 rounded mt-1")
                bar.style(f"background: {pictures.legend()}")
                with ui.row().classes("w-full justify-between quiet text-xs"):
                    ui.label("0 mm")
                    self.scale = ui.label()

    def _stream(self) -> None:
        with ui.row().classes("stream w-full gap-x-6 gap-y-1 items-baseline quiet text-sm"):
            self.facts = {
                name: ui.label().classes(name)
                for name in ("rate", "latency", "age", "work", "lost", "connections")
            }

    def update(self) -> None:
        """Send what is new."""
        watcher, live = self.watcher, self.watcher.live
        if watcher.message[0] != self.said:
            self.said, words = watcher.message
            ui.notify(words, type="positive", position="bottom-right")
        self.remark.set_text(watcher.remark)
        self.remark.set_visibility(bool(watcher.remark))
        self.chip.set_text("live" if live else "waiting")
        _switch(self.chip, "on", live)
        _switch(self.chip, "off", not live)
        _switch(self.raw, "stale", not live)
        for part in self.touch:  # what is shown was so, and may be no more
            _switch(part, "stale", not live or bool(watcher.misfit))
        self._update_facts()
        glimpse = watcher.glimpse
        if glimpse is not None and glimpse is not self.sent:
            self.sent = glimpse
            self._show(glimpse)

    def arrived(self) -> None:
        """Note that the browser has drawn what was sent."""
        self.seen = self.sent

    def _show(self, glimpse: Glimpse) -> None:
        self.raw.set_source(glimpse.raw)
        if glimpse.difference is not None:
            self.difference.set_source(glimpse.difference)
        if glimpse.depth is None or glimpse.surface is None:
            return
        self.depth.set_source(glimpse.depth)
        if glimpse.followed is not None:
            self._update_pose(glimpse.followed)
        self.deepest.set_text(f"{glimpse.deepest_mm:.2f}")
        self.area.set_text(f"{glimpse.contact_mm2:.1f}")
        self.scale.set_text(f"{glimpse.scale_mm:.2f} mm")
        if time.monotonic() - self.surface_s > SURFACE_S:
            self.surface_s = time.monotonic()
            self._update_surface(*glimpse.surface)
            history = [x for x in self.watcher.history if self.surface_s - x[0] < HISTORY_S]
            self.deepest_line.show([(t, mm) for t, mm, _ in history])
            self.area_line.show([(t, mm2) for t, _, mm2 in history])

    def _update_pose(self, followed: Followed) -> None:
        self.posed.set_source(followed.picture)
        self.pose.set_text(followed.pose)
        self.markers.set_text(followed.markers)
        self.pose_state.set_text(followed.state)
        here = followed.state == "tracking"
        _switch(self.pose_state, "on", here)
        _switch(self.pose_state, "off", not here)

    def _update_surface(self, url: str, grid: pictures.Grid) -> None:
        if self.texture is None:
            with self.scene:
                self.texture = self.scene.texture(url, grid)
            return
        self.texture.set_coordinates(grid)
        self.texture.set_url(url)

    def _update_facts(self) -> None:
        watcher, newest, glimpse = self.watcher, self.watcher.newest, self.watcher.glimpse
        rate_hz, latency = (watcher.rate_hz, watcher.latency_ms) if watcher.live else (0.0, None)
        self.facts["rate"].set_text(f"{rate_hz:.1f} frames/s")
        self.facts["latency"].set_text(
            "latency unknown" if latency is None else f"latency {latency:.1f} ms"
        )
        now_s = time.monotonic()
        if self.seen is not None and now_s - self.age_s > AGE_S:
            self.age_s = now_s
            self.facts["age"].set_text(f"picture {now_s - self.seen.taken_s:.1f} s old")
        if newest is None:
            return
        counts = newest.source.counts
        if glimpse is not None and glimpse.depth is not None:
            self.facts["work"].set_text(f"depth in {glimpse.work_ms:.1f} ms")
        self.facts["lost"].set_text(f"{counts.dropped} dropped, {counts.corrupt} corrupt")
        self.facts["connections"].set_text(
            f"{counts.connections} connection{'s' if counts.connections != 1 else ''}"
        )

    def take_background(self) -> None:
        """Make the next frames the blank one, or say why not."""
        try:
            self.watcher.take_background()
        except WedgeError as error:
            ui.notify(str(error), type="negative", position="bottom-right")
        else:
            ui.notify("Taking the background: nothing may touch the gel.", position="bottom-right")

    def save_frame(self) -> None:
        """Keep the newest frame, or say why not."""
        try:
            ui.notify(self.watcher.save_frame(), type="positive", position="bottom-right")
        except (WedgeError, OSError) as error:
            ui.notify(str(error), type="negative", position="bottom-right")


def _heading(text: str, level: int) -> ui.label:
    return ui.label(text).props(f"role=heading aria-level={level}")


def _button(text: str, icon: str, meaning: str, on_click: Callable[[], None]) -> ui.button:
    made = ui.button(text, icon=icon, on_click=on_click).props("dense outline color=teal-3 no-caps")
    with made:
        ui.tooltip(meaning).props('anchor="top middle" self="bottom middle"')  # hides no neighbour
    return made


def _switch(element: ui.element, name: str, is_on: bool) -> None:
    """Give an element a class, or take it away."""
    element.classes(add=name if is_on else None, remove=None if is_on else name)


def _picture(title: str, caption: str, name: str) -> ui.interactive_image:
    with ui.column().classes("gap-1 w-full"):
        _heading(title, 3).classes("text-sm font-medium")
        with ui.element("div").classes("picture w-full"):
            image = ui.interactive_image().classes(f"shown w-full {name}")
            image.props(f'role=img aria-label="{title}: {caption}"')
        ui.label(caption).classes("quiet text-xs")
    return image


def _figure(title: str, unit: str, digits: int, name: str) -> tuple[ui.label, Course]:
    with ui.column().classes("gap-0 w-full"):
        _heading(title, 3).classes("text-sm font-medium")
        with ui.row().classes("items-baseline gap-1"):
            number = ui.label("–").classes(f"big {name}")
            ui.label(unit).classes("quiet")
        course = Course(unit, digits, name)
    return number, course
