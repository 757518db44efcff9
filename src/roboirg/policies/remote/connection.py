"""The connection to a policy server: a lock on it, a websocket, and the time limits of both.

No pings are sent. The published servers compute in the thread that would answer them, so a ping's
time limit would end a connection that is merely slow; the time limit of replies finds a dead one.
"""

from __future__ import annotations

import contextlib
import socket
import struct
import time
from collections.abc import Sequence
from typing import Any

from roboirg.core.errors import (
    PolicyConnectionError,
    PolicyReplyError,
    PolicyTimeoutError,
    RoboIRGError,
)
from roboirg.core.extras import extra_needed
from roboirg.core.handed_keys import bytes_without_keys, without_keys
from roboirg.core.waiting import waiting
from roboirg.policies.remote.endpoints import MIB, Endpoint, RemoteOptions
from roboirg.policies.remote.message_codec import CodecError, unpack
from roboirg.policies.remote.server_lock import lock_server

with extra_needed("Remote policies need websockets 17.4 or newer", "remote"):
    from websockets.exceptions import (
        ConnectionClosed,
        InvalidStatus,
        TooManyFragments,
        WebSocketException,
    )
    from websockets.protocol import State
    from websockets.sync.client import ClientConnection, connect

FIRST_PAUSE = 0.1
MAX_PAUSE = 5.0
"""Seconds between two attempts to connect; each pause is twice the one before."""
CLOSE_TIMEOUT = 2.0
"""Seconds to wait for a server's closing frame."""
_CHECK_S = 1.0
"""Seconds between two looks at whether the library has refused what the server sends."""
_TOO_BIG = 1009
"""Websocket close code for a message above the size limit."""
_RETRYABLE = frozenset({408, 425, 429, 500, 502, 503, 504})
"""HTTP statuses of a server, or of a proxy, while the server starts."""
_REFUSED_KEY = (401, 403)
"""HTTP statuses of a server to which the client has sent no key, or a wrong one."""
_MIN_TIMEOUT = 0.001
"""Seconds that an attempt to connect has at least."""
_MICROSECONDS = 1_000_000
"""In a second."""
_MAX_ERROR_LENGTH = 300
_MOST_SHOWN = 80
"""Bytes of what is no message in an error."""
_MAX_TRACEBACK_END = 4096


