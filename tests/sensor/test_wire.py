# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""What is sent is what is read, and what others send is read or not said."""

import email.parser

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sensor.wire import BOUNDARY, DELIMITER, NS_PER_S, Stamp, part, part_head, read_stamp

WHOLE = st.none() | st.integers(0, 10**18 - 1)
TIME = st.none() | st.integers(1, 10**10 * NS_PER_S - 1)
STAMPS = st.builds(Stamp, TIME, WHOLE, WHOLE)


def headers(head: bytes) -> dict[str, str]:
    """As an e-mail parser reads them, which is none of ours."""
    message = email.parser.BytesHeaderParser().parsebytes(head)
    return {name.lower(): value for name, value in message.items()}


@given(STAMPS)
def test_a_stamp_survives_the_wire(stamp: Stamp) -> None:
    assert read_stamp(headers(part_head(10, stamp))) == stamp


@given(st.lists(st.binary(max_size=200), min_size=1, max_size=5), STAMPS)
def test_a_multipart_parser_finds_the_parts(bodies: list[bytes], stamp: Stamp) -> None:
    stream = DELIMITER + b"".join(part(body, stamp) for body in bodies)
    for body in bodies:
        before, _, stream = stream.partition(DELIMITER)
        assert before == b""
        head, _, rest = stream.partition(b"\r\n\r\n")
        length = int(headers(head + b"\r\n\r\n")["content-length"])
        assert length == len(body)
        assert rest[:length] == body
        assert rest[length:].startswith(b"\r\n--" + BOUNDARY.encode())
        stream = rest[length + 2 :]
    assert stream == DELIMITER


@pytest.mark.parametrize(
    "text",
    ["0.000000", "0", "-1", "", "1e9", "nan", "1.2.3", "9" * 40, "1.0123456789", "٣.1", " 5"],
)
def test_a_time_that_is_none_is_not_said(text: str) -> None:
    assert read_stamp({"x-timestamp": text}) == Stamp()


@pytest.mark.parametrize("text", ["-1", "1.0", "", "0x10", "9" * 40, "²"])
def test_a_count_that_is_none_is_not_said(text: str) -> None:
    assert read_stamp({"x-frame-index": text, "x-sensor-timestamp": text}) == Stamp()


def test_a_servers_microseconds_are_read() -> None:
    stamp = read_stamp({"x-timestamp": "1800000000.250000"})
    assert stamp.timestamp_ns == 1_800_000_000_250_000_000
    assert stamp.clock_is_set


def test_a_clock_that_counts_from_1970_is_not_set() -> None:
    assert not read_stamp({"x-timestamp": "300.0"}).clock_is_set
    assert not Stamp().clock_is_set
