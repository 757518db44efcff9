"""What is common to all connections: their limits, and how long to try to open one."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple, Protocol, TypeVar

from roboirg.core.errors import PolicyConnectionError, PolicyReplyError
from roboirg.policies.remote.endpoints import Endpoint, RemoteOptions
from roboirg.policies.remote.message_codec import CodecError, unpack

FIRST_PAUSE, LONGEST_PAUSE = 0.1, 5.0
"""Seconds between two attempts to connect; each pause is twice the one before."""
_LONGEST_WORDS = 300


class ConnectionSpec(NamedTuple):
    """A server and how it is spoken to.

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
    """A connection that is open.

    Attributes:
        metadata: what the server said about itself.
    """

    metadata: Mapping[str, Any]

    def ask(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Send a message and wait for the reply to it.

        Raises:
            PolicyConnectionError: the connection broke.
            PolicyTimeoutError: the server took too long.
            PolicyReplyError: the server answered with an error, or with no message.
        """

    def close(self) -> None:
        """End it; may be called again."""


class TryAgainError(Exception):
    """An attempt to connect failed in a way that may pass, as while a server starts."""


Opened = TypeVar("Opened")


def keep_trying(link: ConnectionSpec, attempt: Callable[[float], Opened]) -> Opened:
    """Connect, again and again if need be.

    Args:
        link: to whom, and for how long to try.
        attempt: one attempt, given the seconds that are left.

    Raises:
        PolicyConnectionError: it did not work in time.
    """
    deadline = time.monotonic() + link.options.connect
    pause = FIRST_PAUSE
    while True:
        try:
            return attempt(deadline - time.monotonic())
        except TryAgainError as error:
            if time.monotonic() + pause >= deadline:
                raise PolicyConnectionError(
                    f"{link} cannot be reached ({error}); tried for {link.options.connect:g} s."
                ) from error
        time.sleep(pause)
        pause = min(2 * pause, LONGEST_PAUSE)


def read_reply(link: ConnectionSpec, data: bytes) -> dict[str, Any]:
    """The message in a reply.

    Raises:
        PolicyReplyError: there is none.
    """
    try:
        return unpack(data)
    except CodecError as error:
        raise PolicyReplyError(f"{link} sent something else than a message: {error}.") from error


def refusal(link: ConnectionSpec, text: str) -> PolicyReplyError:
    """The error of a server that answers with a traceback: its last line tells most."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    words = lines[-1][:_LONGEST_WORDS].rstrip(".") if lines else "an empty text"
    return PolicyReplyError(f"{link} answered with an error: {words}.")