class ServerConnection:
    """One episode's use of a server: `begin`, any number of `exchange`, `end`; can begin again.

    Args:
        scheme: of the policy's URL.
        endpoints: the servers to choose from.
        options: limits and headers.

    Attributes:
        endpoint: the server in use, or the last one; at first, the first to choose from.
    """

    def __init__(self, scheme: str, endpoints: Sequence[Endpoint], options: RemoteOptions) -> None:
        """Note the servers and options; `begin` connects."""
        self._scheme = scheme
        self._endpoints = endpoints
        self._options = options
        self.endpoint = endpoints[0]
        self._websocket: ClientConnection | None = None
        self._held = contextlib.ExitStack()
        """The lock, and connections."""

    def __str__(self) -> str:
        return f"Policy server {self._scheme}://{self.endpoint}"

    def begin(self) -> None:
        """Lock a server and connect to it.

        Raises:
            PolicyTimeoutError: all servers were in use for too long.
            PolicyConnectionError: it cannot be reached in time, or refuses.
        """
        self.end()
        options = self._options
        lock = lock_server(self._endpoints, wait=options.wait, shared=options.shared)
        self._held.enter_context(lock.file)
        self.endpoint = lock.endpoint
        self._connect()

    def exchange(
        self, data: bytes | None, awaited: str = "a reply", *, is_numbered: bool = False
    ) -> dict[str, Any]:
        """Send a message, and return the one that comes next.

        Args:
            data: the message; None to send nothing, as the server speaks first.
            awaited: what comes next, in words; empty to wait for nothing, and return ``{}``.
            is_numbered: whether messages name what they answer. If not, a message that is there
                before the request is refused, as it would be taken for the reply.

        Raises:
            PolicyConnectionError: the connection broke, or there is none.
            PolicyTimeoutError: the server took too long.
            PolicyReplyError: the server replied with an error, or with no message.
        """
        websocket = self._websocket
        if websocket is None:
            raise PolicyConnectionError(f"{self} is not connected; call reset() first.")
        seconds = self._options.connect if data is None else self._options.timeout
        end = time.monotonic() + seconds
        try:
            with waiting(f"the reply of {self._scheme}://{self.endpoint}"):
                if data is not None:
                    if not is_numbered:
                        self._refuse_surplus(websocket)
                    websocket.send(data)
                if not awaited:
                    return {}
                message = _next_message(websocket, end)
        except ConnectionClosed as error:
            raise self._broken(error, len(data or b"")) from error
        if message is None:
            raise PolicyTimeoutError(f"{self} did not send {awaited} within {seconds:g} s.")
        return self._read(message)

    def end(self, *, is_broken: bool = False) -> None:
        """Disconnect and unlock the server; repeated calls do nothing.

        A broken connection is ended without the server, which may not take part in that.
        """
        websocket = self._websocket
        self._websocket = None
        if is_broken and websocket is not None:
            _shut_down(websocket)  # a thread that sends holds the lock that closing needs
        self._held.close()

    def error_reply(self, text: str) -> PolicyReplyError:
        """Return the error for what a server has sent about one, such as a traceback.

        Its last line is shown.
        """
        text = without_keys(text)  # before it is cut, perhaps within a key
        # Only the end is split into lines: there may be millions.
        lines = text[-_MAX_TRACEBACK_END:].rstrip().splitlines()
        words = "an empty text"
        if lines:
            words = lines[-1].strip()[:_MAX_ERROR_LENGTH].rstrip(".")
        return PolicyReplyError(f"{self} replied with an error: {words}.")

    def _connect(self) -> None:
        """Connect to the chosen server, with growing pauses between attempts.

        Raises:
            PolicyConnectionError: it could not be reached in time, or another attempt cannot help.
        """
        seconds = self._options.connect
        pause = FIRST_PAUSE
        end = time.monotonic() + seconds
        with waiting(f"a connection to {self._scheme}://{self.endpoint}"):
            found = self._attempt(end - time.monotonic())
            while isinstance(found, str):  # why there is no connection yet
                if time.monotonic() + pause >= end:
                    raise PolicyConnectionError(
                        f"{self} cannot be reached ({found}); tried for {seconds:g} s."
                    )
                time.sleep(pause)
                pause = min(2 * pause, MAX_PAUSE)
                found = self._attempt(end - time.monotonic())
        # The library has no limit for a send that a server does not take in; the kernel's is set.
        # It is a C struct of seconds and microseconds.
        whole_seconds = int(self._options.timeout)
        microseconds = int(_MICROSECONDS * (self._options.timeout - whole_seconds))
        limit = struct.pack("ll", whole_seconds, microseconds)
        found.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, limit)
        self._websocket = found

    def _attempt(self, left: float) -> ClientConnection | str:
        """Return a connection, or why there is none yet; raise if another attempt cannot help.

        The connection is closed by `end`.

        Args:
            left: seconds that are left to connect.

        Returns:
            The connection; or the reason in words, ``"HTTP status 503"``: the server may still be
                starting.
        """
        endpoint = self.endpoint
        scheme = "wss" if self._options.tls else "ws"
        headers = self._options.headers
        try:
            return self._held.enter_context(
                connect(
                    f"{scheme}://{endpoint}",
                    additional_headers=headers,
                    compression=None,
                    max_size=int(self._options.max_reply_mib * MIB),
                    open_timeout=max(left, _MIN_TIMEOUT),
                    close_timeout=CLOSE_TIMEOUT,
                    ping_interval=None,
                    proxy=None,
                    # An explicit address is never redirected to another one.
                    address=(endpoint.host, endpoint.port),
                )
            )
        except InvalidStatus as error:
            status = error.response.status_code
            if status in _RETRYABLE:
                return f"HTTP status {status}"
            hint = ""
            if status in _REFUSED_KEY:
                hint = "; name the key with api_key_env=NAME"
            raise PolicyConnectionError(
                f"{self} refused the connection with HTTP status {status}{hint}."
            ) from error
        except socket.gaierror as error:
            raise PolicyConnectionError(
                f"{self} cannot be reached: there is no host {endpoint.host!r}."
            ) from error
        except (OSError, EOFError, WebSocketException) as error:
            return _describe(error)
        except ValueError as error:
            raise PolicyConnectionError(f"{self} refused: {_describe(error)}.") from error

    def _refuse_surplus(self, websocket: ClientConnection) -> None:
        """Raise if there is a message before the request: it would be taken for the reply."""
        with contextlib.suppress(TimeoutError):
            surplus = websocket.recv(timeout=0)
            if isinstance(surplus, str):
                raise self.error_reply(surplus)
            raise PolicyReplyError(f"{self} sent a message without a request.")

    def _read(self, data: bytes | str) -> dict[str, Any]:
        """Return the message that a server has sent; a text is an error of the server.

        Keys that this process has sent are replaced by asterisks first.

        Raises:
            PolicyReplyError: it is a text, or no message.
        """
        if isinstance(data, str):
            raise self.error_reply(data)
        data = bytes_without_keys(data)
        try:
            return unpack(data)
        except CodecError as error:
            raise PolicyReplyError(
                f"{self} sent something other than a message: {error}; it begins "
                f"{data[:_MOST_SHOWN]!r}."
            ) from error

    def _broken(self, error: ConnectionClosed, sent: int) -> RoboIRGError:
        """Return (not raise) the error for a connection that has ended, by what is known of it.

        Args:
            error: of the library.
            sent: bytes of the message to the server.
        """
        if isinstance(error.__cause__, BlockingIOError):
            seconds = self._options.timeout
            return PolicyTimeoutError(f"{self} did not take in a message within {seconds:g} s.")
        if isinstance(error.__cause__, TooManyFragments):
            return PolicyReplyError(f"{self} sent a reply in too many pieces.")
        # Whoever receives a close code sends it back, so it is that of the side that sent it first.
        if error.rcvd_then_sent and error.rcvd is not None and error.rcvd.code == _TOO_BIG:
            return PolicyReplyError(
                f"{self} does not take messages of {sent:,} bytes; raise its limit."
            )
        if error.sent is not None and error.sent.code == _TOO_BIG:
            return PolicyReplyError(
                f"{self} sent a reply of more than {self._options.max_reply_mib:g} MiB; "
                "option max_reply_mib raises that limit."
            )
        code = "without a close code"
        if error.rcvd is not None:
            code = f"close code {error.rcvd.code}: {without_keys(error.rcvd.reason)}".rstrip(": ")
        return PolicyConnectionError(f"{self} ended the connection ({code}).")


