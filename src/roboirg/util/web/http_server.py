"""Base classes of the package's HTTP servers."""

from __future__ import annotations

import contextlib
import http.client
import mimetypes
import os
import re
import socket
import sys
import time
from collections.abc import Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, BinaryIO, NamedTuple, cast
from urllib.parse import parse_qsl

from roboirg.core.errors import InvalidValueError
from roboirg.util.web.connection_table import OUT_OF_FILES, ConnectionLimits, ConnectionTable
from roboirg.util.web.request_origin import LOOPBACK, LOOPBACK_NAMES, is_own_request

TEXT_TYPE = "text/plain; charset=utf-8"
HTML_TYPE = "text/html; charset=utf-8"
CHUNK_BYTES = 1 << 16
MAX_HEAD_BYTES = 1 << 16
"""Size of a request's headers, taken together."""
LINGER_S = 2.0
"""How long a client that was refused may go on sending, so that it gets to read why."""
_BUSY = b"HTTP/1.1 503 Service Unavailable\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"
_PAUSE_S = 0.1


class ByteRange(NamedTuple):
    """A range of bytes of a file: the first byte, and one past the last."""

    begin: int
    end: int


class HTTPServerBase(ThreadingHTTPServer):
    """A server with a thread for each connection, within `ConnectionLimits`.

    A client that disconnects or stalls in the middle of a request ends its own connection, without
    a traceback on the terminal.

    Args:
        address: host and port.
        handler: class of the request handler.
        limits: of the connections.

    Attributes:
        connections: that are open.
    """

    daemon_threads = True
    request_queue_size = 128

    def __init__(
        self,
        address: tuple[str, int],
        handler: type[RequestHandler],
        limits: ConnectionLimits | None = None,
    ) -> None:
        self.connections: ConnectionTable[socket.socket] = ConnectionTable(
            limits or ConnectionLimits(), _shut_down
        )
        super().__init__(address, handler)

    def get_request(self) -> tuple[socket.socket, Any]:
        """Accept a connection.

        Raises:
            OSError: there is none, or no place for it; the server goes on.
        """
        try:
            connection, address = super().get_request()
        except OSError as error:
            if error.errno in OUT_OF_FILES and not self.connections.make_room():
                time.sleep(_PAUSE_S)
            raise
        if not self.connections.add(connection):
            with contextlib.suppress(OSError):
                connection.send(_BUSY)
            connection.close()
            raise ConnectionRefusedError("too many connections")
        return connection, address

    def service_actions(self) -> None:
        """End the connections that are late; called by `serve_forever` twice a second."""
        self.connections.end_late()

    def shutdown_request(self, request: Any) -> None:  # noqa: ANN401 - type of the base class
        """Close a connection."""
        self.connections.discard(request)
        super().shutdown_request(request)

    def handle_error(self, request: Any, client_address: Any) -> None:  # noqa: ANN401
        """Print the traceback of an error, unless the client caused it by disconnecting."""
        if not isinstance(sys.exc_info()[1], ConnectionError | TimeoutError):
            super().handle_error(request, client_address)


def _shut_down(connection: socket.socket) -> None:
    """Wake the thread of a connection, which then ends."""
    with contextlib.suppress(OSError):
        connection.shutdown(socket.SHUT_RDWR)


class BrowserServer(HTTPServerBase):
    """A server for browsers.

    Args:
        host: address to listen at.
        port: 0 for any free port.
        handler: class of the request handler.

    Raises:
        InvalidValueError: the port is not available, or the address is not this machine's.
    """

    def __init__(self, host: str, port: int, handler: type[RequestHandler]) -> None:
        try:
            super().__init__((host, port), handler)
        except (OSError, OverflowError) as error:
            place = "" if host == LOOPBACK else f" of {host!r}"
            raise InvalidValueError(
                f"Port {port}{place} is not available ({error}); choose another, or 0 for any "
                "free port."
            ) from error

    @property
    def port(self) -> int:
        """The port on which the server listens."""
        return int(self.server_address[1])


class LoopbackServer(BrowserServer):
    """A server for browsers on this machine only; arguments and errors as for `BrowserServer`."""

    def __init__(self, port: int, handler: type[LoopbackRequestHandler]) -> None:
        super().__init__(LOOPBACK, port, handler)


