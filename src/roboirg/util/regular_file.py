"""Read a file that others may have put there: a regular one, and not too large."""

from __future__ import annotations

import hashlib
import os
import stat
from io import BufferedReader
from pathlib import Path

from roboirg.core.errors import InvalidValueError

MOST_BYTES = 1 << 30
"""Of a file of which no lower limit is known."""
_BUFFER = 1 << 20
"""Bytes that are read at once."""


def open_regular(path: Path) -> BufferedReader:
    """Open a file for reading; a pipe or a device, which could block for ever, is refused.

    Raises:
        InvalidValueError: it is no regular file.
        OSError: it cannot be opened.
    """
    # Not blocking, so that a pipe without a writer is opened and then refused.
    file = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    if not stat.S_ISREG(os.fstat(file).st_mode):
        os.close(file)
        raise InvalidValueError(f"{path} is not a regular file.")
    return BufferedReader(os.fdopen(file, "rb", buffering=0), _BUFFER)


def read_regular(path: Path, most: int = MOST_BYTES) -> bytes:
    """Return the content of a file of at most `most` bytes.

    Raises:
        InvalidValueError: it is no regular file, or larger.
        OSError: it cannot be read.
    """
    with open_regular(path) as file:
        content = file.read(most + 1)
    if len(content) > most:
        raise InvalidValueError(f"{path} has more than {most:,} bytes; no such file is that large.")
    return content


def file_hash(path: Path) -> str:
    """Return the SHA-256 of a file, in hexadecimal.

    Raises:
        InvalidValueError: it is no regular file.
        OSError: it cannot be read.
    """
    with open_regular(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
