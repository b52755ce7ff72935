# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Numbers and words as files hold them: text that is valid UTF-8, and JSON."""

import json
import math
from typing import Any


def text_bytes(text: str) -> bytes:
    r"""Text as a file holds it.

    A file's name may have bytes that are not UTF-8. Of these 0xFF is written as Python has it in
    text, ``\udcff``, which JSON reads back.
    """
    return text.encode(errors="backslashreplace")


def json_bytes(document: Any) -> bytes:
    """A document as a JSON file holds it; what is no finite number becomes null."""
    text = json.dumps(_finite(document), indent=2, ensure_ascii=False, allow_nan=False)
    return text_bytes(f"{text}\n")


def _finite(value: Any) -> Any:
    """The same with ``None`` for Infinity and NaN, which JSON does not have."""
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
