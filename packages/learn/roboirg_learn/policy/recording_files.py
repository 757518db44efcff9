"""Recordings of the expert in files."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np

from roboirg.extension.commands import InvalidValueError, write_atomically
from roboirg.extension.sight import ExpertRecording

_PICTURE = "picture_"
"""Before the number of a look, in the names of a file."""


def save_recording(recorded: ExpertRecording, path: Path) -> None:
    """Write a recording, whole or not at all."""
    fields = recorded._asdict()
    pictures = fields.pop("pictures")
    arrays = {name: np.asarray(value) for name, value in fields.items()}
    arrays |= {f"{_PICTURE}{look}": np.frombuffer(png, np.uint8) for look, png in pictures.items()}
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **arrays)
    write_atomically(path, file.getvalue())


def load_recording(path: Path) -> ExpertRecording:
    """Return a recording.

    Raises:
        InvalidValueError: the file is none.
    """
    try:
        with np.load(path, allow_pickle=False) as content:
            found = dict(content)
        pictures = {
            int(name.removeprefix(_PICTURE)): found.pop(name).tobytes()
            for name in list(found)
            if name.startswith(_PICTURE)
        }
        texts = {name: tuple(found[name].tolist()) for name in ("names", "classes", "turns")}
        words = {name: str(found[name]) for name in ("key", "status")}
        return ExpertRecording(**{**found, **texts, **words}, pictures=pictures)
    except (OSError, ValueError, KeyError, TypeError, zipfile.BadZipFile) as error:
        raise InvalidValueError(
            f"The recording {str(path)!r} cannot be read ({error}); delete it to make it again."
        ) from error
