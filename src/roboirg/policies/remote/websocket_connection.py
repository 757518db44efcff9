"""Requests over a websocket, one at a time, each with a time limit.

No pings are sent. The published servers compute in the thread that would answer them, so a ping's
time limit would end a connection that is merely slow; the time limit of replies finds a dead one.
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
    RetryableError,
    connect_with_retries,
    error_reply,
    read_reply,
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
"""Seconds to wait for a server's closing frame."""
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
        self._spec = spec
        self._closing = contextlib.ExitStack()
        self._socket: ClientConnection | None = connect_with_retries(spec, self._attempt)
        self._write_timed_out = False
        # The library has no time limit for sending. The socket's own would also end the receiving
        # thread, and it starts again with every piece that the peer takes in.
        self._write_timeout = WriteTimeout(
            spec.options.timeout, partial(self._abort_write, self._socket)
        )
        self._closing.callback(self._write_timeout.close)
        self.metadata: Mapping[str, Any] = self._receive(
            "its metadata", spec.options.connect, time.monotonic() + spec.options.connect
        )

    def request(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Send a message and return the reply; any error closes the connection.

        Raises:
            PolicyConnectionError: the connection broke.
            PolicyTimeoutError: the server took too long.
            PolicyReplyError: the server replied with an error, or with no message.
        """
        seconds = self._spec.options.timeout
        deadline = time.monotonic() + seconds
        self._send(pack(message))
        return self._receive("a reply", seconds, deadline)

    def close(self) -> None:
        """Close the connection; repeated calls do nothing."""
        self._socket = None
        self._closing.close()

    def _attempt(self, left: float) -> ClientConnection:
        spec, options = self._spec, self._spec.options
        try:
            return self._closing.enter_context(
                connect(
                    f"{'wss' if options.tls else 'ws'}://{spec.endpoint}",
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

    def _send(self, data: bytes) -> None:
        connection = self._open()
        try:
            self._reject_surplus(connection)
            with self._write_timeout.watching():
                connection.send(data)
        except ConnectionClosed as error:
            raise self._broken(error) from error

    def _abort_write(self, connection: ClientConnection) -> None:
        """Shut the socket down, from another thread, to wake the thread that sends."""
        self._write_timed_out = True
        with contextlib.suppress(OSError):
            connection.socket.shutdown(socket.SHUT_RDWR)

    def _reject_surplus(self, connection: ClientConnection) -> None:
        """Raise if an unrequested reply has come, which would be taken for the next one."""
        try:
            surplus = connection.recv(timeout=0)
        except TimeoutError:
            return
        self.close()
        if isinstance(surplus, str):
            raise error_reply(self._spec, surplus)
        raise PolicyReplyError(f"{self._spec} sent a message without a request.")

    def _receive(self, what: str, seconds: float, deadline: float) -> dict[str, Any]:
        connection = self._open()
        try:
            data = connection.recv(timeout=max(deadline - time.monotonic(), 0.0))
        except TimeoutError as error:
            self.close()
            raise PolicyTimeoutError(
                f"{self._spec} did not send {what} within {seconds:g} s."
            ) from error
        except ConnectionClosed as error:
            raise self._broken(error) from error
        try:
            if isinstance(data, str):
                raise error_reply(self._spec, data)
            return read_reply(self._spec, data)
        except PolicyReplyError:
            self.close()
            raise

    def _open(self) -> ClientConnection:
        if self._socket is None:
            raise PolicyConnectionError(f"The connection to {self._spec} is closed; call reset().")
        return self._socket

    def _broken(self, error: ConnectionClosed) -> RoboIRGError:
        """Close, and return the error for a connection that has ended."""
        self.close()
        if error.sent is not None and error.sent.code == _TOO_BIG:
            return PolicyReplyError(
                f"{self._spec} sent a reply of more than {self._spec.options.max_reply_mib:g} MiB; "
                "option max_reply_mib raises that limit."
            )
        if self._write_timed_out:
            return PolicyTimeoutError(
                f"{self._spec} did not take in a message within {self._spec.options.timeout:g} s."
            )
        code = f"close code {error.rcvd.code}" if error.rcvd else "without a close code"
        return PolicyConnectionError(f"{self._spec} ended the connection ({code}).")


def _describe(error: BaseException) -> str:
    if isinstance(error, ConnectionRefusedError):
        return "nothing listens there"
    message = " ".join(str(error).split()).rstrip(".")
    return f"{type(error).__name__}: {message}" if message else type(error).__name__
