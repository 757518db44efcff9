"""Where what is derived from installed files is kept between processes."""

from __future__ import annotations

import functools
import hashlib
import io
import secrets
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from roboirg.cache import Cache, cache_folder

Arrays = dict[str, NDArray[np.generic]]

_MOST_BYTES = 2**28
"""That derived meshes may take; they take a tenth of it."""


def kept_arrays(name: str, sources: bytes, make: Callable[[], Arrays]) -> Arrays:
    """Arrays that were derived before, or are now.

    Args:
        name: what they are.
        sources: all that determines them.
        make: derives them.
    """
    folder = cache_folder()
    cache = Cache(None if folder is None else folder / "meshes", _MOST_BYTES)
    key = f"{name}-{hashlib.sha256(sources).hexdigest()[:24]}.npz"
    raw = cache.read(key)
    if raw is not None:
        try:
            with np.load(io.BytesIO(raw)) as held:
                return {field: held[field] for field in held.files}
        except (OSError, ValueError, zipfile.BadZipFile):
            pass  # written by a version of NumPy that this one does not understand
    arrays = make()
    file = io.BytesIO()
    np.savez(file, **arrays)  # type: ignore[arg-type] # NumPy's stub takes its flags for fields
    cache.write(key, file.getvalue())
    return arrays


@functools.cache
def code_of(*modules: str) -> bytes:
    """The text of modules in this folder: what they derive changes with it."""
    return b"".join((Path(__file__).parent / f"{name}.py").read_bytes() for name in modules)


def write_whole(path: Path, content: bytes) -> None:
    """Write a file so that nobody ever sees a part of it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f".{path.name}.{secrets.token_hex(8)}.part")
    try:
        part.write_bytes(content)
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
