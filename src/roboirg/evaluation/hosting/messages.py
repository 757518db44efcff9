"""Messages between a world, the supervisor of its policy, and the policy's process.

Messages are msgpack with a fixed schema, so that a policy cannot run code in the process that reads
them, nor send what only the supervisor may say: `Reply` is no part of what its process can send.
The bytes of arrays follow a call; what comes from a policy's process has none.
"""

from __future__ import annotations

import socket
from typing import Annotated, Any, Literal

import msgspec
import numpy as np
from msgspec import Meta, Struct
from msgspec.msgpack import Ext

from roboirg.core.field_types import Name
from roboirg.core.inference_facts import InferenceFacts
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.core.policy_ref import PolicyRef
from roboirg.core.subgoal_text import MOST_SUBGOAL_LETTERS
from roboirg.evaluation.episode_errors import MAX_DETAILS_LENGTH
from roboirg.evaluation.records.record import ErrorKind
from roboirg.policies.contract.policy_calls import MAX_COSTS, MAX_METADATA_LENGTH

MAX_MESSAGE = 16 * 2**20
"""Largest message that is read from a policy; 10,000 actions have 640,000 bytes."""
MAX_TEXT = 2000

_SIZE_BYTES = 8
_ARRAY = 1
"""Code of the extension type of msgpack that stands for an array: its type and shape."""
_MOST_JOINED = 8 * 2**20
"""Bytes that are copied to be sent at once, which wakes the receiver once."""

Text = Annotated[str, Meta(max_length=MAX_TEXT)]
Names = Annotated[tuple[Text, ...], Meta(max_length=64)]


class Call(Struct, forbid_unknown_fields=True, omit_defaults=True):
    """A call of a policy, or the answer to what its process asked.

    Attributes:
        method: of the policy; or ``open``, ``describe``, ``answer``, ``gone``.
        session: number of the episode.
        policy: that is meant, as are its `seed` and whether it is asked `alone`.
        value: what the method gets: maps, sequences, texts, numbers and arrays.
    """

    method: str
    session: int = 0
    policy: PolicyRef | None = None
    seed: int = 0
    alone: bool = False
    value: Any = None


class Question(Struct, tag="question", forbid_unknown_fields=True):
    """A policy's process asks the world of an episode for fields of the video."""

    session: int
    fields: Names = ()


class Outcome(Struct, tag="outcome", forbid_unknown_fields=True, omit_defaults=True):
    """What a call of a policy came to; each method has its own fields.

    Attributes:
        error: kind of what the policy raised, ``missing`` for a package that is not installed; None
            if it raised nothing.
        message: of the exception.
        details: its traceback.
        needs: what the policy needs.
        version: of the policy.
        together: whether it can be asked about several episodes at once.
        reads: fields of videos that its episodes have read so far.
        metadata: JSON.
        usage: costs of the episode.
        inference: what its process computes with, after `reset`.
        rows: actions as bytes of float64.
        size: numbers in an action.
        subgoal: that the policy named with them.
    """

    error: Literal["policy", "invalid_action", "timeout", "connection", "missing"] | None = None
    message: Text = ""
    details: Annotated[str, Meta(max_length=MAX_DETAILS_LENGTH)] = ""
    needs: PolicyNeeds = PolicyNeeds()
    version: Name = "unknown"
    together: bool = False
    reads: Names = ()
    metadata: Annotated[str, Meta(max_length=MAX_METADATA_LENGTH)] = "{}"
    usage: Annotated[dict[Text, float], Meta(max_length=MAX_COSTS)] = {}
    inference: InferenceFacts | None = None
    rows: bytes = b""
    size: Annotated[int, Meta(ge=1, le=64)] = 1
    subgoal: Annotated[str, Meta(max_length=MOST_SUBGOAL_LETTERS)] | None = None


class Reply(Struct, tag="reply", forbid_unknown_fields=True, omit_defaults=True):
    """What the supervisor replies to a world.

    Attributes:
        outcome: of the call; None if the policy's process was lost.
        seconds: that the call took, without waiting for others.
        output: what the policy printed.
        kind: of the error, if the process was lost.
        message: how it ended.
        again: whether the episode is played again, because it is not to blame.
        alone: whether it must not be asked about together with others then.
    """

    outcome: Outcome | None = None
    seconds: float = 0.0
    output: bytes = b""
    kind: ErrorKind = "infrastructure"
    message: str = ""
    again: bool = False
    alone: bool = False


read_child = msgspec.msgpack.Decoder(Question | list[Outcome]).decode
"""Reads what a policy's process sends."""
read_supervisor = msgspec.msgpack.Decoder(Question | Reply).decode
_read_array = msgspec.msgpack.Decoder(tuple[str, tuple[int, ...]]).decode


def send(line: socket.socket, message: object) -> None:
    """Send a message, led by its size and followed by the bytes of its arrays.

    Raises:
        TypeError: it holds something other than plain data and arrays.
    """
    arrays: list[memoryview] = []

    def pack(value: object) -> Ext:
        if not isinstance(value, np.ndarray | np.generic):
            raise TypeError(f"{type(value).__name__} is not sent to policies")
        array = np.asarray(value)
        arrays.append(np.ascontiguousarray(array).reshape(-1).view(np.uint8).data)
        return Ext(_ARRAY, msgspec.msgpack.encode((array.dtype.str, array.shape)))

    data = msgspec.msgpack.encode(message, enc_hook=pack)
    parts: list[bytes | memoryview] = [len(data).to_bytes(_SIZE_BYTES, "big"), data, *arrays]
    if sum(map(len, parts)) <= _MOST_JOINED:
        parts = [b"".join(parts)]
    for part in parts:
        line.sendall(part)


def receive(line: socket.socket, limit: int | None = None) -> bytearray:
    """Return the next message of a line, which has no arrays.

    Raises:
        EOFError: the line was closed.
        ValueError: the message is larger than the limit.
    """
    head = bytearray(_SIZE_BYTES)
    _fill(line, head)
    size = int.from_bytes(head, "big")
    if limit is not None and size > limit:
        raise ValueError(f"a message of {size:,} bytes; at most {limit:,} are read")
    data = bytearray(size)
    _fill(line, data)
    return data


def receive_calls(line: socket.socket) -> list[Call]:
    """Return the next calls of a line, with arrays of their own; the sender is ours.

    Raises:
        EOFError: the line was closed.
    """

    def unpack(_code: int, packed: memoryview) -> np.ndarray[Any, Any]:
        dtype, shape = _read_array(packed)
        array = np.empty(shape, np.dtype(dtype))
        _fill(line, array.reshape(-1).view(np.uint8).data)
        return array

    return msgspec.msgpack.decode(receive(line), type=list[Call], ext_hook=unpack)


def _fill(line: socket.socket, buffer: bytearray | memoryview) -> None:
    left = memoryview(buffer)
    while left:
        count = line.recv_into(left, 0, socket.MSG_WAITALL)
        if count == 0:
            raise EOFError
        left = left[count:]
