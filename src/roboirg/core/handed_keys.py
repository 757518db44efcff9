"""Keys and passwords that servers and models get, and their removal from what these send back.

A server may send its client's key back by mistake: in an error message, in metadata, in the reason
for which it closes a connection. What comes from outside passes `without_keys` before it is kept or
shown. That finds a key as it is, with escapes of JSON or HTML, percent-encoded, and in Base64, also
within a longer text. It cannot find a key that a server cuts into pieces or writes otherwise.
"""

from __future__ import annotations

import base64
import html
import math
import re

LEAST_LETTERS = 8
"""A shorter text, such as ``none`` or ``Bearer``, is no secret, and may be a word of an answer."""
_BREAK = r"(?>(?:\s|\\[nr])*)"
"""Between letters of Base64, which may be wrapped into lines."""

_BYTES_OF_GROUP = 3
_BITS_OF_BYTE = 8
_BITS_OF_LETTER = 6
"""Of Base64."""
_OTHER_SPELLINGS = {"+": "[-+]", "/": r"\\?[/_]"}
"""Letters of Base64 that are others in addresses, or escaped."""

_spellings: set[re.Pattern[str]] = set()
"""Of all keys that this process hands to others."""


def remember_key(key: str | None) -> None:
    """Remember a key or a password, so that `without_keys` removes it from texts from now on.

    None and texts under eight letters are no keys. Of ``"Bearer KEY"`` the last word alone is one,
    too.
    """
    if key is None or not key.strip():
        return
    whole = key.strip()
    last_word = whole.split()[-1]
    for secret in {whole, last_word}:
        if len(secret) < LEAST_LETTERS:
            continue
        letters = re.findall(r"\\+|[^\\]", secret)  # backslashes in a row are one
        in_letters = "".join(_letter_pattern(letter) for letter in letters)
        spellings = [in_letters, *_base64_patterns(secret.encode())]
        _spellings.add(re.compile("|".join(spellings), re.IGNORECASE))


def _letter_pattern(letter: str) -> str:
    """Return a regular expression for a letter as it is, or as software encodes or escapes it.

    ``"&"`` also matches ``%26``, ``&amp;``, ``&#38;`` and, escaped in JSON, ``u0026`` after a
    backslash. Several backslashes are one letter, as each may be escaped again. Atomic groups
    ``(?>…)`` keep a pattern from matching in two ways, which could take for ever.
    """
    if letter[0] == "\\":
        count = len(letter)
        return rf"(?>(?:%5c|\\{{1,4}}u005c){{{count}}}|\\{{{count},{4 * count}}})"
    code = ord(letter)
    percent_encoded = "".join(f"%{byte:02x}" for byte in letter.encode())
    ways = [
        percent_encoded,
        rf"\\{{1,4}}u{code:04x}",  # \u0041, escaped once or twice
        f"&#(?:0{{0,4}}{code}|x0{{0,4}}{code:x});",  # &#65; or &#x41;
        r"\\{0,4}" + re.escape(letter),
    ]
    html_name = html.escape(letter)
    if html_name != letter:
        ways.insert(0, re.escape(html_name))
    return f"(?>{'|'.join(ways)})"


def _base64_patterns(secret: bytes) -> list[str]:
    """Return regular expressions for a secret in Base64, wherever in a longer text it begins.

    Base64 writes three bytes (24 bits) as four letters of 6 bits, so there are three places to
    begin. Letters that hold bits of the bytes next to the secret, too, are not decided by it, and
    are left out. ``b"key"`` -> ``a2V5`` at the first place, ``tle`` at the second, ``rZX`` at the
    third.
    """
    patterns = []
    for start in range(_BYTES_OF_GROUP):
        bytes_before = bytes(start)  # zeros: their letters are left out below
        encoded = base64.b64encode(bytes_before + secret).decode()
        first_bit = _BITS_OF_BYTE * start
        end_bit = _BITS_OF_BYTE * (start + len(secret))
        # The first letter that begins in the secret, and the end of the last that ends in it.
        first = math.ceil(first_bit / _BITS_OF_LETTER)
        end = end_bit // _BITS_OF_LETTER
        letters = [_OTHER_SPELLINGS.get(letter, letter) for letter in encoded[first:end]]
        patterns.append(_BREAK.join(letters) + "[A-Za-z0-9+/_-]?={0,2}")
    return patterns


def without_keys(text: str) -> str:
    """Return a text with an asterisk for each letter of a key that `remember_key` was given.

    The longest key first: a shorter one may be part of it, and its rest would stay. The text keeps
    its length.
    """
    longest_first = sorted(_spellings, key=lambda spelling: len(spelling.pattern), reverse=True)
    for spelling in longest_first:
        text = spelling.sub(lambda found: "*" * len(found[0]), text)
    return text


def bytes_without_keys(data: bytes) -> bytes:
    """Return data with an asterisk for each byte of a key, so that messages keep their lengths."""
    if not _spellings:
        return data
    return without_keys(data.decode("latin-1")).encode("latin-1")
