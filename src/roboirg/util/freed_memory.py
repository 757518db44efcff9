"""Reuse of freed memory, and when Python looks for unused objects."""

from __future__ import annotations

import contextlib
import ctypes
import gc
import sys
from collections.abc import Iterator
from typing import Final

_MMAP_THRESHOLD: Final = -3
_TRIM_THRESHOLD: Final = -1
_LARGEST_BLOCK = 8 * 2**20
_MOST_KEPT = 32 * 2**20


def keep_freed_memory() -> None:
    """Let this process reuse freed memory instead of returning it to the system at once.

    Pictures are made and freed all the time, and new pages cost ten times as much as a copy of
    what is on them. Blocks of 8 MiB or more, and what exceeds 32 MiB, are returned as before. Does
    nothing where the C library is not glibc.
    """
    if sys.platform == "win32":
        return
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(_MMAP_THRESHOLD, _LARGEST_BLOCK)
        mallopt(_TRIM_THRESHOLD, _MOST_KEPT)


@contextlib.contextmanager
def paused_collection() -> Iterator[None]:
    """Do not look for cycles of unused objects within the block or the decorated function.

    For code that makes very many objects and no cycles: each search visits all of them.
    """
    is_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if is_enabled:
            gc.enable()
