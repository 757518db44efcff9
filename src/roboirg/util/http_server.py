"""Base classes of the package's HTTP servers."""

from __future__ import annotations

import mimetypes
import os
import re
import sys
from collections.abc import Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, BinaryIO, NamedTuple
from urllib.parse import parse_qsl

from roboirg.core.errors import InvalidValueError

LOOPBACK = "127.0.0.1"
LOOPBACK_NAMES = (LOOPBACK, "localhost")
TEXT_TYPE = "text/plain; charset=utf-8"
HTML_TYPE = "text/html; charset=utf-8"
CHUNK_BYTES = 1 << 16


class ByteRange(NamedTuple):
    """A range of bytes of a file: the first byte, and one past the last."""

    begin: int
    end: int


class HTTPServerBase(ThreadingHTTPServer):
    """A server with a thread for each connection.

    A client that disconnects or stalls in the middle of a request ends its own connection, without
    a traceback on the terminal.
    """

    daemon_threads = True

    def handle_error(self, request: Any, client_address: Any) -> None:  # noqa: ANN401
        """Print the traceback of an error, unless the client caused it by disconnecting."""
        if not isinstance(sys.exc_info()[1], ConnectionError | TimeoutError):
            super().handle_error(request, client_address)


class LoopbackServer(HTTPServerBase):
    """A server for browsers on this machine only.

    Args:
        port: 0 for any free port.
        handler: class of the request handler.

    Raises:
        InvalidValueError: the port is not available.
    """

    def __init__(self, port: int, handler: type[LoopbackRequestHandler]) -> None:
        try:
            super().__init__((LOOPBACK, port), handler)
        except (OSError, OverflowError) as error:
            raise InvalidValueError(
                f"Port {port} is not available ({error}); choose another, or 0 for any free port."
            ) from error

    @property
    def port(self) -> int:
        """The port on which the server listens."""
        return int(self.server_address[1])


class RequestHandler(BaseHTTPRequestHandler):
    """Handle the requests of one connection; subclasses define ``do_GET`` and the like."""

    protocol_version = "HTTP/1.1"
    server_version = "roboirg"
    sys_version = ""
    # Send head and body together: in two packets, the second one waits for the client's answer.
    wbufsize = -1
    disable_nagle_algorithm = True

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
            self.wfile.write(body)

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
            self.wfile.write(data)
            left -= len(data)

    def read_body(self, limit: int, *, message: str = "") -> bytes | None:
        """Return the body of a request.

        Args:
            limit: largest size, bytes.
            message: of the refusal.

        Returns:
            None if the body has no valid length, is too large (both are refused here) or is cut
            short by a client that disconnects.
        """
        length = self.headers.get("Content-Length", "0")
        if not re.fullmatch(r"[0-9]{1,18}", length) or int(length) > limit:
            # The body is not read, so the next request on this connection cannot be found.
            self.close_connection = True
            self.send_refusal(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, message)
            return None
        body = self.rfile.read(int(length))
        if len(body) < int(length):
            self.close_connection = True
            return None
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
        """Return whether a request comes from a page of this server.

        Both names are checked: a name of another site may resolve to this machine (Host), and a
        page of another site may send a form here (Origin).
        """
        known = {f"{name}:{self.server.port}" for name in LOOPBACK_NAMES}
        # Browsers send "null" from a page with the policy "no-referrer".
        origins = {None, "null", *(f"http://{name}" for name in known)}
        return self.headers.get("Host", "") in known and self.headers.get("Origin") in origins


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
