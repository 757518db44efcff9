"""Messages between a world, the policy's process that it speaks with, and the supervisor of both.

Messages are msgpack with a fixed schema, so that a policy cannot run code in the process that reads
them. The bytes of arrays follow a call; what comes from a policy's process has none. Descriptors,
such as a line's other end, travel with a request.
"""

from __future__ import annotations

import contextlib
import os
import socket
from collections.abc import Callable
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
from roboirg.policies.contract.policy_calls import MAX_COSTS, MAX_METADATA_LENGTH
from roboirg.records.record import ErrorKind
from roboirg.runs.episode_errors import MAX_DETAILS_LENGTH

MAX_MESSAGE = 16 * 2**20
"""Largest message that is read from a policy; 10,000 actions have 640,000 bytes."""
MAX_TEXT = 2000
MAX_OUTPUT = 256 * 2**10
"""Bytes that are kept of what a policy prints in a call."""
DRAW_S = 600
"""How long a world may take to draw."""

_SIZE_BYTES = 8
_ARRAY = 1
"""Code of the extension type of msgpack that stands for an array: its type and shape."""
_LINE_BUFFER = 2**20
_MOST_JOINED = 8 * 2**20
"""Bytes that are copied to be sent at once, which wakes the receiver once."""

TimeLeft = Callable[[], float]
"""Returns the seconds that the next piece of a message may take.

It raises `TimeoutError` when the time for the whole message is over."""

Text = Annotated[str, Meta(max_length=MAX_TEXT)]
ShortTexts = Annotated[tuple[Text, ...], Meta(max_length=64)]


class HostRequest(Struct, forbid_unknown_fields=True, omit_defaults=True):
    """What a world asks of the supervisor, and the supervisor of a policy's process.

    Attributes:
        method: ``open`` serves an episode, whose line comes with it; ``leave`` ends that. ``loss``
            asks how the process ended, ``kill`` ends it. ``check`` asks how long a call may wait
            for its turn, and ends the process if it begins nothing more.
        policy: that is meant.
        limit_s: how long a call may take.
        batch: most episodes that the policy is asked about together.
    """

    method: Literal["open", "leave", "loss", "kill", "check"]
    policy: PolicyRef | None = None
    limit_s: float = 0.0
    batch: int = 1


class Call(Struct, forbid_unknown_fields=True, omit_defaults=True):
    """A call of a policy, or the answer to what its process asked.

    Attributes:
        method: of the policy; or ``open``, ``describe``, ``answer``, ``gone``.
        policy: that is meant, as are its `seed` and whether it is asked `alone`.
        value: what the method gets: maps, sequences, texts, numbers and arrays.
    """

    method: str
    policy: PolicyRef | None = None
    seed: int = 0
    alone: bool = False
    value: Any = None


class Begun(Struct, tag="begun", forbid_unknown_fields=True):
    """A call was waiting for its turn and begins now, maybe `together` with those of others."""

    together: bool = False


class Question(Struct, tag="question", forbid_unknown_fields=True):
    """A policy's process asks the world for fields of the video."""

    fields: ShortTexts = ()


class Outcome(Struct, tag="outcome", forbid_unknown_fields=True, omit_defaults=True):
    """What a call of a policy came to; each method has its own fields.

    Attributes:
        error: kind of what the policy raised, ``missing`` for a package that is not installed; None
            if it raised nothing.
        message: of the exception.
        details: its traceback.
        needs: what the policy needs.
        version: of the policy.
        reads: fields of videos that its episodes have read so far.
        metadata: JSON.
        usage: costs of the episode.
        inference: what its process computes with, after `reset`.
        rows: actions as bytes of float64.
        size: numbers in an action.
        subgoal: that the policy named with them.
        output: what it has printed since the last outcome.
    """

    error: Literal["policy", "invalid_action", "timeout", "connection", "missing"] | None = None
    message: Text = ""
    details: Annotated[str, Meta(max_length=MAX_DETAILS_LENGTH)] = ""
    needs: PolicyNeeds = PolicyNeeds()
    version: Name = "unknown"
    reads: ShortTexts = ()
    metadata: Annotated[str, Meta(max_length=MAX_METADATA_LENGTH)] = "{}"
    usage: Annotated[dict[Text, float], Meta(max_length=MAX_COSTS)] = {}
    inference: InferenceFacts | None = None
    rows: bytes = b""
    size: Annotated[int, Meta(ge=1, le=64)] = 1
    subgoal: Annotated[str, Meta(max_length=MOST_SUBGOAL_LETTERS)] | None = None
    output: bytes = b""


class Loss(Struct):
    """How a policy's process ended.

    Attributes:
        kind: of the error.
        words: for its cause.
        output: what it has printed since its last outcome.
        was_ended: whether it was killed for something else than what the world that asks did.
    """

    kind: ErrorKind
    words: str
    output: bytes = b""
    was_ended: bool = False


read_child = msgspec.msgpack.Decoder(Begun | Question | Outcome).decode
"""Reads what a policy's process sends."""
_read_array = msgspec.msgpack.Decoder(tuple[str, tuple[int, ...]]).decode


def new_line() -> tuple[socket.socket, socket.socket]:
    """Return both ends of a line, which takes in a call with two pictures at once."""
    ends = socket.socketpair()
    for end in ends:
        end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _LINE_BUFFER)
    return ends


def ask(line: socket.socket, request: HostRequest, passed: socket.socket | None = None) -> None:
    """Send a request, and with it the end of a line, in one piece."""
    data = msgspec.msgpack.encode(request)
    descriptors = [] if passed is None else [passed.fileno()]
    socket.send_fds(line, [_size_bytes(data) + data], descriptors)


