# SPDX-FileCopyrightText: 2026 GelSight Wedge contributors
# SPDX-License-Identifier: Apache-2.0
"""Arrays that every frame passes, in large pages of memory.

Most passes over a frame wait for memory, and for where its pages are: of 4 kB each, they are more
than a processor keeps in mind.
"""

import numpy as np

PAGE_BYTES = 2**21
"""Of a large page, on x86 and most of ARM."""
LEAST_BYTES = 2**20
"""Smaller arrays would waste more memory than they gain time."""


def in_large_pages(values: np.ndarray) -> np.ndarray:
    """A copy that lies in large pages, where the system has some; as it is if it is small.

    numpy asks the system for large pages for arrays of 4 MB and more, and it gives whole ones: so
    a page is left before the copy and one behind it. Copies begin anywhere in a page, as all at the
    same place of theirs would drive each other out of the cache.
    """
    if values.nbytes < LEAST_BYTES:
        return values
    block = np.empty(values.nbytes + 2 * PAGE_BYTES, np.uint8)
    copy = block[PAGE_BYTES:-PAGE_BYTES].view(values.dtype).reshape(values.shape)
    copy[...] = values
    return copy
