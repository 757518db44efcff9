"""What a policy or its server hands over, as JSON values."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import Any

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


def as_json(value: Any, owner: str | None = None, key: str = "", depth: int = 1) -> Any:  # noqa: ANN401
    """Return a value as JSON values that every reader of records can read.

    Numbers and arrays of NumPy, PyTorch and JAX become numbers and lists, paths and keys texts;
    large arrays are described.

    Args:
        value: anything.
        owner: whose value it is, for the error; None for a stranger's, in which all else becomes
            text, cut and without characters that control a terminal.
        key: of the value.
        depth: containers around it, and one.

    Raises:
        InvalidValueError: the owner's value is something else, a number that is not finite, a
            whole one of more than 63 bits, or nested too deep.
    """
    if depth > MAX_DEPTH:
        if owner is not None:
            raise InvalidValueError(
                f"{owner} are nested more than {MAX_DEPTH} deep; make them flat."
            )
        value = "…"
    if isinstance(value, Mapping):
        return {
            _text(one, owner, key or "a key"): as_json(
                held, owner, f"{key}.{one}" if key else str(one), depth + 1
            )
            for one, held in value.items()
        }
    if hasattr(value, "tolist") and hasattr(value, "shape") and not isinstance(value, type):
        if math.prod(value.shape) > _MAX_LISTED:
            return f"array of shape {tuple(value.shape)}, {value.dtype}"
        found = value.tolist()
        # Number types that NumPy does not know, such as bfloat16, stay themselves.
        return as_json(float(value) if isinstance(found, np.generic) else found, owner, key, depth)
    if isinstance(value, Sequence) and not isinstance(value, str | bytes | bytearray | memoryview):
        return [
            as_json(held, owner, f"{key}[{index}]", depth + 1) for index, held in enumerate(value)
        ]
    if isinstance(value, int | float) and (
        abs(value) < (_TOO_LARGE if isinstance(value, int) else math.inf)
    ):
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
