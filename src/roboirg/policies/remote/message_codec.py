"""The bytes of a message: msgpack with NumPy arrays, as openpi, MME-VLA and RoboMME write them.

An array is a map with four keys of type bytes: ``__ndarray__`` (true), ``data`` (C order),
``dtype`` (such as ``<f4``) and ``shape``; a NumPy scalar one with ``__npgeneric__``, ``data`` and
``dtype``. Nothing is ever unpickled.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from roboirg.core.errors import MissingDependencyError

try:
    import msgpack
except ImportError as error:
    raise MissingDependencyError(
        "Remote policies need msgpack; install roboirgbench[remote]."
    ) from error

_ARRAY, _SCALAR = b"__ndarray__", b"__npgeneric__"
_REFUSED = "VOc"
"""Kinds of dtype that are not sent: structures, Python objects, complex numbers."""
_MALFORMED = (ValueError, TypeError, OverflowError, RecursionError, SyntaxError)
"""What msgpack and NumPy raise for bytes that make no sense."""


class CodecError(ValueError):
    """Bytes that are no message, or a message that cannot be written."""


def pack(message: Mapping[str, Any]) -> bytes:
    """A message as bytes; maps keep their order.

    Raises:
        CodecError: it holds something that cannot be written.
    """
    try:
        packed: bytes = msgpack.packb(message, default=_encode)
    except (TypeError, ValueError, OverflowError) as error:
        raise CodecError(f"the message cannot be written ({error})") from error
    return packed


def unpack(data: bytes) -> dict[str, Any]:
    """The message that bytes hold; its arrays are read-only views of them.

    Raises:
        CodecError: they hold none.
    """
    try:
        message = msgpack.unpackb(data, object_hook=_decode)
    except (*_MALFORMED, msgpack.exceptions.UnpackException) as error:
        words = " ".join(str(error).split()) or type(error).__name__
        raise CodecError(f"the bytes are no msgpack message ({words})") from error
    if not isinstance(message, dict):
        raise CodecError(f"the message is no map but of type {type(message).__name__}")
    for key in message:
        if not isinstance(key, str):
            raise CodecError(f"the message has a key {key!r} that is no text")
    return message


def _encode(value: object) -> dict[bytes, Any]:
    if not isinstance(value, np.ndarray | np.generic):
        raise TypeError(f"there is no way to write type {type(value).__name__}")
    if value.dtype.kind in _REFUSED:
        raise ValueError(f"arrays of dtype {value.dtype} are not sent")
    if isinstance(value, np.ndarray):
        return {
            _ARRAY: True,
            # A view, as pictures are large; contiguous arrays are copied once, into the message.
            b"data": np.ascontiguousarray(value).reshape(-1).view(np.uint8).data,
            b"dtype": value.dtype.str,
            b"shape": value.shape,
        }
    return {_SCALAR: True, b"data": value.item(), b"dtype": value.dtype.str}


def _decode(found: dict[Any, Any]) -> object:
    if _ARRAY in found:
        return _array(found)
    if _SCALAR in found:
        dtype, data = _dtype(found), found.get(b"data")
        if not isinstance(data, int | float | str):
            raise ValueError(f"a NumPy scalar holds {type(data).__name__}")
        return dtype.type(data)
    return found


def _array(found: dict[Any, Any]) -> np.ndarray[Any, Any]:
    dtype, shape, data = _dtype(found), found.get(b"shape"), found.get(b"data")
    if not isinstance(data, bytes):
        raise ValueError(f"the data of an array is {type(data).__name__}, not bytes")
    if not isinstance(shape, list) or not all(type(size) is int and size >= 0 for size in shape):
        raise ValueError(f"the shape of an array is {shape!r}")
    # Python's integers do not overflow: no shape can claim more than there is.
    if math.prod(shape) * dtype.itemsize != len(data):
        raise ValueError(f"an array {dtype.str} of shape {shape} has {len(data)} bytes")
    array: np.ndarray[Any, Any] = np.ndarray(shape=tuple(shape), dtype=dtype, buffer=data)
    array.flags.writeable = False
    return array


def _dtype(found: dict[Any, Any]) -> np.dtype[Any]:
    text = found.get(b"dtype")
    if not isinstance(text, str):
        raise ValueError(f"the dtype of an array is {text!r}")
    dtype = np.dtype(text)
    if dtype.kind in _REFUSED:
        raise ValueError(f"arrays of dtype {text!r} are not accepted")
    return dtype
