"""Serve the page of a run on loopback together with its videos.

It answers GET and HEAD from this machine only, with files inside the run's folder only. Byte ranges
are supported, so that a browser can seek in a video.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from http import HTTPStatus
from pathlib import Path
from typing import BinaryIO
from urllib.parse import unquote, urlsplit

from roboirg.evaluation.records.store import RECORDS_FILE
from roboirg.util.web.http_server import HTML_TYPE, LoopbackRequestHandler, LoopbackServer
from roboirg.util.web.request_origin import LOOPBACK


class PageServer(LoopbackServer):
    """Serves one run until it is shut down.

    Args:
        folder: of the run.
        make_page: renders the page; called again when the records have changed.
        port: 0 for any free port.
    """

    def __init__(self, folder: Path, make_page: Callable[[], str], port: int = 0) -> None:
        self.folder = folder.resolve()
        self._make_page = make_page
        self._page: tuple[object, bytes] | None = None
        self._lock = threading.Lock()
        super().__init__(port, _PageHandler)

    @property
    def address(self) -> str:
        """Address of the page."""
        return f"http://{LOOPBACK}:{self.port}/"

    def page(self) -> bytes:
        """Return the page; rendered again only if the records have changed."""
        records = self.folder / RECORDS_FILE
        with self._lock:
            state = records.stat() if records.exists() else None
            mark = None if state is None else (state.st_mtime_ns, state.st_size)
            if self._page is None or self._page[0] != mark:
                self._page = (mark, self._make_page().encode())
            return self._page[1]


class _PageHandler(LoopbackRequestHandler):
    """Handle requests for the page and for files of the run."""

    server: PageServer

    def do_GET(self) -> None:  # noqa: N802 - name of the base class
        path = unquote(urlsplit(self.path).path)
        if not self.is_local():
            self.send_refusal(HTTPStatus.FORBIDDEN)
        elif path in ("/", "/index.html", "/report.html"):
            self.send_bytes(self.server.page(), HTML_TYPE)
        elif (file := self._open(path)) is None:
            self.send_refusal(HTTPStatus.NOT_FOUND)
        else:
            with file:
                self.send_file(file, path)

    do_HEAD = do_GET  # noqa: N815 - a name of the base class

    def common_headers(self) -> dict[str, str]:
        """Let the browser ask again each time: the records change while a run goes on."""
        return {**super().common_headers(), "Cache-Control": "no-cache"}

    def _open(self, path: str) -> BinaryIO | None:
        """Return the file at a path; None if there is none inside the run's folder."""
        folder = self.server.folder
        try:
            # Resolved, so that neither dots nor links lead outside.
            found = (folder / path.lstrip("/")).resolve()
            if not found.is_relative_to(folder) or not found.is_file():
                return None
            # The lock, and videos that are not finished, are the run's own.
            if any(part.startswith(".") for part in found.relative_to(folder).parts):
                return None
            return found.open("rb")
        except (OSError, ValueError):
            return None
