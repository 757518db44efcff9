"""Where what is derived from installed files is kept between processes."""

from __future__ import annotations

import functools
import hashlib
import json
import math
import secrets
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from roboirg.util.cache import open_cache

Arrays = dict[str, NDArray[np.generic]]

_WORD = 8
"""Bytes; arrays and what is told of them begin at multiples of it."""


def cached_arrays(name: str, sources: bytes, make: Callable[[], Arrays]) -> Arrays:
    """Arrays that were derived before, or are now.

    Args:
        name: what they are.
        sources: all that determines them.
        make: derives them.
    """
    cache = open_cache("meshes")
    key = f"{name}-{hashlib.sha256(source_code('mesh_cache') + sources).hexdigest()[:24]}"
    content = cache.read(key)
    if content is not None:
        return unpacked(content)
    arrays = make()
    cache.write(key, packed(arrays))
    return arrays


def packed(arrays: Arrays) -> bytes:
    """Arrays one after the other; before them what they are, as JSON, and its length.

    NumPy's own files take several times as long to read, because they are copied.
    """
    told = json.dumps({name: (array.dtype.str, array.shape) for name, array in arrays.items()})
    parts = [len(told).to_bytes(_WORD, "little"), told.encode()]
    parts += [np.ascontiguousarray(array).tobytes() for array in arrays.values()]
    return b"".join(part + bytes(-len(part) % _WORD) for part in parts)


def unpacked(content: memoryview) -> Arrays:
    """What was `packed`: views of the content, which cannot be written to."""
    size = int.from_bytes(content[:_WORD], "little")
    told = json.loads(bytes(content[_WORD : _WORD + size]))
    place = _WORD + size
    arrays: Arrays = {}
    for name, (kind, shape) in told.items():
        place += -place % _WORD
        count = math.prod(shape)
        arrays[name] = np.frombuffer(content, kind, count, place).reshape(shape)
        place += arrays[name].nbytes
    return arrays


@functools.cache
def source_code(*modules: str) -> bytes:
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
