"""What reading an archive of others can raise."""

from __future__ import annotations

import lzma
import struct
import zipfile
import zlib

UNREADABLE_ARCHIVE = (
    ArithmeticError, EOFError, KeyError, MemoryError, OSError, RuntimeError, SyntaxError, TypeError,
    ValueError, lzma.LZMAError, struct.error, zipfile.BadZipFile, zlib.error,
)  # fmt: skip
"""Raised by `zipfile` and NumPy for content that is damaged, encrypted or odd."""
