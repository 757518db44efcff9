"""Cache between processes for arrays derived from installed files."""

from __future__ import annotations

import functools
import hashlib
import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from roboirg.util.cache import open_cache

Arrays = dict[str, NDArray[np.generic]]

_WORD = 8
"""Alignment of the header and of each array, bytes."""


def cached_arrays(name: str, sources: bytes, make: Callable[[], Arrays]) -> Arrays:
    """Return arrays from the cache, or make and cache them.

    `sources` is everything that determines the arrays.
    """
    cache = open_cache("meshes")
    key = f"{name}-{hashlib.sha256(source_code('mesh_cache') + sources).hexdigest()[:24]}"
    content = cache.read(key)
    if content is not None:
        return unpack_arrays(content)
    arrays = make()
    cache.write(key, pack_arrays(arrays))
    return arrays


def pack_arrays(arrays: Arrays) -> bytes:
    """Pack arrays after a JSON header with its length.

    NumPy's own format takes several times as long to read, because it copies.
    """
    header = json.dumps({name: (array.dtype.str, array.shape) for name, array in arrays.items()})
    parts = [len(header).to_bytes(_WORD, "little"), header.encode()]
    parts += [np.ascontiguousarray(array).tobytes() for array in arrays.values()]
    return b"".join(part + bytes(-len(part) % _WORD) for part in parts)


def unpack_arrays(content: memoryview) -> Arrays:
    """Unpack the output of `pack_arrays` as read-only views of the content."""
    size = int.from_bytes(content[:_WORD], "little")
    header = json.loads(bytes(content[_WORD : _WORD + size]))
    offset = _WORD + size
    arrays: Arrays = {}
    for name, (kind, shape) in header.items():
        offset += -offset % _WORD
        count = math.prod(shape)
        arrays[name] = np.frombuffer(content, kind, count, offset).reshape(shape)
        offset += arrays[name].nbytes
    return arrays


@functools.cache
def source_code(*modules: str) -> bytes:
    """Return the source code of modules in this folder, as part of cache keys."""
    return b"".join((Path(__file__).parent / f"{name}.py").read_bytes() for name in modules)
