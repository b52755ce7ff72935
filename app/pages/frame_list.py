# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""The list of a dataset's frames in the page of `wedge label`, quick with thousands of them."""

import json
from collections.abc import Callable, Collection, Sequence
from html import escape

from nicegui import ui
from nicegui.events import GenericEventArguments

STYLE = """
.frame { display: flex; align-items: center; gap: .5rem; padding: 0 .5rem; cursor: pointer;
    height: 2rem; content-visibility: auto; }
.frame[aria-selected=true] { background: #dbeafe; }
.frame .name { flex: 1; min-width: 0; overflow: hidden; white-space: nowrap;
    text-overflow: ellipsis; }
.frame .material-icons { font-size: 1.25rem; }
.frame > * { pointer-events: none; }
"""
"""A pointer meets the row itself: what is in it may be written anew within a click."""
STEPPED = """(e) => {
    if (e.key != "ArrowUp" && e.key != "ArrowDown") return;
    e.preventDefault();
    e.stopPropagation();
    emit(e.key == "ArrowUp" ? -1 : 1);
}"""
"""In the list that Tab has reached these keys choose its rows, elsewhere they are the page's."""
KEPT = """(e) => { if (e.target.closest("[data-row]")) e.preventDefault(); }"""
"""A click gives the list no focus: keys stay the page's."""
CLICKED = """(e) => {
    const row = e.target.closest("[data-row]");
    if (row) emit(Number(row.dataset.row));
}"""
MARK = """for (const [row, chosen, inside] of %s) {
    const element = document.getElementById("frame-" + row);
    element.innerHTML = inside;
    element.setAttribute("aria-selected", chosen);
    if (!chosen) continue;
    const list = element.parentElement;
    list.setAttribute("aria-activedescendant", element.id);
    const seen = list.getBoundingClientRect();
    const at = element.getBoundingClientRect();
    list.scrollTop += Math.min(0, at.top - seen.top) + Math.max(0, at.bottom - seen.bottom);
}"""
"""Scrolls the list alone, where scrollIntoView would move the page too."""


class FrameList:
    """One row a frame. The rows are plain HTML, and a change touches none but its own."""

    def __init__(
        self,
        files: Sequence[str],
        standing: Callable[[str], tuple[str, str]],
        choose: Callable[[str], None],
    ) -> None:
        """Draw the list, its first row chosen.

        Args:
            files: the frames, in their order.
            standing: an icon and a word on a frame.
            choose: called with the frame that somebody clicks.
        """
        self.files, self.standing, self.choose = tuple(files), standing, choose
        self._rows = {file: row for row, file in enumerate(files)}
        self._chosen = 0
        ui.add_css(STYLE)
        rows = "".join(
            f'<div class="frame" id="frame-{row}" data-row="{row}" role="option"'
            f' aria-selected="{"false" if row else "true"}">{self._inside(row)}</div>'
            for row in range(len(self.files))
        )
        self.element = ui.html(rows, sanitize=False)
        self.element.props(
            'id=frames role=listbox tabindex=0 aria-label="Frames, the doubtful ones first"'
        )
        self.element.on("click", self._on_click, js_handler=CLICKED)
        self.element.on("mousedown", js_handler=KEPT)
        self.element.on("keydown", self._on_step, js_handler=STEPPED)

    def mark(self, file: str, others: Collection[str] = ()) -> None:
        """Choose a frame's row and say anew how it, the one before and some others stand."""
        before, self._chosen = self._chosen, self._rows[file]
        rows = {before, self._chosen, *(self._rows[x] for x in others if x in self._rows)}
        changed = [(row, row == self._chosen, self._inside(row)) for row in sorted(rows)]
        self.element.client.run_javascript(MARK % json.dumps(changed))

    def _inside(self, row: int) -> str:
        icon, words = self.standing(self.files[row])
        return (
            f'<i class="material-icons" aria-hidden="true">{icon}</i>'
            f'<span class="name">{escape(self.files[row])}</span><span>{escape(words)}</span>'
        )

    def _on_click(self, event: GenericEventArguments) -> None:
        row = event.args
        if isinstance(row, int) and 0 <= row < len(self.files):
            self.choose(self.files[row])

    def _on_step(self, event: GenericEventArguments) -> None:
        row = self._chosen + (1 if event.args == 1 else -1)
        if 0 <= row < len(self.files):
            self.choose(self.files[row])
