"""HTTP for clients that do not trust the server: every response has a time and a size limit."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

from roboirg.core.extras import extra_needed
from roboirg.policies.remote.client.socket_deadline import SocketDeadline

with extra_needed("Policies over HTTP need httpx", "remote"):
    import httpx

_PLAIN = "identity"


class RequestTimeoutError(Exception):
    """Requests took longer than their limit."""


class ResponseTooLargeError(httpx.TransportError):
    """A response is larger than its limit, or compressed, so that its size is unknown."""


class BoundedTransport(httpx.BaseTransport):
    """Sends requests of one thread, one after the other.

    Responses are not unpacked: a few kilobytes may become gigabytes. So none is asked for in
    compressed form, and one that comes so is refused.

    Args:
        max_bytes: size limit of a response's body.
        shortest: seconds of the shortest limit of time.
        tls: whether requests are encrypted; if not, no certificates are loaded, which takes 40 ms.
    """

    def __init__(self, max_bytes: int, shortest: float, *, tls: bool) -> None:
        self._max_bytes, self._shortest, self._tls = max_bytes, shortest, tls
        self._open()

    @contextlib.contextmanager
    def within(self, seconds: float) -> Iterator[None]:
        """Limit the time of the requests in the block, from the first byte to the last.

        Raises:
            RequestTimeoutError: they took longer.
        """
        try:
            with self._deadline.limit(seconds):
                yield
        except Exception as error:
            if self._deadline.passed:
                raise RequestTimeoutError from error
            raise
        finally:
            if self._deadline.passed:  # replace what it has ended
                self.close()
                self._open()

    def handle_request(self, request: httpx.Request) -> httpx.Response:
        """Send a request; see `httpx.BaseTransport`.

        Raises:
            ResponseTooLargeError: the response is compressed, or announces too large a body.
        """
        request.headers["Accept-Encoding"] = _PLAIN
        request.extensions = {**request.extensions, "trace": self._note_socket}
        response = self._inner.handle_request(request)
        if response.headers.get("Content-Encoding", _PLAIN).strip().lower() != _PLAIN:
            response.close()
            raise ResponseTooLargeError("the response is compressed, which was not asked for")
        if not isinstance(response.stream, httpx.SyncByteStream):
            raise TypeError("the transport must be synchronous")
        response.stream = _BoundedStream(response.stream, self._max_bytes)
        return response

    def close(self) -> None:
        """Close all connections; repeated calls do nothing."""
        self._deadline.close()
        self._inner.close()

    def _open(self) -> None:
        self._inner = httpx.HTTPTransport(verify=self._tls, trust_env=False)
        self._deadline = SocketDeadline(self._shortest)

    def _note_socket(self, event: str, info: dict[str, Any]) -> None:
        if event in ("connection.connect_tcp.complete", "connection.start_tls.complete"):
            self._deadline.add(info["return_value"].get_extra_info("socket"))


class _BoundedStream(httpx.SyncByteStream):
    """The body of a response, up to a number of bytes."""

    def __init__(self, stream: httpx.SyncByteStream, max_bytes: int) -> None:
        self._stream, self._left = stream, max_bytes

    def __iter__(self) -> Iterator[bytes]:
        for part in self._stream:
            self._left -= len(part)
            if self._left < 0:
                raise ResponseTooLargeError("the response is too large")
            yield part

    def close(self) -> None:
        """Close the connection."""
        self._stream.close()
