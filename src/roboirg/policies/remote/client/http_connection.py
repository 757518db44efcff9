"""Requests over HTTP, the RoboMME challenge's alternative to its WebSocket."""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from collections.abc import Iterator, Mapping
from typing import Any

from roboirg.core.errors import (
    PolicyConnectionError,
    PolicyReplyError,
    PolicyTimeoutError,
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
from roboirg.policies.remote.message_codec import MSGPACK, pack

with extra_needed("Policies over HTTP need httpx", "remote"):
    import httpx

_OK, _SERVER_ERROR = 200, 500
_STARTING = frozenset({502, 503, 504})
"""Statuses that a proxy returns while the server starts."""


class HttpConnection:
    """Posts to ``/infer`` or, if a message has the key ``reset``, to ``/reset``.

    Args:
        spec: the server, and the limits of waits and replies.

    Raises:
        PolicyConnectionError: the server cannot be reached in time, or refuses.
        PolicyTimeoutError: the server does not answer.
        PolicyReplyError: its metadata are malformed.
    """

    def __init__(self, spec: ConnectionSpec) -> None:
        self._spec, self._closed = spec, False
        self._socket: socket.socket | None = None
        options = spec.options
        # A compressed reply would hide its size; so it is neither asked for nor unpacked.
        headers = {**options.headers, "Accept": MSGPACK, "Accept-Encoding": "identity"}
        self._client: httpx.Client = httpx.Client(
            base_url=f"{'https' if options.tls else 'http'}://{spec.endpoint}",
            headers=headers,
            verify=options.tls,  # without TLS no certificates are loaded, which takes 40 ms
            trust_env=False,
        )
        try:
            self.metadata: Mapping[str, Any] = connect_with_retries(spec, self._read_metadata)
        except BaseException:
            self.close()
            raise

    def request(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Post a message and return the reply; any error closes the connection.

        Raises:
            PolicyConnectionError: the server cannot be reached or went away.
            PolicyTimeoutError: the server took too long.
            PolicyReplyError: the server replied with an error, or with no message.
        """
        if self._closed:
            raise PolicyConnectionError(f"The connection to {self._spec} is closed; call reset().")
        path = "/reset" if "reset" in message else "/infer"
        try:
            return self._exchange("POST", path, pack(message), self._spec.options.timeout)
        except (httpx.TransportError, RetryableError) as error:
            self.close()
            raise PolicyConnectionError(f"{self._spec} ended the connection ({error}).") from error
        except (PolicyConnectionError, PolicyTimeoutError, PolicyReplyError):
            self.close()
            raise

    def close(self) -> None:
        """Close the connection; repeated calls do nothing."""
        self._closed = True
        self._client.close()

    def _read_metadata(self, left: float) -> dict[str, Any]:
        try:
            return self._exchange("GET", "/metadata", None, max(left, 0.001))
        except httpx.TransportError as error:
            raise RetryableError(str(error) or type(error).__name__) from error

    def _exchange(
        self, method: str, path: str, body: bytes | None, seconds: float
    ) -> dict[str, Any]:
        """Send one request; the caller handles the errors of the transport."""
        spec, headers = self._spec, {"Content-Type": MSGPACK} if body is not None else {}
        end, content = time.monotonic() + seconds, bytearray()
        limit = f"{round(seconds, 2):g} s"
        try:
            with (
                self._within(seconds),
                self._client.stream(
                    method, path, content=body, headers=headers, timeout=seconds,
                    extensions={"trace": self._note_socket},
                ) as response,
            ):  # fmt: skip
                for piece in response.iter_raw():
                    content += piece
                    if len(content) > spec.options.max_reply:
                        raise PolicyReplyError(
                            f"{spec} sent a reply of more than {spec.options.max_reply_mib:g} "
                            "MiB; option max_reply_mib raises that limit."
                        )
        except httpx.ConnectTimeout as error:
            raise RetryableError(f"no answer within {limit}") from error
        except httpx.TransportError as error:
            if isinstance(error, httpx.TimeoutException) or time.monotonic() > end:
                raise PolicyTimeoutError(f"{spec} did not answer within {limit}.") from error
            raise
        if response.status_code in _STARTING and body is None:
            raise RetryableError(f"HTTP status {response.status_code}")
        if response.status_code == _SERVER_ERROR:
            raise error_reply(spec, content.decode("utf-8", "replace"))
        if response.status_code != _OK:
            raise PolicyConnectionError(
                f"{spec} answered {path} with HTTP status {response.status_code}."
            )
        return read_reply(spec, bytes(content))

    @contextlib.contextmanager
    def _within(self, seconds: float) -> Iterator[None]:
        """End what the block does with the socket after a time.

        The library's limits are those of one read or write: they begin again with every byte.
        """
        timer = threading.Timer(seconds, lambda: shut_down(self._socket))
        timer.daemon = True
        timer.start()
        try:
            yield
        finally:
            timer.cancel()

    def _note_socket(self, event: str, info: dict[str, Any]) -> None:
        if event in ("connection.connect_tcp.complete", "connection.start_tls.complete"):
            self._socket = info["return_value"].get_extra_info("socket")
