"""Keep freed memory for the next arrays instead of giving it back to the system, to ask for it again page by page."""

from __future__ import annotations

import contextlib
import ctypes
import sys

TRIM_THRESHOLD, MMAP_THRESHOLD = -1, -3
"""Names of glibc's mallopt parameters."""
KEPT = 64 << 20
"""Bytes: more than the largest array of a chunk, so that each chunk gets the pages of the one before it."""


def keep_chunks() -> None:
    """Tell glibc's allocator to keep blocks of the size of a chunk or an image. Does nothing elsewhere."""
    if not sys.platform.startswith("linux"):
        return
    with contextlib.suppress(OSError, AttributeError):
        mallopt = ctypes.CDLL(None).mallopt
        mallopt(MMAP_THRESHOLD, KEPT)
        mallopt(TRIM_THRESHOLD, KEPT)