def _next_message(websocket: ClientConnection, end: float) -> bytes | str | None:
    """Return the next message of a server; None if none comes until `end` of the monotonic clock.

    It is waited for in pieces of `_CHECK_S`, to see whether the library has refused a message
    meanwhile.

    Raises:
        ConnectionClosed: the connection broke.
    """
    left = end - time.monotonic()
    while left > 0:
        with contextlib.suppress(TimeoutError):
            return websocket.recv(timeout=min(_CHECK_S, left))
        if websocket.state is not State.OPEN:
            # The library has refused a message and waits for the server to close; that may never.
            _shut_down(websocket)
        left = end - time.monotonic()
    return None


def _shut_down(websocket: ClientConnection) -> None:
    """Shut a socket down, which wakes the threads that use it.

    The state of TLS is left alone, as another thread may be in the middle of it.
    """
    with contextlib.suppress(OSError):
        socket.socket.shutdown(websocket.socket, socket.SHUT_RDWR)


def _describe(error: BaseException) -> str:
    """Return why a connection failed, such as ``OSError: Network is unreachable``."""
    if isinstance(error, ConnectionRefusedError):
        return "nothing listens there"
    kind = type(error).__name__
    message = " ".join(str(error).split()).rstrip(".")
    return f"{kind}: {message}" if message else kind
