"""Recordings of the expert in files."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roboirg.extension.commands import InvalidValueError, write_atomically
from roboirg.extension.sight import ExpertRecording

_TEXTS = ("names", "classes", "turns")
"""Fields with several texts."""
_WORDS = ("key", "status")
"""Fields with one text."""
_PICTURE = "picture_"
"""Before the number of a look, in the names of a file."""


def save_recording(recorded: ExpertRecording, path: Path) -> None:
    """Write a recording as a NumPy archive (.npz), whole or not at all; `load_recording` reads it.

    Each picture is an array of its own with the bytes of a PNG file: ``picture_16`` is of look 16.
    """
    fields = recorded._asdict()
    pictures = fields.pop("pictures")
    arrays = {name: np.asarray(value) for name, value in fields.items()}
    for look, png in pictures.items():
        arrays[f"{_PICTURE}{look}"] = np.frombuffer(png, np.uint8)
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **arrays)
    write_atomically(path, file.getvalue())


def load_recording(path: Path) -> ExpertRecording:
    """Return the recording of a file that `save_recording` wrote.

    Raises:
        InvalidValueError: the file is none.
    """
    try:
        with np.load(path, allow_pickle=False) as content:
            return _recording_of(dict(content))
    except (OSError, ValueError, KeyError, TypeError, zipfile.BadZipFile) as error:
        raise InvalidValueError(
            f"The recording {str(path)!r} cannot be read ({error}); delete it to make it again."
        ) from error


def _recording_of(arrays: dict[str, NDArray[Any]]) -> ExpertRecording:
    """Return a recording, given the arrays of its file by name.

    Pictures are PNG files as bytes, by the number of their look: ``picture_16`` is of look 16.
    """
    fields: dict[str, Any] = {"pictures": {}}
    for name, array in arrays.items():
        if name.startswith(_PICTURE):
            look = int(name.removeprefix(_PICTURE))
            fields["pictures"][look] = array.tobytes()
        elif name in _TEXTS:
            fields[name] = tuple(array.tolist())
        elif name in _WORDS:
            fields[name] = str(array)
        else:
            fields[name] = array
    return ExpertRecording(**fields)