class RequestHandler(BaseHTTPRequestHandler):
    """Handle the requests of one connection; subclasses define ``do_GET`` and the like."""

    protocol_version = "HTTP/1.1"
    server_version = "roboirg"
    sys_version = ""
    # Send head and body together: in two packets, the second one waits for the client's answer.
    wbufsize = -1
    disable_nagle_algorithm = True
    server: HTTPServerBase

    def setup(self) -> None:
        """Prepare a connection."""
        super().setup()
        self._unread = False

    def handle_one_request(self) -> None:
        """Wait for a request, and answer it within the limits of the server."""
        connections, limits = self.server.connections, self.server.connections.limits
        proven = connections.is_proven(self.connection)
        connections.expect(self.connection, limits.idle_s if proven else limits.request_s)
        # Returns with the first byte.
        cast("Any", self.rfile).peek(1)
        connections.expect(self.connection, limits.request_s)
        super().handle_one_request()

    def parse_request(self) -> bool:
        """Read the head of a request; returns whether to answer it."""
        stream = self.rfile
        self.rfile = cast("Any", _HeadReader(stream))
        try:
            if not super().parse_request():
                return False
        finally:
            self.rfile = stream
        if not self.server.connections.has(self.connection):
            self.close_connection = True  # too late: what was read is not the whole head
            return False
        self.server.connections.expect(self.connection, None)
        # Until it is read; the next request on this connection cannot be found before.
        self._unread = self.headers.get("Content-Length", "0") != "0"
        self.close_connection |= self._unread and self.command != "POST"
        if "Transfer-Encoding" in self.headers:
            self._unread = True
            self.send_refusal(HTTPStatus.LENGTH_REQUIRED)
            return False
        return True

    def handle_expect_100(self) -> bool:
        """Say nothing yet: `read_body` asks for the body once it is wanted."""
        return True

    def finish(self) -> None:
        """End a connection; a client that still sends gets to read the refusal."""
        with contextlib.suppress(OSError):
            if self._unread:
                self.wfile.flush()
                self.connection.shutdown(socket.SHUT_WR)
                self.server.connections.expect(self.connection, LINGER_S)
                while self.connection.recv(CHUNK_BYTES):
                    pass
        super().finish()

    def common_headers(self) -> dict[str, str]:
        """Return the headers of every response."""
        return {"X-Content-Type-Options": "nosniff"}

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002 - name of the base
        """Print nothing: addresses may hold a secret, and the terminal is for the user."""

    def send_head(
        self, status: HTTPStatus, length: int, headers: Mapping[str, str] | None = None
    ) -> None:
        """Send the status and headers of a response of `length` bytes."""
        self.send_response(status)
        if self._unread:
            self.send_header("Connection", "close")  # which sets `close_connection` too
        head = {"Content-Length": str(length), **self.common_headers(), **(headers or {})}
        for name, value in head.items():
            self.send_header(name, value)
        self.end_headers()

    def send_bytes(
        self,
        body: bytes,
        content_type: str,
        status: HTTPStatus = HTTPStatus.OK,
        headers: Mapping[str, str] | None = None,
    ) -> None:
        """Send a response; without its body in answer to HEAD."""
        self.send_head(status, len(body), {"Content-Type": content_type, **(headers or {})})
        if self.command != "HEAD":
            self._write(memoryview(body))

    def send_text(
        self, text: str, content_type: str = TEXT_TYPE, status: HTTPStatus = HTTPStatus.OK
    ) -> None:
        """Send a text, encoded as UTF-8."""
        self.send_bytes(text.encode(), content_type, status)

    def send_refusal(
        self, status: HTTPStatus, message: str = "", headers: Mapping[str, str] | None = None
    ) -> None:
        """Send an error as a line of plain text; by default the status and its phrase."""
        line = f"{message or f'{status.value} {status.phrase}'}\n"
        self.send_bytes(line.encode(), TEXT_TYPE, status, headers)

    def send_redirect(self, address: str) -> None:
        """Send the client to another address with GET."""
        self.send_head(HTTPStatus.SEE_OTHER, 0, {"Location": address})

    def send_file(self, file: BinaryIO, name: str) -> None:
        """Send a file or the range of it that the request asks for.

        Args:
            file: open for reading.
            name: decides the content type.
        """
        size = os.fstat(file.fileno()).st_size
        try:
            wanted = parse_range(self.headers.get("Range"), size)
        except ValueError:
            self.send_refusal(
                HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE,
                headers={"Content-Range": f"bytes */{size}"},
            )
            return
        begin, end = wanted or ByteRange(0, size)
        headers = {
            "Content-Type": mimetypes.guess_type(name)[0] or "application/octet-stream",
            "Accept-Ranges": "bytes",
        }
        status = HTTPStatus.OK
        if wanted is not None:
            headers["Content-Range"] = f"bytes {begin}-{end - 1}/{size}"
            status = HTTPStatus.PARTIAL_CONTENT
        self.send_head(status, end - begin, headers)
        if self.command == "HEAD":
            return
        file.seek(begin)
        left = end - begin
        while left and (data := file.read(min(CHUNK_BYTES, left))):
            self._write(memoryview(data))
            left -= len(data)

    def _write(self, data: memoryview) -> None:
        """Send a part of a response, piece by piece, each within its time."""
        connections = self.server.connections
        for start in range(0, len(data), CHUNK_BYTES):
            connections.expect(self.connection, connections.limits.request_s)
            self.wfile.write(data[start : start + CHUNK_BYTES])

    def read_body(self, limit: int, *, message: str = "") -> bytes | None:
        """Return the body of a request.

        Args:
            limit: largest size, bytes.
            message: of the refusal.

        Returns:
            None if the body has no valid length, is too large (both are refused here) or is cut
            short by a client that disconnects or is late.
        """
        lengths = set(self.headers.get_all("Content-Length", ["0"]))
        length = lengths.pop()
        if lengths or not re.fullmatch(r"[0-9]{1,18}", length):
            self._unread = True
            self.send_refusal(HTTPStatus.BAD_REQUEST)
            return None
        if int(length) > limit:
            self.send_refusal(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, message)
            return None
        if self.headers.get("Expect", "").lower() == "100-continue":
            self.send_response_only(HTTPStatus.CONTINUE)
            self.end_headers()
            self.wfile.flush()
        connections = self.server.connections
        connections.expect(self.connection, connections.limits.body_s)
        body = self.rfile.read(int(length))
        if len(body) < int(length):
            self.close_connection = True
            return None
        connections.expect(self.connection, None)
        self._unread = False
        return body

    def read_form(self, limit: int, *, message: str = "") -> dict[str, str] | None:
        """Return the fields of a form; arguments and None as for `read_body`."""
        body = self.read_body(limit, message=message)
        if body is None:
            return None
        return dict(parse_qsl(body.decode("utf-8", "replace"), keep_blank_values=True))


