"""One websocket connection: requests and replies in turn, and every wait has an end.

No pings are sent. The published servers compute in the thread that would answer them, so that a
ping's time limit kills what is merely slow; what is dead is noticed by the time limit of replies.
"""

from __future__ import annotations

import contextlib
import socket
import time
from collections.abc import Mapping
from functools import partial
from typing import Any

from roboirg.core.errors import (
    MissingDependencyError,
    PolicyConnectionError,
    PolicyReplyError,
    PolicyTimeoutError,
    RoboIRGError,
)
from roboirg.policies.remote.connections import (
    ConnectionSpec,
    TryAgainError,
    keep_trying,
    read_reply,
    refusal,
)
from roboirg.policies.remote.message_codec import pack
from roboirg.policies.remote.write_timeout import WriteTimeout

try:
    from websockets.exceptions import ConnectionClosed, InvalidStatus, WebSocketException
    from websockets.sync.client import ClientConnection, connect
except ImportError as error:
    raise MissingDependencyError(
        "Remote policies need websockets 15 or newer; install roboirgbench[remote]."
    ) from error

CLOSE_TIMEOUT = 2.0
"""Seconds to wait for a server's farewell."""
_TOO_BIG = 1009
"""Websocket close code of whoever was sent too much."""
_PASSING = frozenset({408, 425, 429, 500, 502, 503, 504})
"""HTTP statuses that a server or a proxy in front of it may have while it starts."""


class WebsocketConnection:
    """A connection to a policy server, open until it is closed or something goes wrong.

    Args:
        link: the server, and the limits of every wait and reply.

    Raises:
        PolicyConnectionError: no connection came about in time, or the server refused it.
        PolicyTimeoutError: the server accepted it and then said nothing.
        PolicyReplyError: the server began with something else than its metadata.
    """

    def __init__(self, link: ConnectionSpec) -> None:
        self._link = link
        self._closing = contextlib.ExitStack()
        self._socket: ClientConnection | None = keep_trying(link, self._attempt)
        self._gave_up = False
        # The library has no time limit for sending. The socket's own would also end the thread that
        # receives, and begins anew with every piece that is taken in.
        self._limit = WriteTimeout(link.options.timeout, partial(self._give_up, self._socket))
        self._closing.callback(self._limit.close)
        self.metadata: Mapping[str, Any] = self._receive(
            "its metadata", link.options.connect, time.monotonic() + link.options.connect
        )

    def ask(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Send a message and wait for the reply to it; after any error the connection is closed.

        Raises:
            PolicyConnectionError: the connection broke.
            PolicyTimeoutError: the server took too long.
            PolicyReplyError: the server answered with an error, or with no message.
        """
        seconds = self._link.options.timeout
        deadline = time.monotonic() + seconds
        self._send(pack(message))
        return self._receive("a reply", seconds, deadline)

    def close(self) -> None:
        """Say farewell; may be called again."""
        self._socket = None
        self._closing.close()

    def _attempt(self, left: float) -> ClientConnection:
        link, options = self._link, self._link.options
        try:
            return self._closing.enter_context(
                connect(
                    f"{'wss' if options.tls else 'ws'}://{link.endpoint}",
                    additional_headers=options.headers,
                    compression=None,
                    max_size=options.max_reply,
                    open_timeout=max(left, 0.001),
                    close_timeout=CLOSE_TIMEOUT,
                    ping_interval=None,
                    proxy=None,
                )
            )
        except InvalidStatus as error:
            status = error.response.status_code
            if status in _PASSING:
                raise TryAgainError(f"HTTP status {status}") from error
            hint = "; its key is named with api_key_env=NAME" if status in (401, 403) else ""
            raise PolicyConnectionError(
                f"{link} refused the connection with HTTP status {status}{hint}."
            ) from error
        except socket.gaierror as error:
            raise PolicyConnectionError(
                f"{link} cannot be reached: there is no computer {link.endpoint.host!r}."
            ) from error
        except (OSError, EOFError, WebSocketException) as error:
            raise TryAgainError(_words(error)) from error

    def _send(self, data: bytes) -> None:
        connection = self._open()
        try:
            self._refuse_surplus(connection)
            with self._limit.watching():
                connection.send(data)
        except ConnectionClosed as error:
            raise self._broken(error) from error

    def _give_up(self, connection: ClientConnection) -> None:
        """Wake the thread that sends, by another one."""
        self._gave_up = True
        with contextlib.suppress(OSError):
            connection.socket.shutdown(socket.SHUT_RDWR)

    def _refuse_surplus(self, connection: ClientConnection) -> None:
        """A reply that nobody asked for would be taken for the next one."""
        try:
            surplus = connection.recv(timeout=0)
        except TimeoutError:
            return
        self.close()
        if isinstance(surplus, str):
            raise refusal(self._link, surplus)
        raise PolicyReplyError(f"{self._link} sent a message that nobody had asked for.")

    def _receive(self, what: str, seconds: float, deadline: float) -> dict[str, Any]:
        connection = self._open()
        try:
            data = connection.recv(timeout=max(deadline - time.monotonic(), 0.0))
        except TimeoutError as error:
            self.close()
            raise PolicyTimeoutError(
                f"{self._link} did not send {what} within {seconds:g} s."
            ) from error
        except ConnectionClosed as error:
            raise self._broken(error) from error
        try:
            if isinstance(data, str):
                raise refusal(self._link, data)
            return read_reply(self._link, data)
        except PolicyReplyError:
            self.close()
            raise

    def _open(self) -> ClientConnection:
        if self._socket is None:
            raise PolicyConnectionError(f"The connection to {self._link} is closed; call reset().")
        return self._socket

    def _broken(self, error: ConnectionClosed) -> RoboIRGError:
        """The error for a connection that has ended."""
        self.close()
        if error.sent is not None and error.sent.code == _TOO_BIG:
            return PolicyReplyError(
                f"{self._link} sent a reply of more than {self._link.options.max_reply_mib:g} MiB; "
                "option max_reply_mib raises that limit."
            )
        if self._gave_up:
            return PolicyTimeoutError(
                f"{self._link} did not take in a message within {self._link.options.timeout:g} s."
            )
        code = f"close code {error.rcvd.code}" if error.rcvd else "without a farewell"
        return PolicyConnectionError(f"{self._link} ended the connection ({code}).")


def _words(error: BaseException) -> str:
    if isinstance(error, ConnectionRefusedError):
        return "nothing listens there"
    words = " ".join(str(error).split()).rstrip(".")
    return f"{type(error).__name__}: {words}" if words else type(error).__name__
