"""What all connections share: their limits, retries while opening, and the reading of replies."""

from __future__ import annotations

import contextlib
import socket
import time
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeVar

from roboirg.core.errors import PolicyConnectionError, PolicyReplyError
from roboirg.policies.remote.endpoints import Endpoint, RemoteOptions

if TYPE_CHECKING:
    from roboirg.policies.remote.message_codec import ArrayKeys

FIRST_PAUSE, MAX_PAUSE = 0.1, 5.0
"""Seconds between two attempts to connect; each pause is twice the one before."""
_MAX_ERROR_LENGTH = 300
_MAX_TRACEBACK_END = 4096


class ConnectionSpec(NamedTuple):
    """A server and the options of its connections.

    Attributes:
        scheme: of the policy's URL.
        endpoint: the server.
        options: limits and headers.
    """

    scheme: str
    endpoint: Endpoint
    options: RemoteOptions

    def __str__(self) -> str:
        return f"Policy server {self.scheme}://{self.endpoint}"


class Connection(Protocol):
    """An open connection.

    Attributes:
        metadata: the server's description of itself.
    """

    metadata: Mapping[str, Any]

    def request(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Send a message and return the reply to it.

        Raises:
            PolicyConnectionError: the connection broke.
            PolicyTimeoutError: the server took too long.
            PolicyReplyError: the server replied with an error, or with no message.
        """

    def close(self) -> None:
        """Close the connection; repeated calls do nothing."""


class RetryableError(Exception):
    """An attempt to connect failed in a way that may pass, as while a server starts."""


Opened = TypeVar("Opened")


def connect_with_retries(spec: ConnectionSpec, attempt: Callable[[float], Opened]) -> Opened:
    """Connect, with growing pauses between attempts.

    Args:
        spec: the server; ``connect`` of its options limits the time.
        attempt: one attempt, called with the seconds that are left.

    Raises:
        PolicyConnectionError: every attempt within the limit failed.
    """
    deadline = time.monotonic() + spec.options.connect
    pause = FIRST_PAUSE
    while True:
        try:
            return attempt(deadline - time.monotonic())
        except RetryableError as error:
            if time.monotonic() + pause >= deadline:
                raise PolicyConnectionError(
                    f"{spec} cannot be reached ({error}); tried for {spec.options.connect:g} s."
                ) from error
        time.sleep(pause)
        pause = min(2 * pause, MAX_PAUSE)


def read_reply(spec: ConnectionSpec, data: bytes, keys: ArrayKeys | None = None) -> dict[str, Any]:
    """Return the message in a reply; its arrays are described by `keys`, or by the usual ones.

    Raises:
        PolicyReplyError: the bytes are no message.
    """
    from roboirg.policies.remote.message_codec import BYTES_KEYS, CodecError, unpack

    try:
        return unpack(data, keys or BYTES_KEYS)
    except CodecError as error:
        raise PolicyReplyError(f"{spec} sent something other than a message: {error}.") from error


def error_reply(spec: ConnectionSpec, text: str) -> PolicyReplyError:
    """Return the error for a server's traceback, of which the last line says most."""
    # Only the end is split into lines: there may be millions.
    lines = text[-_MAX_TRACEBACK_END:].rstrip().splitlines()
    words = lines[-1].strip()[:_MAX_ERROR_LENGTH].rstrip(".") if lines else "an empty text"
    return PolicyReplyError(f"{spec} replied with an error: {words}.")


def shut_down(connection: socket.socket | None) -> None:
    """Wake the thread that uses a socket, also one with TLS, whose state is left alone."""
    if connection is not None:
        with contextlib.suppress(OSError):
            socket.socket.shutdown(connection, socket.SHUT_RDWR)
