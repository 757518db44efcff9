"""Requests over a websocket, one at a time, each with a time limit.

No pings are sent. The published servers compute in the thread that would answer them, so a ping's
time limit would end a connection that is merely slow; the time limit of replies finds a dead one.
"""

from __future__ import annotations

import contextlib
import socket
import struct
import time
from collections.abc import Mapping
from typing import Any, NoReturn

from roboirg.core.errors import (
    PolicyConnectionError,
    PolicyReplyError,
    PolicyTimeoutError,
    RoboIRGError,
)
from roboirg.core.extras import extra_needed
from roboirg.policies.remote.connections import (
    ConnectionSpec,
    RetryableError,
    connect_with_retries,
    error_reply,
    read_reply,
    shut_down,
)
from roboirg.policies.remote.message_codec import pack

with extra_needed("Remote policies need websockets 17.4 or newer", "remote"):
    from websockets.exceptions import (
        ConnectionClosed,
        InvalidStatus,
        TooManyFragments,
        WebSocketException,
    )
    from websockets.protocol import State
    from websockets.sync.client import ClientConnection, connect

CLOSE_TIMEOUT = 2.0
"""Seconds to wait for a server's closing frame."""
_CHECK_S = 1.0
"""Seconds between two looks at whether the library has refused what the server sends."""
_TOO_BIG = 1009
"""Websocket close code for a message above the size limit."""
_RETRYABLE = frozenset({408, 425, 429, 500, 502, 503, 504})
"""HTTP statuses of a server, or of a proxy, while the server starts."""


