# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""A page answers its own browsers, and no website that has its name lead here."""

import http.client
import socket
from collections.abc import Iterator
from urllib.parse import urlsplit

import pytest

from app.pages.serving import LARGEST_HEAD
from tests.app.served import served, until_it_answers
from tests.synthetic import make_dataset

SOCKET = "/_nicegui_ws/socket.io/?EIO=4&transport=websocket&client_id=x&document_id=x&tab_id=x"


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """HOST:PORT of a page that edits a dataset."""
    folder = tmp_path_factory.mktemp("visited") / "set"
    make_dataset(folder, presses=3)
    with served("label", folder) as address:
        until_it_answers(address)
        yield urlsplit(address).netloc


def status(place: str, path: str, **head: str) -> int:
    """Of the answer to a request with these lines in its head."""
    connection = http.client.HTTPConnection(place)
    connection.putrequest("GET", path, skip_host=True)
    for name, value in head.items():
        connection.putheader(name.replace("_", "-"), value)
    connection.endheaders()
    found = connection.getresponse().status
    connection.close()
    return found


def upgraded(place: str, **head: str) -> int:
    return status(
        place,
        SOCKET,
        Upgrade="websocket",
        Connection="Upgrade",
        Sec_WebSocket_Version="13",
        Sec_WebSocket_Key="dGhlIHNhbXBsZSBub25jZQ==",
        **head,
    )


def test_its_own_names_are_answered(place: str) -> None:
    port = place.partition(":")[2]
    for name in (
        "127.0.0.1",
        "localhost",
        "LOCALHOST",
        "[::1]",
        "192.168.1.7",
        socket.gethostname(),
    ):
        own = f"{name}:{port}"
        assert status(place, "/", Host=own) == 200
        assert status(place, "/", Host=own, Origin=f"http://{own}") == 200
        assert upgraded(place, Host=own, Origin=f"http://{own}") == 101


def test_no_other_website_may_show_it_within_its_own(place: str) -> None:
    connection = http.client.HTTPConnection(place)
    connection.request("GET", "/")
    head = connection.getresponse().headers
    connection.close()
    assert head["Content-Security-Policy"] == "frame-ancestors 'self'"


@pytest.mark.parametrize(
    ("host", "origin"),
    [
        ("evil.example.com:{}", None),
        ("evil.example.com:{}", "http://evil.example.com:{}"),
        ("127.0.0.1.evil.example.com:{}", None),
        ("127.0.0.1:{}", "http://evil.example.com"),
        ("127.0.0.1:{}", "http://127.0.0.1:1"),
        ("127.0.0.1:{}", "null"),
        ("localhost@evil.example.com", None),
        ("[evil", None),
        ("", None),
    ],
)
def test_other_websites_are_refused(place: str, host: str, origin: str | None) -> None:
    port = place.partition(":")[2]
    head = {"Host": host.format(port)} | ({"Origin": origin.format(port)} if origin else {})
    for path in ("/", "/_nicegui_ws/socket.io/?EIO=4&transport=polling"):
        assert status(place, path, **head) == 403
    assert upgraded(place, **head) == 403


def test_a_head_without_an_end_is_cut_off(place: str) -> None:
    name, _, port = place.partition(":")
    with socket.create_connection((name, int(port))) as connection:
        connection.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\n")
        with pytest.raises(OSError):
            for _ in range(100):
                connection.sendall(b"X-n: " + b"n" * (LARGEST_HEAD - 7) + b"\r\n")
    assert status(place, "/", Host=place) == 200