def receive_request(line: socket.socket) -> tuple[HostRequest, socket.socket | None]:
    """Return the next request of a line, and the socket that was passed with it; None without one.

    Raises:
        EOFError: the line was closed.
    """
    head, descriptors, _, _ = socket.recv_fds(line, _SIZE_BYTES, 1)
    if not head:
        raise EOFError
    data = bytearray(int.from_bytes(head, "big"))
    _fill(line, data)
    request = msgspec.msgpack.decode(data, type=HostRequest)
    passed = socket.socket(fileno=descriptors[0]) if descriptors else None
    return request, passed


def send(line: socket.socket, message: object, time_left: TimeLeft | None = None) -> None:
    """Send a message: its size, the message as msgpack, and the bytes of its arrays.

    Args:
        line: a socket.
        message: of plain data and arrays.
        time_left: asked before each piece; None for a line without a time limit.

    Raises:
        TimeoutError: the other end did not take in all of it in time.
        TypeError: it holds something other than plain data and arrays.
    """
    parts = _message_parts(message)
    # Small parts are sent at once, so that the receiver wakes only once.
    if sum(len(part) for part in parts) <= _MOST_JOINED:
        parts = [b"".join(parts)]
    for part in parts:
        _send_all(line, part, time_left)


def _message_parts(message: object) -> list[bytes | memoryview]:
    """Return the parts of a message as they are sent, one after the other.

    They are the size of the message, the message itself, in which an array is replaced by its type
    and shape, and the bytes of each array.
    """
    arrays = []

    def set_aside(value: object) -> Ext:
        """Leave an array's type and shape in the message; its bytes are sent after that."""
        if not isinstance(value, np.ndarray | np.generic):
            raise TypeError(f"{type(value).__name__} is not sent to policies")
        array = np.asarray(value)
        arrays.append(np.ascontiguousarray(array).reshape(-1).view(np.uint8).data)
        return Ext(_ARRAY, msgspec.msgpack.encode((array.dtype.str, array.shape)))

    data = msgspec.msgpack.encode(message, enc_hook=set_aside)
    return [_size_bytes(data), data, *arrays]


def _size_bytes(data: bytes) -> bytes:
    """Return the size of a message as it leads the message."""
    return len(data).to_bytes(_SIZE_BYTES, "big")


def _send_all(line: socket.socket, part: bytes | memoryview, time_left: TimeLeft | None) -> None:
    """Send bytes piece by piece, as the other end takes them in.

    `time_left` returns how long the next piece may take, in seconds, and raises `TimeoutError` when
    the time is over; None for no limit.
    """
    unsent = memoryview(part)
    while unsent:
        if time_left is not None:
            line.settimeout(time_left())
        with contextlib.suppress(TimeoutError):  # the next `time_left` raises it if it is the last
            sent = line.send(unsent)
            unsent = unsent[sent:]


def receive(
    line: socket.socket, limit: int | None = None, time_left: TimeLeft | None = None
) -> bytearray:
    """Return the bytes of the next message of a line.

    Args:
        line: a socket.
        limit: most bytes of a message.
        time_left: asked before each piece; None for a line without a time limit.

    Raises:
        EOFError: the line was closed.
        TimeoutError: not all of it came in time.
        ValueError: the message is larger than the limit.
    """
    head = bytearray(_SIZE_BYTES)
    _fill(line, head, time_left)
    size = int.from_bytes(head, "big")
    if limit is not None and size > limit:
        raise ValueError(f"a message of {size:,} bytes; at most {limit:,} are read")
    data = bytearray(size)
    _fill(line, data, time_left)
    return data


def receive_call(line: socket.socket) -> Call:
    """Return the next call of a line, with its arrays.

    The message has only the type and the shape of an array; its bytes follow on the line, in the
    same order, and are received while the message is decoded. The sender is our own code, so sizes
    are trusted.

    Raises:
        EOFError: the line was closed.
    """

    def receive_array(_code: int, packed: memoryview) -> np.ndarray[Any, Any]:
        """Return an array by its type and shape; its bytes follow on the line."""
        dtype, shape = _read_array(packed)
        array = np.empty(shape, np.dtype(dtype))
        _fill(line, array.reshape(-1).view(np.uint8).data)
        return array

    return msgspec.msgpack.decode(receive(line), type=Call, ext_hook=receive_array)


def _fill(
    line: socket.socket, buffer: bytearray | memoryview, time_left: TimeLeft | None = None
) -> None:
    """Receive bytes from a line until a buffer is full.

    `time_left` returns how long the next piece may take, in seconds, and raises `TimeoutError` when
    the time is over; None for no limit.

    Raises:
        EOFError: the line was closed.
    """
    unfilled = memoryview(buffer)
    while unfilled:
        if time_left is not None:
            line.settimeout(time_left())
        try:
            count = line.recv_into(unfilled, 0, socket.MSG_WAITALL)
        except TimeoutError:  # the next `time_left` raises it if it is the last
            continue
        if count == 0:
            raise EOFError
        unfilled = unfilled[count:]


def take_output(file: int, *, keep: bool = False) -> bytes:
    """Return what a policy's process has printed into a file, cut to `MAX_OUTPUT` bytes.

    Args:
        file: a file descriptor.
        keep: whether the file keeps it; else the file is emptied.
    """
    output = os.pread(file, MAX_OUTPUT + 1, 0)
    if output and not keep:
        os.ftruncate(file, 0)
    if len(output) <= MAX_OUTPUT:
        return output
    return output[:MAX_OUTPUT] + b"\n[roboirg: what else this call printed is left out]\n"
