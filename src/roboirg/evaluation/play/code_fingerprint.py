"""Fingerprint of the installed package, for the records."""

from __future__ import annotations

import functools
import hashlib
from pathlib import Path

from roboirg.util.short_hash import DIGITS


@functools.cache
def code_fingerprint() -> str:
    """Return a shortened SHA-256 of the names and bytes of the package's Python files."""
    digest = hashlib.sha256()
    root = Path(__file__).parents[2]
    for path in sorted(root.rglob("*.py")):
        digest.update(f"{path.relative_to(root).as_posix()}\0".encode())
        digest.update(path.read_bytes() + b"\0")
    return digest.hexdigest()[:DIGITS]
