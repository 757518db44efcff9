"""What a policy or its server hands over, as JSON values."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import Any

import numpy as np

from roboirg.core.errors import InvalidValueError
from roboirg.core.plain_text import clip_text, printable

_MAX_LISTED = 64
"""Numbers of an array that are written out."""
_MAX_TEXT_LENGTH = 1000
_MAX_SHOWN = 80


def as_json(value: Any, owner: str | None = None, key: str = "") -> Any:  # noqa: ANN401
    """Return a value as JSON values.

    Numbers and arrays of NumPy, PyTorch and JAX become numbers and lists, paths and keys texts;
    large arrays are described.

    Args:
        value: anything.
        owner: whose value it is, for the error; None for a stranger's, in which all else becomes
            text, cut and without characters that control a terminal.
        key: of the value.

    Raises:
        InvalidValueError: the owner's value is something else, or a number that is not finite.
        RecursionError: it is nested too deep.
    """
    if isinstance(value, Mapping):
        return {
            _text(one, owner, key): as_json(held, owner, f"{key}.{one}" if key else str(one))
            for one, held in value.items()
        }
    if hasattr(value, "tolist") and hasattr(value, "shape") and not isinstance(value, type):
        if math.prod(value.shape) > _MAX_LISTED:
            return f"array of shape {tuple(value.shape)}, {value.dtype}"
        found = value.tolist()
        # Number types that NumPy does not know, such as bfloat16, stay themselves.
        return as_json(float(value) if isinstance(found, np.generic) else found, owner, key)
    if isinstance(value, Sequence) and not isinstance(value, str | bytes | bytearray | memoryview):
        return [as_json(held, owner, f"{key}[{index}]") for index, held in enumerate(value)]
    if isinstance(value, int | float) and abs(value) < math.inf:
        # Of a subclass, too.
        kind = next(one for one in (bool, int, float) if isinstance(value, one))
        return kind(value)
    return None if value is None else _text(value, owner, key)


def _text(value: object, owner: str | None, key: str) -> str:
    """Return what stands for text."""
    if owner is None:
        return printable(str(value)[:_MAX_TEXT_LENGTH])
    if isinstance(value, str):
        return str.__str__(value)  # of a subclass, too
    if isinstance(value, PurePath | int | np.integer):
        return str(value)
    raise InvalidValueError(
        f"{owner}: {key!r} is {clip_text(repr(value), _MAX_SHOWN)}; it must be a text, a finite "
        "number, True, False, None, or an array, list or dict of these."
    )
