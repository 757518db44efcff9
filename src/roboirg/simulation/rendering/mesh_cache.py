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
    """Pack arrays into bytes: the header's length, a JSON header, then the arrays' numbers.

    The header is ``{name: [type, shape]}``; each part is padded to a multiple of `_WORD` bytes.
    `unpack_arrays` reads it. NumPy's own format takes several times as long to read, because it
    copies.
    """
    formats = {name: (array.dtype.str, array.shape) for name, array in arrays.items()}
    header = json.dumps(formats)
    parts = [len(header).to_bytes(_WORD, "little"), header.encode()]
    parts += [np.ascontiguousarray(array).tobytes() for array in arrays.values()]
    return b"".join(part + _padding(len(part)) for part in parts)


def _padding(length: int) -> bytes:
    """Return the zero bytes from a length up to the next multiple of `_WORD`: 13 → 3 of them."""
    return bytes(-length % _WORD)


def unpack_arrays(content: memoryview) -> Arrays:
    """Unpack the output of `pack_arrays` as read-only views of the content."""
    size = int.from_bytes(content[:_WORD], "little")
    header = json.loads(bytes(content[_WORD : _WORD + size]))
    offset = _WORD + size
    arrays: Arrays = {}
    for name, (kind, shape) in header.items():
        offset += len(_padding(offset))
        flat = np.frombuffer(content, kind, math.prod(shape), offset)
        arrays[name] = flat.reshape(shape)
        offset += flat.nbytes
    return arrays


@functools.cache
def source_code(*modules: str) -> bytes:
    """Return the source code of modules in this folder, as part of cache keys.

    With it a changed module never reads what the old one made.
    """
    return b"".join((Path(__file__).parent / f"{name}.py").read_bytes() for name in modules)
