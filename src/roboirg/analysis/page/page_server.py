"""The page about a run, served on loopback together with its films.

Only GET and HEAD, only this machine (also by the name that is asked for, so that no other site can
read it through a browser), only files inside the run's folder. Ranges of bytes are answered, so
that one can seek in a film.
"""

from __future__ import annotations

import mimetypes
import os
import re
import threading
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import BinaryIO, NamedTuple
from urllib.parse import unquote, urlsplit

from roboirg.core.errors import InvalidValueError
from roboirg.records.store import RECORDS_FILE

LOOPBACK = "127.0.0.1"
NAMES = (LOOPBACK, "localhost")
CHUNK = 1 << 16


class Range(NamedTuple):
    """Bytes of a file: the first, and the one behind the last."""

    begin: int
    end: int


class PageServer(ThreadingHTTPServer):
    """Serves one run until it is shut down.

    Args:
        folder: of the run.
        make_page: makes the page as text; asked again when the records have changed.
        port: 0 chooses a free one.

    Raises:
        InvalidValueError: the port cannot be had.
    """

    daemon_threads = True

    def __init__(self, folder: Path, make_page: Callable[[], str], port: int = 0) -> None:
        self.folder = folder.resolve()
        self._make_page = make_page
        self._page: tuple[object, bytes] | None = None
        self._lock = threading.Lock()
        try:
            super().__init__((LOOPBACK, port), _PageHandler)
        except (OSError, OverflowError) as error:
            raise InvalidValueError(
                f"Port {port} cannot be had ({error}); leave it out for a free one."
            ) from error

    @property
    def port(self) -> int:
        """The one that was chosen."""
        return int(self.server_address[1])

    @property
    def address(self) -> str:
        """Of the page."""
        return f"http://{LOOPBACK}:{self.port}/"

    def page(self) -> bytes:
        """The page as it is now; made anew only if the records have changed."""
        records = self.folder / RECORDS_FILE
        with self._lock:
            state = records.stat() if records.exists() else None
            mark = None if state is None else (state.st_mtime_ns, state.st_size)
            if self._page is None or self._page[0] != mark:
                self._page = (mark, self._make_page().encode())
            return self._page[1]


def parse_range(header: str | None, size: int) -> Range | None:
    """The bytes that a Range header asks for; None for all of them.

    Headers that cannot be understood, and several ranges at once, are answered with everything,
    as HTTP allows.

    Args:
        header: such as ``bytes=0-99``, ``bytes=100-`` or ``bytes=-100``.
        size: of the file, bytes.

    Raises:
        ValueError: no such bytes are in the file.
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
        raise ValueError(f"there are {size} bytes")
    return Range(begin, end)


class _PageHandler(BaseHTTPRequestHandler):
    server: PageServer
    protocol_version = "HTTP/1.1"
    server_version = "roboirg"
    sys_version = ""

    def do_GET(self) -> None:
        self._answer(with_body=True)

    def do_HEAD(self) -> None:
        self._answer(with_body=False)

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002 - the base class's name
        """Say nothing; the terminal shows the address alone."""

    def _answer(self, *, with_body: bool) -> None:
        path = unquote(urlsplit(self.path).path)
        if not self._is_for_us():
            self._refuse(HTTPStatus.FORBIDDEN)
        elif path in ("/", "/index.html", "/report.html"):
            self._send_page(with_body=with_body)
        else:
            self._send_file(path, with_body=with_body)

    def _is_for_us(self) -> bool:
        host = self.headers.get("Host", "")
        return host in {f"{name}:{self.server.port}" for name in NAMES}

    def _send_page(self, *, with_body: bool) -> None:
        body = self.server.page()
        self._begin(HTTPStatus.OK, "text/html; charset=utf-8", len(body))
        if with_body:
            self.wfile.write(body)

    def _send_file(self, path: str, *, with_body: bool) -> None:
        file = self._opened(path)
        if file is None:
            self._refuse(HTTPStatus.NOT_FOUND)
            return
        with file:
            size = os.fstat(file.fileno()).st_size
            kind = mimetypes.guess_type(path)[0] or "application/octet-stream"
            try:
                wanted = parse_range(self.headers.get("Range"), size)
            except ValueError:
                self._refuse(
                    HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE, {"Content-Range": f"bytes */{size}"}
                )
                return
            begin, end = wanted or Range(0, size)
            extra = {"Accept-Ranges": "bytes"}
            if wanted is not None:
                extra["Content-Range"] = f"bytes {begin}-{end - 1}/{size}"
            status = HTTPStatus.OK if wanted is None else HTTPStatus.PARTIAL_CONTENT
            self._begin(status, kind, end - begin, extra)
            if with_body:
                self._copy(file, begin, end)

    def _opened(self, path: str) -> BinaryIO | None:
        """The file of a path; None where there is none inside the run's folder."""
        folder = self.server.folder
        try:
            # Resolved, so that neither dots nor links lead outside.
            found = (folder / path.lstrip("/")).resolve()
            if not found.is_relative_to(folder) or not found.is_file():
                return None
            return found.open("rb")
        except (OSError, ValueError):
            return None

    def _copy(self, file: BinaryIO, begin: int, end: int) -> None:
        file.seek(begin)
        left = end - begin
        while left and (data := file.read(min(CHUNK, left))):
            self.wfile.write(data)
            left -= len(data)

    def _begin(
        self, status: HTTPStatus, kind: str, length: int, extra: dict[str, str] | None = None
    ) -> None:
        self.send_response(status)
        headers = {
            "Content-Type": kind,
            "Content-Length": str(length),
            "Cache-Control": "no-cache",
            "X-Content-Type-Options": "nosniff",
            **(extra or {}),
        }
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()

    def _refuse(self, status: HTTPStatus, extra: dict[str, str] | None = None) -> None:
        body = f"{status.value} {status.phrase}\n".encode()
        self._begin(status, "text/plain; charset=utf-8", len(body), extra)
        if self.command != "HEAD":
            self.wfile.write(body)

    def handle(self) -> None:
        # A browser that seeks hangs up in the middle of a film.
        try:
            super().handle()
        except (BrokenPipeError, ConnectionResetError):
            self.close_connection = True
