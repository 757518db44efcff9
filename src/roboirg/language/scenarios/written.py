"""Read TOML files that people have written, and collect their mistakes, each with its place.

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
    """The mistakes of a file, a line for each, such as ``mine.toml, scenario 'trip' has no cue``.

    They are collected while the file is read, and raised together by `raise_if_any`.

    Args:
        where: names the file; each line begins with it.
    """

    def __init__(self, where: str) -> None:
        self.where = where
        self._found: dict[str, None] = {}

    def __len__(self) -> int:
        return len(self._found)

    def at(self, part: str) -> Mistakes:
        """Return a view of the same mistakes for a part of the file.

        What is added to it counts for the file as well, and its line names the part.
        """
        inner = copy.copy(self)
        inner.where = f"{self.where}, {part}"
        return inner

    def add(self, complaint: str) -> None:
        """Add a mistake, the end of a sentence that begins with the place: ``has no cue``."""
        self._add(f"{self.where} {complaint}.")

    def check_names(self, kind: str, names: Iterable[str], known: Collection[str]) -> None:
        """Add a mistake for each name that is not known, with the known ones that are like it.

        Args:
            kind: what the names are, ``task``.
            names: as written.
            known: all that exist.
        """
        for name in names:
            if name not in known:
                self._add(f"{self.where}: {UnknownNameError(kind, name, sorted(known))}")

    @contextlib.contextmanager
    def collecting(self) -> Iterator[None]:
        """Add the error with which a ``with`` block ends, instead of letting it through."""
        try:
            yield
        except InvalidValueError as error:
            self._add(str(error))

    def raise_if_any(self) -> None:
        """Raise an InvalidValueError with a line for each mistake, if there are any."""
        if self._found:
            raise InvalidValueError("\n".join(self._found))

    def _add(self, line: str) -> None:
        """Add a line once; raise an InvalidValueError with all lines if a file has too many."""
        self._found[clip_text(line, _MOST_LETTERS)] = None
        if len(self) == _MOST_MISTAKES:
            more = f"There may be more mistakes; these are the first {_MOST_MISTAKES}."
            self._found[more] = None
            self.raise_if_any()


def excerpt(value: object) -> str:
    """Return the beginning of a value as Python writes it, for messages: ``'Lift the…``."""
    return clip_text(repr(value), _MOST_SHOWN)


def read_text(path: Path) -> str:
    """Return the text of a file in UTF-8, without a byte order mark.

    Raises:
        InvalidValueError: it cannot be read, is no regular file, or has more than `MOST_BYTES`.
    """
    try:
        return read_regular(path, MOST_BYTES).decode("utf-8-sig")
    except (OSError, ValueError) as error:  # a path may hold NUL
        reason = str(error).rstrip(".")
        raise InvalidValueError(f"The file {str(path)!r} cannot be read: {reason}.") from error


def parse_toml(text: str, where: str) -> dict[str, Any]:
    """Return the data of a TOML file.

    Args:
        text: of the file.
        where: names the file in messages.

    Raises:
        InvalidValueError: it is not valid, or nests keys so deep that parsing would take too long.
    """
    if _DEEP_KEY.search(text):  # takes a time and memory that grow with the square of the depth
        raise InvalidValueError(
            f"{where} is not valid TOML: a key has more than {_MOST_KEY_PARTS} parts."
        )
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise InvalidValueError(f"{where} is not valid TOML: {error}.") from error


def convert(value: object, kind: type[Stored], where: str) -> Stored:
    """Return a value of a file as a type: the list ``["a"]`` as ``tuple[str, ...]`` is ``("a",)``.

    Args:
        value: as the TOML parser returns it.
        kind: the type.
        where: names the field in messages: ``mine.toml, pool``.

    Raises:
        InvalidValueError: it has another type.
    """
    allowed = _allowed_words(kind)
    if allowed and value not in (None, *allowed):
        raise InvalidValueError(f"{where} is {excerpt(value)}; it must be {' or '.join(allowed)}.")
    try:
        return msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        complaint = _in_plain_words(str(error))
        raise InvalidValueError(f"{where}: {complaint}; it is {excerpt(value)}.") from None


def _in_plain_words(complaint: str) -> str:
    """Return a complaint of msgspec in words that authors of files know.

    ``Expected `array`, got `int``` becomes *Expected a list, got a number*.
    """
    words = clip_text(complaint, 2 * _MOST_SHOWN)
    words = words.replace("`", "").replace(" | ", " or ")
    for name, noun in _NOUNS.items():
        words = re.sub(rf"\b{name}\b", noun, words)
    return words


def read_table(
    written: Mapping[str, Any], kind: type[Table], mistakes: Mistakes, others: Iterable[str] = ()
) -> Table | None:
    """Return a table of a file as a struct; None if a field is missing or wrong.

    All mistakes of the table are added, so None means that there is at least one.

    Args:
        written: the table, by field.
        kind: the struct.
        mistakes: of the file, at the table.
        others: fields that the table may have besides those of the struct.
    """
    found: dict[str, Any] = {}
    is_right = True  # until a field lacks or is wrong; then all others are checked as well
    for field in msgspec.structs.fields(kind):
        if field.name in written:
            where = f"{mistakes.where}, {field.name}"
            with mistakes.collecting():
                found[field.name] = convert(written[field.name], field.type, where)
            if field.name not in found:
                is_right = False
        elif field.required:
            mistakes.add(f"has no {field.name}")
            is_right = False
    mistakes.check_names("field", written, (*kind.__struct_fields__, *others))
    if not is_right:
        return None
    return kind(**found)


def _allowed_words(kind: object) -> tuple[str, ...]:
    """Return the words that a type allows; empty if it is no type of words.

    ``Literal["train", "test"]`` and ``Literal["train", "test"] | None`` give ``("train", "test")``.
    """
    for part in (kind, *get_args(kind)):
        if get_origin(part) is Literal:
            return get_args(part)
    return ()
