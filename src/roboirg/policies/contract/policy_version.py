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

    Numbers, NumPy's among them, and paths become text: ``2`` -> ``"2"``. A policy may set it until
    its `reset` ends.

    Raises:
        InvalidValueError: it is something else, which may differ in each process, or empty; or it
            cannot be read.
    """
    kind = type(policy)
    try:
        value: Any = policy.version  # type: ignore[attr-defined]
    except (Exception, SystemExit) as error:
        # Not an AttributeError inside of a property `version`, which is a fault.
        is_missing = isinstance(error, AttributeError) and error.name in ("version", None)
        if is_missing and not hasattr(kind, "version"):
            return None
        raise InvalidValueError(
            f"version of {kind.__name__} cannot be read: {one_line(error)}."
        ) from error
    return _version_text(value, f"version of {kind.__name__}")


def _version_text(value: Any, subject: str) -> str:  # noqa: ANN401 - whatever the policy has
    """Return a version as a text that records can hold.

    ``"v1"`` stays, ``2`` becomes ``"2"``. A text that is long, or has characters that a name cannot
    hold, is cut or changed and gets a hash of the original, so that different ones stay different.

    Args:
        value: of the policy.
        subject: whose version it is, for errors.
    """
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
    name = as_name(text)
    if name == text and len(name) <= MOST_LETTERS:
        return name
    return f"{name[:MOST_LETTERS]}…{short_hash(ascii(text))}"


def file_fingerprint(declaring: object) -> str | None:
    """Return a hash of the file that defines a class, and of the class's name.

    A class of a notebook is in no file, so that the source of its methods counts.

    Args:
        declaring: the class, or an object of it.

    Returns:
        The hash; None if no source is found.
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
    """Return a hash of the file or checkpoint that a text names; the text itself if it names none.

    A checkpoint is a folder with a `CHECKPOINT_FILE`; all files in it count, those in folders below
    it do not. An empty text gives ``"empty"``.
    """
    files = [Path(text)]
    hashes = ""
    with contextlib.suppress(OSError):  # what cannot be read is reported where it is used
        if Path(f"{text}/{CHECKPOINT_FILE}").is_file():
            files = sorted(Path(text).iterdir())
        for path in files:
            if path.is_file():
                hashes += file_hash(path)
    if hashes:
        return short_hash(hashes)
    return text or "empty"
