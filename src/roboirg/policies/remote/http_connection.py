"""Requests over HTTP, as the RoboMME challenge's second interface takes them."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from roboirg.core.errors import (
    MissingDependencyError,
    PolicyConnectionError,
    PolicyReplyError,
    PolicyTimeoutError,
)
from roboirg.policies.remote.connections import (
    ConnectionSpec,
    TryAgainError,
    keep_trying,
    read_reply,
    refusal,
)
from roboirg.policies.remote.message_codec import pack

try:
    import httpx
except ImportError as error:
    raise MissingDependencyError(
        "Policies over HTTP need httpx; install roboirgbench[remote]."
    ) from error

MSGPACK = "application/msgpack"
_OK, _SERVER_ERROR = 200, 500
_NOT_YET = frozenset({502, 503, 504})


class HttpConnection:
    """A server that takes `/infer` and, for a message with the key ``reset``, `/reset`.

    Args:
        link: the server, and the limits of every wait and reply.

    Raises:
        PolicyConnectionError: the server cannot be reached in time, or refuses.
        PolicyTimeoutError: the server said nothing.
        PolicyReplyError: it has no metadata that make sense.
    """

    def __init__(self, link: ConnectionSpec) -> None:
        self._link, self._closed = link, False
        self._client: httpx.Client = httpx.Client(
            base_url=f"{'https' if link.options.tls else 'http'}://{link.endpoint}",
            headers={**link.options.headers, "Accept": MSGPACK},
            timeout=httpx.Timeout(link.options.timeout),
            trust_env=False,
        )
        try:
            self.metadata: Mapping[str, Any] = keep_trying(link, self._read_metadata)
        except BaseException:
            self.close()
            raise

    def ask(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Post a message and wait for the reply to it; after any error the connection is closed.

        Raises:
            PolicyConnectionError: the server cannot be reached or went away.
            PolicyTimeoutError: the server took too long.
            PolicyReplyError: the server answered with an error, or with no message.
        """
        if self._closed:
            raise PolicyConnectionError(f"The connection to {self._link} is closed; call reset().")
        path = "/reset" if "reset" in message else "/infer"
        try:
            return self._request("POST", path, pack(message), self._link.options.timeout)
        except httpx.TransportError as error:
            self.close()
            raise PolicyConnectionError(f"{self._link} ended the connection ({error}).") from error
        except (PolicyConnectionError, PolicyTimeoutError, PolicyReplyError):
            self.close()
            raise

    def close(self) -> None:
        """Give the connection up; may be called again."""
        self._closed = True
        self._client.close()

    def _read_metadata(self, left: float) -> dict[str, Any]:
        try:
            return self._request("GET", "/metadata", None, max(left, 0.001))
        except httpx.TransportError as error:
            raise TryAgainError(str(error) or type(error).__name__) from error

    def _request(
        self, method: str, path: str, body: bytes | None, seconds: float
    ) -> dict[str, Any]:
        """One request; what the transport raises is the caller's to explain."""
        link, deadline = self._link, time.monotonic() + seconds
        headers = {"Content-Type": MSGPACK} if body is not None else {}
        try:
            with self._client.stream(
                method, path, content=body, headers=headers, timeout=httpx.Timeout(seconds)
            ) as response:
                data = self._read(response, deadline, seconds)
        except httpx.ConnectTimeout as error:
            raise TryAgainError(f"no answer within {seconds:g} s") from error
        except httpx.TimeoutException as error:
            raise PolicyTimeoutError(f"{link} did not answer within {seconds:g} s.") from error
        if response.status_code in _NOT_YET and body is None:
            raise TryAgainError(f"HTTP status {response.status_code}")
        if response.status_code == _SERVER_ERROR:
            raise refusal(link, data.decode("utf-8", "replace"))
        if response.status_code != _OK:
            raise PolicyConnectionError(
                f"{link} answered {path} with HTTP status {response.status_code}."
            )
        return read_reply(link, data)

    def _read(self, response: httpx.Response, deadline: float, seconds: float) -> bytes:
        """The body, within its limits: httpx knows only of the time between two pieces."""
        parts, size, options = [], 0, self._link.options
        for part in response.iter_bytes():
            size += len(part)
            if size > options.max_reply:
                raise PolicyReplyError(
                    f"{self._link} sent a reply of more than {options.max_reply_mib:g} MiB; "
                    "option max_reply_mib raises that limit."
                )
            if time.monotonic() > deadline:
                raise PolicyTimeoutError(f"{self._link} did not answer within {seconds:g} s.")
            parts.append(part)
        return b"".join(parts)
