"""Messages as bytes: msgpack with NumPy arrays, as in openpi, MME-VLA and RoboMME.

An array is a map with four keys of type bytes: ``__ndarray__`` (true), ``data`` (C order),
``dtype`` (such as ``<f4``) and ``shape``; a NumPy scalar one with ``__npgeneric__``, ``data`` and
``dtype``. Nothing is unpickled.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from roboirg.core.errors import MissingDependencyError
from roboirg.policies.remote.message_size import MessageSizeError, check_size

try:
    import msgpack
except ImportError as error:
    raise MissingDependencyError(
        "Remote policies need msgpack; install roboirgbench[remote]."
    ) from error

_ARRAY, _SCALAR = b"__ndarray__", b"__npgeneric__"
_UNSUPPORTED = "VOc"
"""Kinds of dtype that are not sent: structures, Python objects, complex numbers."""
_MALFORMED = (ValueError, TypeError, OverflowError, RecursionError, SyntaxError)
"""Raised by msgpack and NumPy for malformed bytes."""
_MAX_AXES, _MAX_DTYPE_LENGTH = 32, 32


class CodecError(ValueError):
    """Malformed bytes, or a message that cannot be encoded."""


def pack(message: Mapping[str, Any]) -> bytes:
    """Return a message as bytes; maps keep their order.

    Raises:
        CodecError: it holds something that cannot be encoded.
    """
    try:
        packed: bytes = msgpack.packb(message, default=_encode)
    except (TypeError, ValueError, OverflowError) as error:
        raise CodecError(f"the message cannot be encoded ({error})") from error
    return packed


def unpack(data: bytes) -> dict[str, Any]:
    """Return the message in bytes; its arrays are read-only views of them.

    Raises:
        CodecError: the bytes are malformed.
    """
    try:
        check_size(data)
        message = msgpack.unpackb(data, object_hook=_decode)
    except MessageSizeError as error:
        raise CodecError(str(error)) from error
    except (*_MALFORMED, msgpack.exceptions.UnpackException) as error:
        words = " ".join(str(error).split()) or type(error).__name__
        raise CodecError(f"the bytes are not a msgpack message ({words})") from error
    if not isinstance(message, dict):
        raise CodecError(f"the message is of type {type(message).__name__}, not a map")
    for key in message:
        if not isinstance(key, str):
            raise CodecError(f"the message has a key {key!r} that is not a text")
    return message


def _encode(value: object) -> dict[bytes, Any]:
    if not isinstance(value, np.ndarray | np.generic):
        raise TypeError(f"type {type(value).__name__} cannot be encoded")
    if value.dtype.kind in _UNSUPPORTED:
        raise ValueError(f"arrays of dtype {value.dtype} are not sent")
    if isinstance(value, np.ndarray):
        return {
            _ARRAY: True,
            # A view, as pictures are large: a contiguous array is copied once, into the message.
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
    if len(shape) > _MAX_AXES:
        raise ValueError(f"an array has {len(shape)} axes; at most {_MAX_AXES} are accepted")
    # Python's integers do not overflow, so no shape can claim more bytes than there are.
    if math.prod(shape) * dtype.itemsize != len(data):
        raise ValueError(f"an array {dtype.str} of shape {shape} has {len(data)} bytes")
    array: np.ndarray[Any, Any] = np.ndarray(shape=tuple(shape), dtype=dtype, buffer=data)
    array.flags.writeable = False
    return array


def _dtype(found: dict[Any, Any]) -> np.dtype[Any]:
    text = found.get(b"dtype")
    if not isinstance(text, str) or len(text) > _MAX_DTYPE_LENGTH:
        raise ValueError(f"the dtype of an array is {str(text)[:_MAX_DTYPE_LENGTH]!r}")
    dtype = np.dtype(text)
    if dtype.kind in _UNSUPPORTED:
        raise ValueError(f"arrays of dtype {text!r} are not accepted")
    return dtype
