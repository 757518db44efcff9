"""Keys and passwords that servers and models get, and their removal from what these send back.

A server may send its client's key back by mistake: in an error message, in metadata, in the reason
for which it closes a connection. What comes from outside passes `without_keys` before it is kept or
shown. That finds a key as it is, with escapes of JSON or HTML, percent-encoded, and in Base64, also
within a longer text. It cannot find a key that a server cuts into pieces or writes otherwise.
"""

from __future__ import annotations

import base64
import html
import re

LEAST_LETTERS = 8
"""A shorter text, such as ``none`` or ``Bearer``, is no secret, and may be a word of an answer."""
_BREAK = r"(?>(?:\s|\\[nr])*)"
"""Between letters of Base64, which may be wrapped into lines."""

_spellings: set[re.Pattern[str]] = set()
"""Of all keys that this process hands to others."""


def remember_key(key: str | None) -> None:
    """Remember a key or a password, so that `without_keys` removes it; None is none.

    Of ``Bearer KEY`` the last word is one, too.
    """
    whole = (key or "").strip()
    for secret in {whole, *whole.split()[-1:]}:
        if len(secret) >= LEAST_LETTERS:
            letters = re.findall(r"\\+|[^\\]", secret)
            ways = ["".join(map(_letter_pattern, letters)), *_base64_patterns(secret.encode())]
            _spellings.add(re.compile("|".join(ways), re.IGNORECASE))


def _letter_pattern(letter: str) -> str:
    """Return the pattern of a letter as it is, or as software encodes or escapes it.

    Several backslashes are one letter, as each may be escaped again. No pattern can match in two
    ways, which would take for ever.
    """
    if letter[0] == "\\":
        count = len(letter)
        return rf"(?>(?:%5c|\\{{1,4}}u005c){{{count}}}|\\{{{count},{4 * count}}})"
    code = ord(letter)
    ways = [
        "".join(f"%{byte:02x}" for byte in letter.encode()),
        rf"\\{{1,4}}u{code:04x}",
        f"&#(?:0{{0,4}}{code}|x0{{0,4}}{code:x});",
        r"\\{0,4}" + re.escape(letter),
    ]
    named = html.escape(letter)
    if named != letter:
        ways.insert(0, re.escape(named))
    return f"(?>{'|'.join(ways)})"


def _base64_patterns(secret: bytes) -> list[str]:
    """Return the letters of Base64 that a secret decides, wherever in a text it begins."""
    found: list[str] = []
    for start in range(3):
        encoded = base64.b64encode(bytes(start) + secret).decode()
        first, end = -(-8 * start // 6), 8 * (start + len(secret)) // 6
        letters = [
            {"+": "[-+]", "/": r"\\?[/_]"}.get(letter, letter) for letter in encoded[first:end]
        ]
        found.append(_BREAK.join(letters) + "[A-Za-z0-9+/_-]?={0,2}")
    return found


def without_keys(text: str) -> str:
    """Return a text with an asterisk for each letter of a key."""
    longest_first = sorted(_spellings, key=lambda spelling: len(spelling.pattern), reverse=True)
    for spelling in longest_first:
        text = spelling.sub(lambda found: "*" * len(found[0]), text)
    return text


def bytes_without_keys(data: bytes) -> bytes:
    """Return data with an asterisk for each byte of a key, so that messages keep their lengths."""
    return without_keys(data.decode("latin-1")).encode("latin-1") if _spellings else data
