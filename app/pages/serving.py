# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""How every page is served."""

import logging

from nicegui import app, ui

from app.pages.visitors import OwnVisitors, own_names

FOCUS = """@layer overrides {
    .q-btn:focus-visible { outline: 3px solid currentColor !important; outline-offset: 2px; }
    .q-btn.bg-primary:focus-visible { outline-color: var(--q-primary) !important; }
}"""
"""Around the button that Tab has reached: Quasar's own mark, in a later layer, is hardly seen."""
LARGEST_HEAD = 1 << 16
"""Bytes of a request's head; browsers send a few thousand."""


def run(title: str, address: str, port: int, *, favicon: str | None = None, show: bool) -> None:
    """Serve the pages that were declared, until Ctrl-C."""
    logging.getLogger("uvicorn.error").addFilter(is_news)
    ui.add_css(FOCUS, shared=True)
    app.add_middleware(OwnVisitors, names=own_names(address))
    ui.run(
        host=address,
        port=port,
        title=title,
        favicon=favicon,
        language="en-US",
        show=show,
        reload=False,
        show_welcome_message=False,
        http="h11",  # the other parser knows no limit
        h11_max_incomplete_event_size=LARGEST_HEAD,
    )


def is_news(record: logging.LogRecord) -> bool:
    """Whether a line of the server's log tells more than that a browser hung up.

    Where one does before its request was read, engineio misses the request's method, and the server
    would print a page of traceback about a tab that is gone or connects again by itself.
    """
    error = record.exc_info[1] if record.exc_info else None
    return not (isinstance(error, KeyError) and error.args == ("REQUEST_METHOD",))
