"""What people have written in files: TOML with its values, and complaints that name the place.

Anyone may have written it, so nothing in it can take long, or reach a terminal as it is.
"""

from __future__ import annotations

import contextlib
import copy
import re
import tomllib
from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Literal, TypeVar, get_args, get_origin

import msgspec

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.core.plain_text import clip_text
from roboirg.util.regular_file import read_regular

Stored = TypeVar("Stored")
Table = TypeVar("Table", bound=msgspec.Struct)
MOST_BYTES = 4_000_000
"""Of a file; the largest that was seen has 100,000."""
_MOST_KEY_PARTS = 20
_KEY_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+"""
"""A regular expression for a part of a dotted key, with the dot: ``colors.``, ``"a b" .``"""
_DEEP_KEY = re.compile(rf"(?<![\w-]){_KEY_PART}(?:{_KEY_PART}){{{_MOST_KEY_PARTS}}}")
"""A key with too many parts."""
_MOST_SHOWN = 80
"""Characters of a name, text or value in a complaint."""
_MOST_LETTERS = 2_000
"""Of a complaint."""
_MOST_MISTAKES = 20
"""Of a file; further ones are not looked for."""
_NOUNS = {"array": "a list", "object": "a table", "str": "a text", "int": "a number"}
"""What people call the types in msgspec's complaints."""


class Mistakes:
    """What is wrong with a file, a line for each mistake.

    Args:
        where: the file; complaints begin with it.
    """

    def __init__(self, where: str) -> None:
        self.where = where
        self._found: dict[str, None] = {}

    def __len__(self) -> int:
        return len(self._found)

    def at(self, part: str) -> Mistakes:
        """Return the same mistakes, of which the next ones are in a part of the file."""
        inner = copy.copy(self)
        inner.where = f"{self.where}, {part}"
        return inner

    def add(self, complaint: str) -> None:
        """Remember a mistake: ``has no cue``."""
        self._add(f"{self.where} {complaint}.")

    def check_names(self, kind: str, names: Iterable[str], known: Collection[str]) -> None:
        """Remember each name that is unknown."""
        for name in names:
            if name not in known:
                self._add(f"{self.where}: {UnknownNameError(kind, name, sorted(known))}")

    @contextlib.contextmanager
    def kept(self) -> Iterator[None]:
        """Remember the error with which a block ends."""
        try:
            yield
        except InvalidValueError as error:
            self._add(str(error))

    def refuse(self) -> None:
        """Raise an error with all mistakes, if there are any."""
        if self._found:
            raise InvalidValueError("\n".join(self._found))

    def _add(self, line: str) -> None:
        """Remember a line; raises an error with all of them where a file has too many."""
        self._found[clip_text(line, _MOST_LETTERS)] = None
        if len(self) == _MOST_MISTAKES:
            self._add(f"There may be more mistakes; these are the first {_MOST_MISTAKES}.")
            self.refuse()


def shown(value: object) -> str:
    """Return the beginning of a value, as complaints have it."""
    return clip_text(repr(value), _MOST_SHOWN)


def text_of(path: Path) -> str:
    """Return the text of a file, without a byte order mark."""
    try:
        return read_regular(path, MOST_BYTES).decode("utf-8-sig")
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
    """Return a value of a file as a type; raise if it has another one.

    `where` names its field in the message.
    """
    choices = _choices(kind)
    if choices and value not in (None, *choices):
        raise InvalidValueError(f"{where} is {shown(value)}; it must be {' or '.join(choices)}.")
    try:
        return msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        complaint = _plain(str(error))
        raise InvalidValueError(f"{where}: {complaint}; it is {shown(value)}.") from None


def _plain(complaint: str) -> str:
    """Return a complaint of msgspec in plain words: *Expected a list, got a number*."""
    words = clip_text(complaint, 2 * _MOST_SHOWN)
    words = words.replace("`", "").replace(" | ", " or ")
    for name, noun in _NOUNS.items():
        words = re.sub(rf"\b{name}\b", noun, words)
    return words


def fields_of(
    written: Mapping[str, Any], kind: type[Table], mistakes: Mistakes, others: Iterable[str] = ()
) -> Table | None:
    """Return a table of a file as a struct; None if it lacks a field or one is wrong.

    All mistakes are added. `others` are fields that a table can have and the struct has not.
    """
    found: dict[str, Any] = {}
    is_right = True  # until a field lacks or is wrong; then all others are checked as well
    for field in msgspec.structs.fields(kind):
        if field.name in written:
            where = f"{mistakes.where}, {field.name}"
            with mistakes.kept():
                found[field.name] = converted(written[field.name], field.type, where)
            if field.name not in found:
                is_right = False
        elif field.required:
            mistakes.add(f"has no {field.name}")
            is_right = False
    mistakes.check_names("field", written, (*kind.__struct_fields__, *others))
    if not is_right:
        return None
    return kind(**found)


def _choices(kind: object) -> tuple[str, ...]:
    """Return the words that a type allows; empty if it is none of words."""
    for part in (kind, *get_args(kind)):
        if get_origin(part) is Literal:
            return get_args(part)
    return ()
