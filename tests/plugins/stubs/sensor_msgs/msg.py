# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Messages with the fields and the strictness of those that ROS 2 generates for Python."""

from array import array


class _Message:
    KINDS: dict = {}  # noqa: RUF012

    def __init__(self) -> None:
        for name, kind in self.KINDS.items():
            super().__setattr__(name, kind() if kind is not array else array("B"))

    def __setattr__(self, name, value) -> None:
        kind = self.KINDS[name]  # another name is an error, as with ROS's slots
        assert isinstance(value, kind), (name, value)
        if kind is int:
            assert -(2**31) <= value < 2**32
        super().__setattr__(name, value)


class _Time(_Message):
    KINDS = {"sec": int, "nanosec": int}  # noqa: RUF012


class _Header(_Message):
    KINDS = {"stamp": _Time, "frame_id": str}  # noqa: RUF012


class CompressedImage(_Message):
    KINDS = {"header": _Header, "format": str, "data": array}  # noqa: RUF012


class Image(_Message):
    KINDS = {  # noqa: RUF012
        "header": _Header,
        "height": int,
        "width": int,
        "encoding": str,
        "is_bigendian": int,
        "step": int,
        "data": array,
    }
