"""What a policy or its server hands over, as JSON values."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import Any, NamedTuple

import numpy as np

from roboirg.core.errors import InvalidValueError
from roboirg.core.plain_text import clip_text, printable

MAX_DEPTH = 16
"""Most containers around a value."""
_MAX_LISTED = 64
"""Numbers of an array that are written out."""
_MAX_TEXT_LENGTH = 1000
_TOO_LARGE = 2**63
_MAX_SHOWN = 80
_TEXTUAL = str, PurePath, int, np.integer
"""Types of what may stand for a text: paths and whole numbers do, too."""


class _Place(NamedTuple):
    """Where a value stands, for errors and limits.

    Attributes:
        owner: whose value it is; None for a stranger's.
        key: of the value, such as ``policy.sizes[2]``; empty for the outermost.
        depth: containers around it, and one.
    """

    owner: str | None
    key: str = ""
    depth: int = 1

    def inside(self, key: str) -> _Place:
        """Return the place of a value in the container that stands here."""
        return _Place(self.owner, key, self.depth + 1)


def as_json(value: Any, owner: str | None = None) -> Any:  # noqa: ANN401
    """Return a value as JSON values that every reader of records can read.

    Numbers and arrays of NumPy, PyTorch and JAX become numbers and lists. Paths, keys and whole
    numbers of more than 63 bits become texts; large arrays are described.

    Args:
        value: anything.
        owner: whose value it is, for the error; None for a stranger's, in which all else becomes
            text, cut and without characters that control a terminal.

    Raises:
        InvalidValueError: the owner's value is something else, a number that is not finite, or
            nested too deep.
    """
    return _as_json(value, _Place(owner))


def _as_json(value: Any, place: _Place) -> Any:  # noqa: ANN401
    """Return a value as JSON values: mappings, arrays, sequences, and all else as a scalar.

    Args:
        value: anything.
        place: where it stands in what is converted; decides what is refused, and the words for it.
    """
    if place.depth > MAX_DEPTH:
        if place.owner is not None:
            raise InvalidValueError(
                f"{place.owner} are nested more than {MAX_DEPTH} deep; make them flat."
            )
        return "…"
    if isinstance(value, Mapping):
        return _object(value, place)
    # An array of NumPy, PyTorch or JAX, or a scalar of theirs, known by its attributes.
    if hasattr(value, "tolist") and hasattr(value, "shape") and not isinstance(value, type):
        return _array(value, place)
    if isinstance(value, Sequence) and not isinstance(value, str | bytes | bytearray | memoryview):
        entries: list[Any] = []
        for index, entry in enumerate(value):
            entries.append(_as_json(entry, place.inside(f"{place.key}[{index}]")))
        return entries
    return _scalar(value, place)


def _scalar(value: object, place: _Place) -> Any:  # noqa: ANN401
    """Return a value that holds no others as a plain JSON value; one that JSON lacks as a text.

    Numbers of a subclass become plain ones. Infinite or too large ones are texts, or an error; see
    `_text`.
    """
    if value is None or isinstance(value, bool):
        return value
    if isinstance(value, int) and abs(value) < _TOO_LARGE:
        return int(value)
    if isinstance(value, float) and math.isfinite(value):
        return float(value)
    return _text(value, place)


def _object(value: Mapping[Any, Any], place: _Place) -> dict[str, Any]:
    """Return a mapping as a JSON object, whose keys are texts.

    ``{1: 2.5}`` -> ``{"1": 2.5}``. In errors, the entry ``b`` of ``a`` is called ``a.b``, and a key
    that cannot be a text *a key*.
    """
    entries: dict[str, Any] = {}
    for key, entry in value.items():
        if place.owner is not None and not isinstance(key, _TEXTUAL):
            shown = clip_text(repr(key), _MAX_SHOWN)
            where = place.key or "it"
            raise InvalidValueError(
                f"{place.owner}: {where} has the key {shown}; keys must be text."
            )
        name = _text(key, place)
        path = f"{place.key}.{key}" if place.key else str(key)
        entries[name] = _as_json(entry, place.inside(path))
    return entries


def _array(value: Any, place: _Place) -> Any:  # noqa: ANN401
    """Return an array, or a scalar of NumPy, PyTorch or JAX, as lists or a number.

    Of more than `_MAX_LISTED` numbers only a text: ``"array of shape (256, 256, 3), uint8"``.
    """
    # An axis of length 0 does not make the lists of the others fewer.
    lists = math.prod(max(length, 1) for length in value.shape)
    if lists > _MAX_LISTED:
        return f"array of shape {tuple(value.shape)}, {value.dtype}"
    listed = value.tolist()
    if isinstance(listed, np.generic):
        listed = float(value)  # a number type that NumPy does not know, such as bfloat16
    return _as_json(listed, place)


def _text(value: object, place: _Place) -> str:
    """Return a value as a text.

    A stranger's value (without an owner) may be anything, and is cut. One with an owner has to be a
    text, a path or a whole number, and anything else raises `InvalidValueError`.
    """
    if place.owner is None:
        return printable(str(value)[:_MAX_TEXT_LENGTH])
    if isinstance(value, str):
        return str.__str__(value)  # of a subclass, too
    if isinstance(value, _TEXTUAL):
        return str(value)
    raise InvalidValueError(
        f"{place.owner}: {place.key!r} is {clip_text(repr(value), _MAX_SHOWN)}; it must be a text, "
        "a finite number, True, False, None, or an array, list or dict of these."
    )
