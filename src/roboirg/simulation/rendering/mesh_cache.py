"""Cache between processes for arrays derived from installed files."""

from __future__ import annotations

import functools
import hashlib
import io
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from roboirg.util.cache import open_cache

Arrays = dict[str, NDArray[np.generic]]

_HASH_DIGITS = 24
"""Hexadecimal digits of the sources' hash in an entry's name."""


def cached_arrays(name: str, sources: bytes, make: Callable[[], Arrays]) -> Arrays:
    """Return arrays from the cache, or make and cache them.

    Args:
        name: beginning of the entry's name, for people who look into the cache.
        sources: everything that determines the arrays, such as `source_code` of what makes them.
        make: makes them.
    """
    cache = open_cache("meshes")
    digest = hashlib.sha256(source_code("mesh_cache") + sources).hexdigest()
    key = f"{name}-{digest[:_HASH_DIGITS]}"
    content = cache.read(key)
    if content is not None:
        return unpack_arrays(content)
    arrays = make()
    cache.write(key, pack_arrays(arrays))
    return arrays


def pack_arrays(arrays: Arrays) -> bytes:
    """Return arrays as the content of a file, which `unpack_arrays` reads."""
    file = io.BytesIO()
    np.savez(file, allow_pickle=False, **arrays)
    return file.getvalue()


def unpack_arrays(content: bytes | memoryview) -> Arrays:
    """Return the arrays in the output of `pack_arrays`, in their order."""
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        return dict(arrays)


@functools.cache
def source_code(*modules: str) -> bytes:
    """Return the source code of modules in this folder, as part of cache keys.

    With it a changed module never reads what the old one made.
    """
    return b"".join((Path(__file__).parent / f"{name}.py").read_bytes() for name in modules)
