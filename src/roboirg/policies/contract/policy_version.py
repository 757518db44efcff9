"""The version that a policy declares, read from the object that plays."""

from __future__ import annotations

import contextlib
import inspect
import os
from pathlib import Path
from typing import Any

import numpy as np

from roboirg.core.error_words import one_line
from roboirg.core.errors import InvalidValueError
from roboirg.core.field_types import as_name
from roboirg.util.regular_file import file_hash
from roboirg.util.short_hash import short_hash

MOST_LETTERS = 200
CHECKPOINT_FILE = "config.json"
"""In the folder of each checkpoint."""


def read_version(policy: object) -> str | None:
    """Return a policy's, planner's or class's ``version`` as text; None if it has none.

    Numbers, NumPy's among them, and paths become text. A policy may set it until its `reset` ends.

    Raises:
        InvalidValueError: it is something else, which may differ in each process, or empty; or it
            cannot be read.
    """
    kind, subject = type(policy), f"version of {type(policy).__name__}"
    try:
        value: Any = policy.version  # type: ignore[attr-defined]
    except (Exception, SystemExit) as error:
        missing = isinstance(error, AttributeError) and error.name in ("version", None)
        if missing and not hasattr(kind, "version"):
            return None
        raise InvalidValueError(f"{subject} cannot be read: {one_line(error)}.") from error
    if isinstance(value, np.generic | np.ndarray) and value.ndim == 0:
        value = value.item()
    if isinstance(value, os.PathLike):
        value = os.fspath(value)
    if isinstance(value, bool) or not isinstance(value, str | int | float) or value == "":
        raise InvalidValueError(
            f"{subject} is {value!r:.80}; it must be a text, number or "
            "path, such as the name of a checkpoint, or not be there."
        )
    text = str(value)
    shown = as_name(text)
    # Long paths may differ in their last letters only, others in what a name cannot hold.
    cut = f"{shown[:MOST_LETTERS]}…{short_hash(ascii(text))}"
    return shown if shown == text and len(shown) <= MOST_LETTERS else cut


def file_fingerprint(declaring: object) -> str | None:
    """Return a hash of a class, or an object's, and the file that defines it; None without one.

    In a notebook, which is no file, its methods count.
    """
    kind = declaring if isinstance(declaring, type) else type(declaring)
    try:
        source = Path(inspect.getfile(kind)).read_bytes()
    except (OSError, TypeError):
        methods = filter(inspect.isfunction, vars(kind).values())
        try:
            source = "".join(map(inspect.getsource, methods)).encode()
        except OSError:
            return None
    return short_hash(kind.__qualname__.encode() + source)


def content_of(text: str) -> str:
    """Return a hash of the file or checkpoint that a text names; the text if it names neither."""
    files = [Path(text)]
    content = ""
    with contextlib.suppress(OSError):  # what cannot be read is reported where it is used
        if Path(f"{text}/{CHECKPOINT_FILE}").is_file():
            files = sorted(Path(text).iterdir())
        for path in files:
            if path.is_file():
                content += file_hash(path)
    return short_hash(content) if content else text or "empty"
