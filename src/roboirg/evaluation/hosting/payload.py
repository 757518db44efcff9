"""Values with arrays between processes: a tree for the message, bytes for shared memory.

Messages are msgpack maps, so that a policy cannot run code in the process that reads them.
"""

from __future__ import annotations

from multiprocessing import resource_tracker
from multiprocessing.shared_memory import SharedMemory
from typing import Any, NamedTuple

import msgspec
import numpy as np

BLOCK_SIZE = 2 * 2**20
"""Bytes of an episode's shared memory: two pictures with depth, or a part of a video."""
MAX_MESSAGE = 16 * 2**20
"""Largest message that is read; 10,000 actions have 640,000 bytes."""

_ARRAY = "\0array"
_ALIGNMENT = 64

Message = dict[str, Any]


class Payload(NamedTuple):
    """A value with arrays, ready to be sent.

    Attributes:
        tree: the value; arrays are replaced by their type, shape and offset.
        parts: offset and bytes of each array.
        size: bytes of all arrays.
    """

    tree: Any
    parts: tuple[tuple[int, memoryview], ...]
    size: int

    def copy_to(self, target: memoryview, start: int) -> None:
        """Copy the bytes from `start` on to shared memory, as many as it holds."""
        end = start + len(target)
        for offset, data in self.parts:
            first, last = max(offset, start), min(offset + len(data), end)
            if first < last:
                target[first - start : last - start] = data[first - offset : last - offset]


def encode(message: Message) -> bytes:
    """Return a message as bytes."""
    return msgspec.msgpack.encode(message)


def decode(data: bytes) -> Message:
    """Return the message in bytes.

    Raises:
        ValueError: the bytes are no map.
    """
    try:
        message = msgspec.msgpack.decode(data)
    except (msgspec.DecodeError, RecursionError) as error:
        raise ValueError(f"not a message: {error}") from error
    if not isinstance(message, dict):
        raise ValueError(f"not a message: {type(message).__name__}")
    return message


def pack_payload(value: object) -> Payload:
    """Return a value of maps, sequences, texts, numbers and arrays as a payload."""
    parts: list[tuple[int, memoryview]] = []
    size = 0

    def pack(one: Any) -> Any:  # noqa: ANN401
        nonlocal size
        if isinstance(one, dict):
            return {key: pack(item) for key, item in one.items()}
        if isinstance(one, list | tuple):
            return [pack(item) for item in one]
        if not isinstance(one, np.ndarray | np.generic):
            return one
        array = np.asarray(one)
        entry = {_ARRAY: [array.dtype.str, list(array.shape), size]}
        if array.size:
            data = np.ascontiguousarray(array).reshape(-1).view(np.uint8).data
            parts.append((size, data))
            size += -len(data) % _ALIGNMENT + len(data)
        return entry

    tree = pack(value)
    return Payload(tree, tuple(parts), size)


def unpack_payload(tree: Any, data: bytearray) -> Any:  # noqa: ANN401 - whatever was packed
    """Return the value of a payload; its arrays are views of the bytes, sequences are tuples."""
    if isinstance(tree, list):
        return tuple(unpack_payload(item, data) for item in tree)
    if not isinstance(tree, dict):
        return tree
    if _ARRAY not in tree:
        return {key: unpack_payload(item, data) for key, item in tree.items()}
    dtype, shape, offset = tree[_ARRAY]
    return np.ndarray(tuple(shape), np.dtype(dtype), buffer=data, offset=offset)


def buffer_of(block: SharedMemory) -> memoryview:
    """Return the bytes of shared memory.

    Raises:
        ValueError: it has been closed.
    """
    if block.buf is None:
        raise ValueError("the shared memory has been closed")
    return block.buf


def attach_block(name: str) -> SharedMemory:
    """Open the shared memory of another process, which keeps the duty to remove it."""
    # Before Python 3.13, every process that opens a block also removes it at exit.
    register = resource_tracker.register
    resource_tracker.register = lambda *_: None
    try:
        return SharedMemory(name)
    finally:
        resource_tracker.register = register
