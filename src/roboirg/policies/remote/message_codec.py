"""Messages as bytes: msgpack with NumPy arrays, as in openpi, MME-VLA and RoboMME.

An array is a map with four keys of type bytes: ``__ndarray__`` (true), ``data`` (C order),
``dtype`` (such as ``<f4``) and ``shape``; a NumPy scalar one with ``__npgeneric__``, ``data`` and
``dtype``. vla-eval's keys are texts, and its scalars plain numbers. The package msgpack-numpy has
``nd``, ``type`` and ``kind`` instead. All are read, wherever they occur. Nothing is unpickled.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

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


class CodecError(ValueError):
    """Malformed bytes, or a message that cannot be encoded."""


def pack(message: Mapping[str, Any], *, text_keys: bool = False) -> bytes:
    """Return a message as bytes; maps keep their order.

    Args:
        message: what to send.
        text_keys: whether to describe arrays as vla-eval does.

    Raises:
        CodecError: it holds something that cannot be encoded.
    """
    try:
        packed: bytes = msgpack.packb(message, default=partial(_encode, text_keys))
    except (TypeError, ValueError, OverflowError) as error:
        raise CodecError(f"the message cannot be encoded ({error})") from error
    return packed


def unpack(data: bytes) -> dict[str, Any]:
    """Return the message in bytes; its arrays are read-only views of them.

    Raises:
        CodecError: the bytes are malformed.
    """
    try:
        message = msgpack.unpackb(data, object_hook=_decode)
    except (*_MALFORMED, msgpack.exceptions.UnpackException) as error:
        words = " ".join(str(error).split()) or type(error).__name__
        raise CodecError(f"the bytes are not a msgpack message ({words})") from error
    if not isinstance(message, dict):
        raise CodecError(f"the message is of type {type(message).__name__}, not a map")
    for key in message:
        if not isinstance(key, str):
            raise CodecError(f"the message has a key {repr(key)[:_MAX_SHOWN]} that is not a text")
    return message


def _encode(text_keys: bool, value: object) -> object:
    """Return an array or scalar of NumPy in a form that msgpack can pack; `_decode` reverses it.

    Args:
        text_keys: the dialect. If true, an array is a map with texts as keys and a scalar a plain
            number; else both are maps, with bytes as keys.
        value: of the message.

    Raises:
        TypeError: it is not of NumPy.
        ValueError: its dtype is not sent.
    """
    if not isinstance(value, np.ndarray | np.generic):
        raise TypeError(f"type {type(value).__name__} cannot be encoded")
    if value.dtype.kind in _UNSUPPORTED:
        raise ValueError(f"arrays of dtype {value.dtype} are not sent")
    if isinstance(value, np.ndarray):
        # A view, as pictures are large: a contiguous array is copied once, into the message.
        data = np.ascontiguousarray(value).reshape(-1).view(np.uint8).data
        packed = {"__ndarray__": True, "data": data, "dtype": value.dtype.str, "shape": value.shape}
    elif text_keys:
        return value.item()
    else:
        packed = {"__npgeneric__": True, "data": value.item(), "dtype": value.dtype.str}
    if text_keys:
        return packed
    return {key.encode(): entry for key, entry in packed.items()}


def _decode(packed: dict[Any, Any]) -> object:
    """Return what a map of a message stands for: an array, a scalar, or the map itself.

    ``{b"__ndarray__": True, b"data": …, b"dtype": "<f4", b"shape": [8]}`` -> an array (8,). Maps of
    all dialects are read: ours with texts or bytes as keys, and those of msgpack-numpy. msgpack
    calls this for every map, the innermost first.
    """
    entries: dict[Any, Any] = {}
    for key, value in packed.items():
        name = key.decode("latin-1") if isinstance(key, bytes) else key
        entries[name] = value
    if "__ndarray__" in entries:
        return _array(entries.get("dtype"), entries.get("shape"), entries.get("data"))
    if "__npgeneric__" in entries:
        return _scalar(entries.get("dtype"), entries.get("data"))
    # Of msgpack-numpy. If a map has a kind, it is a structure or pickled object, which is not read.
    is_array = "nd" in entries and "type" in entries and "data" in entries
    if is_array and not entries.get("kind"):
        return _array(entries["type"], entries.get("shape", []), entries["data"])
    return packed


def _scalar(described: object, data: object) -> object:
    """Return a scalar of NumPy from the description of its dtype and its value."""
    dtype = _dtype(described)
    if not isinstance(data, int | float | str):
        raise ValueError(f"a NumPy scalar holds {type(data).__name__}")
    return dtype.type(data)


def _array(described: object, shape: Any, data: object) -> np.ndarray[Any, Any]:  # noqa: ANN401
    """Return the array that a message describes by dtype (such as ``<f4``), shape and bytes.

    Raises:
        ValueError: they do not fit each other, or the dtype is not accepted.
    """
    dtype = _dtype(described)
    if not isinstance(data, bytes):
        raise ValueError(f"the data of an array is {type(data).__name__}, not bytes")
    try:
        return np.frombuffer(data, dtype).reshape(shape)  # read-only, as the bytes are
    except (TypeError, ValueError) as error:
        shown = str(shape)[:_MAX_SHOWN]
        raise ValueError(f"an array {dtype.str} of shape {shown} has {len(data)} bytes") from error


def _dtype(text: object) -> np.dtype[Any]:
    """Return the dtype that a text such as ``<f4`` describes.

    Raises:
        ValueError: it is no text, too long, or not accepted: Python objects are never read.
    """
    if not isinstance(text, str) or len(text) > _MAX_DTYPE_LENGTH:
        raise ValueError(f"the dtype of an array is {str(text)[:_MAX_DTYPE_LENGTH]!r}")
    dtype = np.dtype(text)
    if dtype.kind in _UNSUPPORTED:
        raise ValueError(f"arrays of dtype {text!r} are not accepted")
    return dtype
