# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Frames out of a multipart stream that may be damaged anywhere.

A part ends where its JPEG does or where the next delimiter begins, whichever comes first. What a
Content-Length says does not end it: it may be missing or wrong, and a JPEG knows its own end. But
bytes that are missing inside a JPEG show by nothing else, so where the lengths of a stream have
been right, one that is wrong is a damaged part's.
"""

import re
from collections.abc import Callable, Iterator

from recon.stream.jpeg import END, NotJpegError, scan_start

LARGEST_PART = 4 << 20
"""Bytes; a 2592x1944 frame of the Pi's camera has less than half of that."""
LARGEST_HEAD = 16 << 10
CHUNK = 64 << 10
ENOUGH = 8
"""Right lengths after which the next ones are believed, until so many in a row are wrong."""

Part = tuple[bytes, dict[str, str]]
"""A whole JPEG, and its header lines by lower-case name."""

_BLANK_LINE = re.compile(rb"\r?\n\r?\n")


class MultipartReader:
    """Gives the whole JPEGs of a multipart stream and counts the damaged parts.

    At most ``LARGEST_PART`` bytes and a chunk are kept.
    """

    def __init__(self, read: Callable[[int], bytes], boundary: str) -> None:
        """Prepare to read.

        Args:
            read: gives what has come, at most so many bytes; none where the stream ends.
            boundary: as the Content-Type names it.
        """
        self.corrupt = 0
        self.cut = False
        """Whether the stream ended, or failed, amid a part; such a part is not in `corrupt`."""
        self._read = read
        self._delimiter = b"--" + boundary.lstrip("-").encode("latin-1")
        self._kept = bytearray()
        self._right = self._wrong = 0
        """Lengths that were right, and those in a row that are not."""

    def __iter__(self) -> Iterator[Part]:
        """Give part after part until the stream ends."""
        try:
            while True:
                self._skip_delimiter()
                head = self._head()
                jpeg = self._jpeg() if head is not None else None
                if jpeg is None or head is None or self._mutilated(len(jpeg), head):
                    self.corrupt += 1
                else:
                    yield jpeg, head
        except EOFError:
            return

    def _more(self) -> None:
        data = self._read(CHUNK)
        if not data:
            raise EOFError
        self._kept += data

    def _more_of_part(self) -> None:
        self.cut = True
        self._more()
        self.cut = False

    def _skip_delimiter(self) -> None:
        kept, delimiter = self._kept, self._delimiter
        while (found := kept.find(delimiter)) < 0:
            del kept[: -len(delimiter)]
            self._more()
        del kept[: found + len(delimiter)]

    def _head(self) -> dict[str, str] | None:
        """The header lines after a delimiter; ``None`` where they never end."""
        kept = self._kept
        while not (blank := _BLANK_LINE.search(kept, 0, LARGEST_HEAD)):
            if len(kept) >= LARGEST_HEAD:
                return None
            self._more()
        # A head that broke off has swallowed the next part's delimiter.
        begin = kept.rfind(self._delimiter, 0, blank.start())
        if begin >= 0:
            self.corrupt += 1
            begin += len(self._delimiter)
        text = kept[max(begin, 0) : blank.start()].decode("latin-1")
        del kept[: blank.end()]
        pairs = (line.partition(":") for line in text.splitlines())
        return {name.strip().lower(): value.strip() for name, colon, value in pairs if colon}

    def _jpeg(self) -> bytes | None:
        """The JPEG at the beginning of what is kept; ``None`` where the part is damaged."""
        kept, delimiter = self._kept, self._delimiter
        while not kept or kept[0] in b"\r\n":  # some servers send one empty line too many
            del kept[:1]
            if not kept:
                self._more()
        coded, seen = None, 0
        while True:
            limit = kept.find(delimiter, max(0, seen - len(delimiter)))
            try:
                coded = scan_start(kept) if coded is None else coded
            except NotJpegError:
                return None
            if coded is not None:
                end = kept.find(END, max(coded, seen - 1), limit if limit >= 0 else len(kept))
                if end >= 0:
                    jpeg = bytes(memoryview(kept)[: end + 2])
                    del kept[: end + 2]
                    return jpeg
            if limit >= 0 or len(kept) > LARGEST_PART:
                return None
            seen = len(kept)
            self._more_of_part()

    def _mutilated(self, length: int, head: dict[str, str]) -> bool:
        """Whether the JPEG just read has another length than its head says and is to be believed.

        Behind it padding may follow, which servers count; a part is over at the next delimiter.
        """
        told = head.get("content-length", "")
        if not told.isdecimal():
            return False
        believed = self._right >= ENOUGH
        if told == str(length) or (believed and not self._is_over()):
            self._right, self._wrong = self._right + 1, 0
            return False
        self._wrong += 1
        if self._wrong == ENOUGH:
            self._right = 0
        return believed

    def _is_over(self) -> bool:
        """Whether the next delimiter is the first thing kept, but for an end of line."""
        kept, delimiter = self._kept, self._delimiter
        most = len(delimiter) + 2
        while len(kept) < most and delimiter.startswith(bytes(kept).lstrip(b"\r\n")):
            self._more_of_part()
        return bytes(kept[:most]).lstrip(b"\r\n").startswith(delimiter)
