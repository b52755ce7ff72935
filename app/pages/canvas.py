# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A picture to draw on by mouse, pen or finger, as the pages that edit a dataset show it."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

from nicegui import ui
from nicegui.events import GenericEventArguments

DRAWN, HALO = "#111111", "#ffffff"
STROKES = ((HALO, 3), (DRAWN, 1.2))
"""Of a line and the halo below it: colours, and widths in pixels of the screen."""
GRIP_PX = 24
"""A finger takes hold of what is drawn within this distance of its middle, in pixels of the screen,
or within one and a half of its radii."""
STYLE = """
.canvas { user-select: none; -webkit-user-select: none; }
.grips { position: absolute; inset: 0; overflow: hidden; pointer-events: none; }
.grip { position: absolute; aspect-ratio: 1; border-radius: 50%; transform: translate(-50%, -50%);
    pointer-events: auto; touch-action: pinch-zoom; }
"""
"""On a grip one finger draws, and two are the browser's. It would itself drag what is selected."""
DOWN = "pointerdown"
MOVE = "pointermove"
DRAG_ENDS = ("pointerup", "pointerleave")
DRAG_IS_NONE = "pointercancel"
"""The finger makes a gesture of the browser's, such as a pinch."""
POINTED = """(e) => {
    const picture = e.currentTarget, isDown = e.type == "pointerdown";
    if (isDown && e.button) return;
    const misses = picture.querySelector(".grip") && !e.target.closest(".grip");
    const kind = isDown && e.pointerType == "touch" && misses ? "pointercancel" : e.type;
    const {left, top, width, height} = picture.getBoundingClientRect();
    emit(kind, e.pointerId, (e.clientX - left) / width, (e.clientY - top) / height);
}"""
"""A finger that swipes over the picture scrolls, and drags nothing. One that comes down beside what
another drags ends that: it begins a pinch, or is a palm."""

Place = tuple[float, float]


class Draggable(Protocol):
    """What a page draws and lets somebody drag; places in pixels, the first one at (0, 0)."""

    def take(self, place_px: Place) -> Place | None:
        """Choose what is dragged from a place: where that lies, ``None`` where nothing is."""

    def drag(self, place_px: Place) -> None:
        """Show it elsewhere."""

    def drop(self) -> None:
        """Keep it where it was dragged to."""

    def put_back(self) -> None:
        """Show it where it was."""


@dataclass(frozen=True)
class _Grip:
    """Who holds what is drawn, and how far beside its place: it does not jump to a pointer."""

    pointer: int
    beside_px: Place


class Canvas:
    """The picture, and over it what is drawn: that changes without the picture being sent anew.

    ``add_layer`` would have the browser send each picture back, and complain of a large one.
    """

    def __init__(
        self,
        name: str,
        meaning: str,
        size_px: tuple[int, int],
        drawn: Draggable,
    ) -> None:
        """Lay it out, empty.

        Args:
            name: its id in the page.
            meaning: what it shows, for screen readers.
            size_px: width and height.
            drawn: told of what a pointer does, but of what is the browser's.
        """
        self._size_px, self._dragged = size_px, drawn
        self._grip: _Grip | None = None
        ui.add_css(STYLE)
        self.picture = _layer(size_px).classes("canvas")
        self.picture.props(f'id={name} draggable=false role=img aria-label="{meaning}"')
        for kind in (DOWN, MOVE, *DRAG_ENDS, DRAG_IS_NONE):
            self.picture.on(kind, self._on_pointer, js_handler=POINTED)
        with self.picture:
            self._drawn = _layer(size_px).classes("nicegui-interactive-image-layer")
            self._grips = ui.html(sanitize=False).classes("grips")

    @property
    def is_held(self) -> bool:
        """Whether somebody drags what is drawn."""
        return self._grip is not None

    def let_go(self) -> None:
        """Drag nothing any more: something else is drawn."""
        self._grip = None

    def _on_pointer(self, event: GenericEventArguments) -> None:
        kind, number, across, down = event.args
        (width, height), grip = self._size_px, self._grip
        x, y = across * width - 0.5, down * height - 0.5
        if grip is None:
            if kind == DOWN and (there := self._dragged.take((x, y))) is not None:
                self._grip = _Grip(number, (x - there[0], y - there[1]))
        elif kind in (DOWN, DRAG_IS_NONE):  # a second finger may be a pinch, or a palm
            self._grip = None
            self._dragged.put_back()
        elif number == grip.pointer and kind == MOVE:
            self._dragged.drag((x - grip.beside_px[0], y - grip.beside_px[1]))
        elif number == grip.pointer:
            self._grip = None
            self._dragged.drop()

    def draw(self, svg: str, grips: Iterable[tuple[Place, float]], *, held: bool = False) -> None:
        """Show this alone.

        Args:
            svg: over the picture's pixels.
            grips: the places of what can be held, and its radius, in pixels.
            held: somebody holds it. A finger's grip then stays, as browsers tell no more of a
                finger on what is gone.
        """
        self._drawn.set_content(svg)
        if not held:
            self._grips.set_content("".join(_grip(*grip, self._size_px) for grip in grips))


def _layer(size_px: tuple[int, int]) -> ui.interactive_image:
    return ui.interactive_image(size=size_px, events=[], sanitize=False)


def _grip(place_px: Place, radius_px: float, size_px: tuple[int, int]) -> str:
    (x, y), (width, height) = place_px, size_px
    left, top, wide = (x + 0.5) / width, (y + 0.5) / height, 3 * radius_px / width
    return (
        f'<div class="grip" style="left: {left:.4%}; top: {top:.4%};'
        f' width: max({2 * GRIP_PX}px, {wide:.4%})"></div>'
    )