class WebsocketConnection:
    """A connection to a policy server, open until `close` or an error.

    Args:
        spec: the server, and the limits of waits and replies.

    Raises:
        PolicyConnectionError: the server cannot be reached in time, or refuses.
        PolicyTimeoutError: the server accepts but sends no metadata.
        PolicyReplyError: its metadata are malformed.
    """

    def __init__(self, spec: ConnectionSpec) -> None:
        self.spec, options = spec, spec.options
        self._closing = contextlib.ExitStack()
        self._socket: ClientConnection | None = None
        try:
            self._socket = connect_with_retries(spec, self._attempt)
            _limit_sending(self._socket.socket, options.timeout)
            self._end = time.monotonic() + options.connect
            self.metadata: Mapping[str, Any] = self.read_metadata(options.connect)
        except BaseException:
            self._abort()
            raise

    def request(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Send a message and return the reply; any error closes the connection.

        Raises:
            PolicyConnectionError: the connection broke.
            PolicyTimeoutError: the server took too long.
            PolicyReplyError: the server replied with an error, or with no message.
        """
        seconds = self.spec.options.timeout
        try:
            self._end = time.monotonic() + seconds
            return self.exchange(message, seconds)
        except RoboIRGError:
            self._abort()
            raise

    def close(self) -> None:
        """Close the connection; repeated calls do nothing."""
        self._socket = None
        self._closing.close()

    def _abort(self) -> None:
        """Close the connection to a server that may not take part in that."""
        if self._socket is not None:
            shut_down(self._socket.socket)  # a thread that sends holds the lock that closing needs
        self.close()

    def read_metadata(self, seconds: float) -> Mapping[str, Any]:
        """Return what the server says about itself, which it does first."""
        return read_reply(self.spec, self.receive("its metadata", seconds))

    def exchange(self, message: Mapping[str, Any], seconds: float) -> dict[str, Any]:
        """Send a message and return the reply, within a limit that is being watched."""
        self.send(pack(message))
        return read_reply(self.spec, self.receive("a reply", seconds))

    def refuse_surplus(self, surplus: str | bytes) -> NoReturn:
        """Raise, as an unrequested reply would be taken for the next one.

        Raises:
            PolicyReplyError: always.
        """
        if isinstance(surplus, str):
            raise error_reply(self.spec, surplus)
        raise PolicyReplyError(f"{self.spec} sent a message without a request.")

    def _attempt(self, left: float) -> ClientConnection:
        spec, options, headers = self.spec, self.spec.options, self.spec.options.headers
        try:
            return self._closing.enter_context(
                connect(
                    f"{'wss' if options.tls else 'ws'}://{spec.endpoint}",
                    additional_headers=headers,
                    compression=None,
                    max_size=options.max_reply,
                    open_timeout=max(left, 0.001),
                    close_timeout=CLOSE_TIMEOUT,
                    ping_interval=None,
                    proxy=None,
                    # An explicit address is never redirected to another one.
                    address=(spec.endpoint.host, spec.endpoint.port),
                )
            )
        except InvalidStatus as error:
            status = error.response.status_code
            if status in _RETRYABLE:
                raise RetryableError(f"HTTP status {status}") from error
            hint = "; name the key with api_key_env=NAME" if status in (401, 403) else ""
            raise PolicyConnectionError(
                f"{spec} refused the connection with HTTP status {status}{hint}."
            ) from error
        except socket.gaierror as error:
            raise PolicyConnectionError(
                f"{spec} cannot be reached: there is no host {spec.endpoint.host!r}."
            ) from error
        except (OSError, EOFError, WebSocketException) as error:
            raise RetryableError(_describe(error)) from error
        except ValueError as error:
            raise PolicyConnectionError(f"{spec} refused: {_describe(error)}.") from error

    def send(self, data: bytes) -> None:
        connection = self._open()
        try:
            with contextlib.suppress(TimeoutError):
                self.refuse_surplus(connection.recv(timeout=0))
            connection.send(data)
        except ConnectionClosed as error:
            raise self._broken(error) from error

    def receive(self, what: str, seconds: float) -> bytes:
        """Return the next message; `what` and `seconds` are for the error if there is none."""
        connection, data = self._open(), None
        try:
            while data is None:
                left = self._end - time.monotonic()
                with contextlib.suppress(TimeoutError):
                    data = connection.recv(timeout=min(_CHECK_S, max(0.0, left)))
                if data is None and left <= 0:
                    raise PolicyTimeoutError(
                        f"{self.spec} did not send {what} within {seconds:g} s."
                    )
                if data is None and connection.protocol.state is not State.OPEN:
                    # The server does not end what the library has refused.
                    shut_down(connection.socket)
        except ConnectionClosed as error:
            raise self._broken(error) from error
        if isinstance(data, str):
            raise error_reply(self.spec, data)
        return data

    def _open(self) -> ClientConnection:
        if self._socket is None:
            raise PolicyConnectionError(f"The connection to {self.spec} is closed; call reset().")
        return self._socket

    def _broken(self, error: ConnectionClosed) -> RoboIRGError:
        """Return the error for a connection that has ended."""
        if isinstance(error.__cause__, BlockingIOError):
            seconds = self.spec.options.timeout
            return PolicyTimeoutError(
                f"{self.spec} did not take in a message within {seconds:g} s."
            )
        if isinstance(error.__cause__, TooManyFragments):
            return PolicyReplyError(f"{self.spec} sent a reply in too many pieces.")
        if error.sent is not None and error.sent.code == _TOO_BIG:
            return PolicyReplyError(
                f"{self.spec} sent a reply of more than {self.spec.options.max_reply_mib:g} MiB; "
                "option max_reply_mib raises that limit."
            )
        code = f"close code {error.rcvd.code}" if error.rcvd else "without a close code"
        return PolicyConnectionError(f"{self.spec} ended the connection ({code}).")


def _limit_sending(connection: socket.socket, seconds: float) -> None:
    """Let the kernel end a send that a server does not take in; the library has no limit for it."""
    whole = int(seconds)
    limit = struct.pack("ll", whole, int(1e6 * (seconds - whole)))
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, limit)


def _describe(error: BaseException) -> str:
    if isinstance(error, ConnectionRefusedError):
        return "nothing listens there"
    message = " ".join(str(error).split()).rstrip(".")
    return f"{type(error).__name__}: {message}" if message else type(error).__name__
