"""Text from outside, made fit for records, pages and terminals."""

from __future__ import annotations


def clip_text(text: str, limit: int) -> str:
    """Return at most `limit` characters of a text; lone surrogates become question marks."""
    return text[:limit].encode("utf-8", "replace").decode()


def is_encodable(text: str) -> bool:
    """Return whether a text can be written to a file: it has no lone surrogates."""
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True
