"""The version that a policy declares, read from the object that plays."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from roboirg.core.errors import InvalidValueError
from roboirg.core.field_types import as_name
from roboirg.util.short_hash import short_hash

MOST_LETTERS = 200


def read_version(policy: object) -> str | None:
    """Return a policy's, planner's or class's ``version`` as text; None if it has none.

    Numbers, NumPy's among them, and paths become text. A policy may set it until its `reset` ends.

    Raises:
        InvalidValueError: it is something else, which may differ in each process, or empty.
    """
    if not hasattr(policy, "version"):
        return None
    value: Any = policy.version
    if isinstance(value, np.generic | np.ndarray) and value.ndim == 0:
        value = value.item()
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    if isinstance(value, bool) or not isinstance(value, str | int | float) or value == "":
        raise InvalidValueError(
            f"version of {type(policy).__name__} is {value!r:.80}; it must be a text, number or "
            "path, such as the name of a checkpoint, or not be there."
        )
    text = str(value)
    shown = as_name(text)
    # Long paths may differ in their last letters only.
    cut = f"{shown[:MOST_LETTERS]}…{short_hash(ascii(text))}"
    return shown if len(shown) <= MOST_LETTERS else cut
