"""Messages as bytes: msgpack with NumPy arrays, as in openpi, MME-VLA and RoboMME.

An array is a map with four keys of type bytes: ``__ndarray__`` (true), ``data`` (C order),
``dtype`` (such as ``<f4``) and ``shape``; a NumPy scalar one with ``__npgeneric__``, ``data`` and
``dtype``. vla-eval's keys are texts, and its scalars plain numbers. Nothing is unpickled.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from roboirg.core.extras import extra_needed

with extra_needed("Remote policies need msgpack", "remote"):
    import msgpack

_UNSUPPORTED = "VOc"
"""Kinds of dtype that are not sent: structures, Python objects, complex numbers."""
_MALFORMED = (ValueError, TypeError, OverflowError, RecursionError, SyntaxError)
"""Raised by msgpack and NumPy for malformed bytes."""
_MAX_DTYPE_LENGTH = 32
_MAX_SHOWN = 80


class ArrayKeys(NamedTuple):
    """Keys of the maps that stand for arrays and scalars; without `scalar`, those are numbers."""

    array: str | bytes
    scalar: str | bytes | None
    data: str | bytes
    dtype: str | bytes
    shape: str | bytes


BYTES_KEYS = ArrayKeys(b"__ndarray__", b"__npgeneric__", b"data", b"dtype", b"shape")
TEXT_KEYS = ArrayKeys("__ndarray__", None, "data", "dtype", "shape")


class CodecError(ValueError):
    """Malformed bytes, or a message that cannot be encoded."""


def pack(message: Mapping[str, Any], keys: ArrayKeys = BYTES_KEYS) -> bytes:
    """Return a message as bytes; maps keep their order.

    Raises:
        CodecError: it holds something that cannot be encoded.
    """
    try:
        packed: bytes = msgpack.packb(message, default=partial(_encode, keys))
    except (TypeError, ValueError, OverflowError) as error:
        raise CodecError(f"the message cannot be encoded ({error})") from error
    return packed


def unpack(data: bytes, keys: ArrayKeys = BYTES_KEYS) -> dict[str, Any]:
    """Return the message in bytes; its arrays are read-only views of them.

    Raises:
        CodecError: the bytes are malformed.
    """
    try:
        message = msgpack.unpackb(data, object_hook=partial(_decode, keys))
    except (*_MALFORMED, msgpack.exceptions.UnpackException) as error:
        words = " ".join(str(error).split()) or type(error).__name__
        raise CodecError(f"the bytes are not a msgpack message ({words})") from error
    if not isinstance(message, dict):
        raise CodecError(f"the message is of type {type(message).__name__}, not a map")
    for key in message:
        if not isinstance(key, str):
            raise CodecError(f"the message has a key {repr(key)[:_MAX_SHOWN]} that is not a text")
    return message


def _encode(keys: ArrayKeys, value: object) -> object:
    if not isinstance(value, np.ndarray | np.generic):
        raise TypeError(f"type {type(value).__name__} cannot be encoded")
    if value.dtype.kind in _UNSUPPORTED:
        raise ValueError(f"arrays of dtype {value.dtype} are not sent")
    if isinstance(value, np.ndarray):
        return {
            keys.array: True,
            # A view, as pictures are large: a contiguous array is copied once, into the message.
            keys.data: np.ascontiguousarray(value).reshape(-1).view(np.uint8).data,
            keys.dtype: value.dtype.str,
            keys.shape: value.shape,
        }
    if keys.scalar is None:
        return value.item()
    return {keys.scalar: True, keys.data: value.item(), keys.dtype: value.dtype.str}


def _decode(keys: ArrayKeys, found: dict[Any, Any]) -> object:
    if keys.array in found:
        return _array(keys, found)
    if keys.scalar is not None and keys.scalar in found:
        dtype, data = _dtype(keys, found), found.get(keys.data)
        if not isinstance(data, int | float | str):
            raise ValueError(f"a NumPy scalar holds {type(data).__name__}")
        return dtype.type(data)
    return found


def _array(keys: ArrayKeys, found: dict[Any, Any]) -> np.ndarray[Any, Any]:
    dtype, shape, data = _dtype(keys, found), found.get(keys.shape), found.get(keys.data)
    if not isinstance(data, bytes):
        raise ValueError(f"the data of an array is {type(data).__name__}, not bytes")
    if not isinstance(shape, list):
        raise ValueError(f"the shape of an array is {repr(shape)[:_MAX_SHOWN]}")
    try:
        return np.frombuffer(data, dtype).reshape(shape)  # read-only, as the bytes are
    except (TypeError, ValueError) as error:
        shown = str(shape)[:_MAX_SHOWN]
        raise ValueError(f"an array {dtype.str} of shape {shown} has {len(data)} bytes") from error


def _dtype(keys: ArrayKeys, found: dict[Any, Any]) -> np.dtype[Any]:
    text = found.get(keys.dtype)
    if not isinstance(text, str) or len(text) > _MAX_DTYPE_LENGTH:
        raise ValueError(f"the dtype of an array is {str(text)[:_MAX_DTYPE_LENGTH]!r}")
    dtype = np.dtype(text)
    if dtype.kind in _UNSUPPORTED:
        raise ValueError(f"arrays of dtype {text!r} are not accepted")
    return dtype


MSGPACK = "application/msgpack"
