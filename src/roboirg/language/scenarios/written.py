"""What people have written in files: TOML with its values, and complaints that name the place.

Anyone may have written it, so nothing in it can take long, or reach a terminal as it is.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any, Literal, TypeVar, get_args, get_origin

import msgspec

from roboirg.core.errors import InvalidValueError
from roboirg.core.plain_text import clip_text
from roboirg.util.regular_file import read_regular

Stored = TypeVar("Stored")
MOST_BYTES = 4_000_000
"""Of a file; the largest that was seen has 100,000."""
_MOST_KEY_PARTS = 20
_KEY_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+"""
_DEEP_KEY = re.compile(rf"(?<![\w-]){_KEY_PART}(?:{_KEY_PART}){{{_MOST_KEY_PARTS}}}")
_MOST_SHOWN = 80
"""Characters of a value in a complaint."""
_NOUNS = {"array": "a list", "object": "a table", "str": "a text", "int": "a number"}


def text_of(path: Path) -> str:
    """Return the text of a file."""
    try:
        return read_regular(path, MOST_BYTES).decode()
    except (OSError, ValueError) as error:  # a path may hold NUL
        reason = str(error).rstrip(".")
        raise InvalidValueError(f"The file {str(path)!r} cannot be read: {reason}.") from error


def data_of(text: str, where: str) -> dict[str, Any]:
    """Return the data of a TOML file; `where` names it in complaints."""
    if _DEEP_KEY.search(text):  # takes a time and memory that grow with the square of the depth
        raise InvalidValueError(
            f"{where} is not valid TOML: a key has more than {_MOST_KEY_PARTS} parts."
        )
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise InvalidValueError(f"{where} is not valid TOML: {error}.") from error


def converted(value: object, kind: type[Stored], where: str) -> Stored:
    """Return a value of a file as a type; `where` names its field in complaints."""
    choices = _choices(kind)
    if choices and value not in (None, *choices):
        raise InvalidValueError(
            f"{where} is {clip_text(repr(value), _MOST_SHOWN)}; it must be {' or '.join(choices)}."
        )
    try:
        return msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        words = str(error).replace("`", "").replace(" | ", " or ")
        complaint = re.sub(rf"\b(?:{'|'.join(_NOUNS)})\b", lambda found: _NOUNS[found[0]], words)
        shown = clip_text(repr(value), _MOST_SHOWN)
        raise InvalidValueError(f"{where}: {complaint}; it is {shown}.") from None


def _choices(kind: object) -> tuple[str, ...]:
    """Return the words that a type allows; empty if it is none of words."""
    for part in (kind, *get_args(kind)):
        if get_origin(part) is Literal:
            return get_args(part)
    return ()
