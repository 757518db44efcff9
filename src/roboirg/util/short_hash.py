"""Fingerprints of content, short enough to be read."""

from __future__ import annotations

import hashlib

DIGITS = 12
"""Hexadecimal digits: two of a million contents agree with a probability of 0.2 %."""


def short_hash(content: str | bytes) -> str:
    """Return the first digits of the SHA-256 of a text (as UTF-8) or of bytes."""
    data = content.encode() if isinstance(content, str) else content
    return hashlib.sha256(data).hexdigest()[:DIGITS]
