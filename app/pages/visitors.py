# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Whose requests a page answers: those of its own browsers, not those of other websites."""

import ipaddress
import socket
from collections.abc import Awaitable, Callable, Collection, MutableMapping
from typing import Any
from urllib.parse import urlsplit

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]

UNFRAMED = (b"content-security-policy", b"frame-ancestors 'self'")
"""No other website shows the page within its own, where a click would be meant for that one."""
REFUSED = (
    "This page answers to its computer's own name and addresses only, and to no other website: "
    "open it by its IP address.\n"
)


class OwnVisitors:
    """Refuses what a browser asks for under another computer's name, or for another website.

    A website may have its own name lead to this computer (DNS rebinding): what it asks then passes
    for its own page, and it could press every button. An address in figures leads nowhere else.
    """

    def __init__(self, app: Callable[..., Awaitable[None]], names: Collection[str]) -> None:
        """Wrap an ASGI application, whose computer has these names."""
        self._app, self._names = app, frozenset(names)

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Pass a request on, or answer it by a refusal."""
        if scope["type"] in ("http", "websocket") and not self._is_own(scope):
            if scope["type"] == "websocket":  # not accepted: the browser sees a status of 403
                await send({"type": "websocket.close", "code": 1008})
                return
            head = [(b"content-type", b"text/plain; charset=utf-8")]
            await send({"type": "http.response.start", "status": 403, "headers": head})
            await send({"type": "http.response.body", "body": REFUSED.encode()})
            return

        async def unframed(message: Message) -> None:
            if message["type"] == "http.response.start":
                message = {**message, "headers": [*message.get("headers", ()), UNFRAMED]}
            await send(message)

        await self._app(scope, receive, unframed)

    def _is_own(self, scope: Message) -> bool:
        head = {key: value.decode("latin-1").lower() for key, value in scope["headers"]}
        host, origin = head.get(b"host", ""), head.get(b"origin")
        try:
            name = (urlsplit(f"//{host}").hostname or "").removesuffix(".")
            from_here = origin is None or urlsplit(origin).netloc == host
        except ValueError:
            return False
        return from_here and (name in self._names or _is_address(name))


def own_names(address: str) -> set[str]:
    """What this computer is called, where it listens at an address or a name."""
    name = socket.gethostname().lower()
    short = name.partition(".")[0]
    return {"localhost", name, short, f"{short}.local", address.lower()} - {""}


def _is_address(text: str) -> bool:
    try:
        ipaddress.ip_address(text)
    except ValueError:
        return False
    return True
