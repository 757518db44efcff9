"""Messages between a world, the supervisor of its policy, and the policy's process.

Messages are msgpack with a fixed schema, so that a policy cannot run code in the process that reads
them, nor send what only the supervisor may say: `Lost` is no part of what its process can send.
Arrays travel in shared memory, which is passed on as a descriptor and has no name.
"""

from __future__ import annotations

import fcntl
import mmap
import os
import socket
import tempfile
from multiprocessing.connection import Connection
from typing import Annotated, Any, Literal, NamedTuple

import msgspec
import numpy as np
from msgspec import Meta, Struct

from roboirg.core.field_types import Name
from roboirg.core.inference_facts import InferenceFacts
from roboirg.core.subgoal_text import MOST_SUBGOAL_LETTERS
from roboirg.evaluation.episode_errors import MAX_DETAILS_LENGTH
from roboirg.evaluation.policy_calls import MAX_COSTS, MAX_METADATA_LENGTH
from roboirg.evaluation.records.record import ErrorKind
from roboirg.policies.contract.policy_needs import PolicyNeeds

BLOCK_SIZE = 2 * 2**20
"""Bytes of an episode's shared memory: two pictures with depth, or a part of a video."""
MAX_MESSAGE = 16 * 2**20
"""Largest message that is read; 10,000 actions have 640,000 bytes."""
MAX_TEXT = 2000

_ARRAY = "\0array"
_ALIGNMENT = 64

Text = Annotated[str, Meta(max_length=MAX_TEXT)]
Names = Annotated[tuple[Text, ...], Meta(max_length=64)]


class Call(Struct, forbid_unknown_fields=True, omit_defaults=True):
    """A call of a policy, or the answer to what its process asked.

    Attributes:
        method: of `HostedEpisode`; or ``open``, ``describe``, ``answer``, ``gone``.
        session: number of the episode.
        spec: of the policy, as are its `seed` and whether it is asked `alone`.
        tree: a value, whose arrays are in shared memory.
        size: bytes of all arrays.
        utterances: what was said.
    """

    method: str
    session: int = 0
    spec: str = ""
    seed: int = 0
    alone: bool = False
    tree: Any = None
    size: int = 0
    utterances: tuple[dict[str, Any], ...] = ()


class Ask(Struct, tag="ask", forbid_unknown_fields=True):
    """A question to the world of an episode: fields of the video, or more bytes of an answer."""

    session: int
    fields: Names = ()
    start: Annotated[int, Meta(ge=0)] | None = None


class Opened(Struct, tag="opened", forbid_unknown_fields=True):
    """What a policy is: what it needs, whether it takes batches, what episodes read so far."""

    needs: PolicyNeeds
    version: Name
    together: bool = False
    reads: Names = ()


class Told(Struct, tag="told", forbid_unknown_fields=True):
    """What a policy says of itself: metadata as JSON, costs, what its process computes with."""

    metadata: Annotated[str, Meta(max_length=MAX_METADATA_LENGTH)] = "{}"
    usage: Annotated[dict[Text, float], Meta(max_length=MAX_COSTS)] = {}
    inference: InferenceFacts | None = None


class Acted(Struct, tag="acted", forbid_unknown_fields=True):
    """Actions as bytes of float64, the numbers of each, the seconds that they took, a subgoal."""

    rows: bytes
    size: Annotated[int, Meta(ge=1, le=64)]
    latency_s: Annotated[float, Meta(ge=0, le=1e6)]
    subgoal: Annotated[str, Meta(max_length=MOST_SUBGOAL_LETTERS)] | None = None


class Failure(Struct, tag="failure", forbid_unknown_fields=True):
    """What a policy raised; ``missing`` is a package that is not installed."""

    kind: Literal["policy", "invalid_action", "timeout", "connection", "missing"]
    message: Text
    details: Annotated[str, Meta(max_length=MAX_DETAILS_LENGTH)] = ""


class Lost(Struct, tag="lost", forbid_unknown_fields=True):
    """The supervisor's word that the process is gone.

    Attributes:
        kind: of the error.
        message: how it ended.
        again: whether the episode is played again, because it is not to blame.
        alone: whether it must not be asked about together with others then.
    """

    kind: ErrorKind
    message: str
    again: bool = False
    alone: bool = False


Outcome = Opened | Told | Acted | Failure


class Reply(Struct, tag="reply", forbid_unknown_fields=True):
    """What the supervisor replies to a world.

    Attributes:
        outcome: of the call.
        seconds: that the call took, without waiting for others.
        output: what the policy printed.
    """

    outcome: Opened | Told | Acted | Failure | Lost
    seconds: float = 0.0
    output: bytes = b""


encode = msgspec.msgpack.encode
read_call = msgspec.msgpack.Decoder(Call).decode
read_calls = msgspec.msgpack.Decoder(list[Call]).decode
read_child = msgspec.msgpack.Decoder(Ask | list[Outcome]).decode
"""Reads what a policy's process sends."""
read_supervisor = msgspec.msgpack.Decoder(Ask | Reply).decode


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

    def copy_to(self, target: memoryview | mmap.mmap, start: int) -> None:
        """Copy the bytes from `start` on to shared memory, as many as it holds."""
        end = start + len(target)
        for offset, data in self.parts:
            first, last = max(offset, start), min(offset + len(data), end)
            if first < last:
                target[first - start : last - start] = data[first - offset : last - offset]


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


def new_block() -> int:
    """Return the descriptor of new shared memory, whose size a policy cannot change on Linux."""
    if not hasattr(os, "memfd_create"):
        with tempfile.TemporaryFile() as file:
            file.truncate(BLOCK_SIZE)
            return os.dup(file.fileno())
    descriptor = os.memfd_create("roboirg", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
    os.ftruncate(descriptor, BLOCK_SIZE)
    fcntl.fcntl(
        descriptor, fcntl.F_ADD_SEALS, fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | fcntl.F_SEAL_SEAL
    )
    return descriptor


def map_block(descriptor: int) -> mmap.mmap:
    """Return the shared memory of a descriptor, which is closed."""
    try:
        return mmap.mmap(descriptor, BLOCK_SIZE)
    finally:
        os.close(descriptor)


def send_descriptor(connection: Connection, descriptor: int) -> None:
    """Give another process a descriptor; it calls `receive_descriptor`."""
    with socket.socket(fileno=os.dup(connection.fileno())) as line:
        socket.send_fds(line, [b"\0"], [descriptor])


def receive_descriptor(connection: Connection) -> int:
    """Return the descriptor that another process sends.

    Raises:
        EOFError: it sends none.
    """
    with socket.socket(fileno=os.dup(connection.fileno())) as line:
        _, descriptors, *_ = socket.recv_fds(line, 1, 1)
    if not descriptors:
        raise EOFError
    return descriptors[0]
