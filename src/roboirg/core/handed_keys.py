"""Keys and passwords that servers and models get, and their removal from what these send back.

A server may send its client's key back by mistake: in an error message, in metadata, in the reason
for which it closes a connection. What comes from outside passes `without_keys` before it is kept or
shown. That finds a whole key as it is, percent-encoded, escaped as in JSON, and encoded in Base64.
It cannot find a key that a server cuts into pieces or writes otherwise.
"""

from __future__ import annotations

import base64
import json
from urllib.parse import quote

LEAST_LETTERS = 6
"""A shorter text, such as ``none``, is no secret, and may be a word of an answer."""

_spellings: set[str] = set()
"""Of all keys that this process hands to others."""


def remember_key(key: str | None) -> None:
    """Remember a key or a password, so that `without_keys` removes it; None is none."""
    key = (key or "").strip()
    if len(key) >= LEAST_LETTERS:
        encoded = base64.b64encode(key.encode()).decode()
        whole_blocks = encoded[: len(key) // 3 * 4]  # what follows the key may change the rest
        _spellings.update([key, quote(key, safe=""), json.dumps(key)[1:-1], whole_blocks])


def without_keys(text: str) -> str:
    """Return a text with an asterisk for each letter of a key."""
    for spelling in sorted(_spellings, key=len, reverse=True):
        text = text.replace(spelling, "*" * len(spelling))
    return text


def bytes_without_keys(data: bytes) -> bytes:
    """Return data with an asterisk for each byte of a key, so that messages keep their lengths."""
    return without_keys(data.decode("latin-1")).encode("latin-1") if _spellings else data