class LoopbackRequestHandler(RequestHandler):
    """Handle the requests of one connection to a `LoopbackServer`."""

    server: LoopbackServer

    def is_local(self) -> bool:
        """Return whether a request comes from this machine, and from no page of another site."""
        hosts = self.headers.get_all("Host", [])
        origins = self.headers.get_all("Origin", [])
        known = {f"{name}:{self.server.port}" for name in LOOPBACK_NAMES}
        return known.issuperset(hosts) and is_own_request(hosts, origins, LOOPBACK_NAMES)


class _HeadReader:
    """Reads lines of a request's head, up to `MAX_HEAD_BYTES` of them."""

    def __init__(self, stream: Any) -> None:  # noqa: ANN401 - the base class has no narrower type
        self._stream, self._left = stream, MAX_HEAD_BYTES

    def readline(self, size: int) -> bytes:
        line: bytes = self._stream.readline(min(size, self._left + 1))
        self._left -= len(line)
        if self._left < 0:
            raise http.client.LineTooLong("header")  # answered with status 431
        return line


def parse_range(header: str | None, size: int) -> ByteRange | None:
    """Return the bytes that a Range header asks for; None for the whole file.

    Headers that are malformed or ask for several ranges are answered with the whole file, as HTTP
    allows.

    Args:
        header: such as ``bytes=0-99``, ``bytes=100-`` or ``bytes=-100``.
        size: of the file, bytes.

    Raises:
        ValueError: the range is outside the file.
    """
    found = re.fullmatch(r"bytes=(\d{0,18})-(\d{0,18})", (header or "").replace(" ", ""))
    if found is None or not (found[1] or found[2]):
        return None
    if not found[1]:
        begin, end = max(0, size - int(found[2])), size
    else:
        begin, end = int(found[1]), size
        if found[2]:
            if int(found[2]) < begin:
                return None
            end = min(size, int(found[2]) + 1)
    if begin >= end:
        raise ValueError(f"the file has {size} bytes")
    return ByteRange(begin, end)
