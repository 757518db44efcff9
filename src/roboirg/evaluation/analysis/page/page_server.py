"""Serve the page of a run on loopback together with its videos.

It answers GET and HEAD from this machine only, with files inside the run's folder only. Byte ranges
are supported, so that a browser can seek in a video.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from pathlib import Path

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import HTMLResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from roboirg.core.errors import RoboIRGError
from roboirg.evaluation.records.store import RECORDS_FILE
from roboirg.util.web.app_server import AppServer, RequestGuard, error_handler
from roboirg.util.web.request_origin import LOOPBACK, LOOPBACK_NAMES, is_own_request

PAGES = ("/", "/index.html", "/report.html")


class PageServer(AppServer):
    """Serves one run until it is shut down.

    Args:
        folder: of the run.
        make_page: renders the page; called again when the records have changed.
        port: 0 for any free port.
    """

    def __init__(self, folder: Path, make_page: Callable[[], str], port: int = 0) -> None:
        self.folder = folder.resolve()
        self._make_page = make_page
        self._page: tuple[object, str] | None = None
        self._lock = threading.Lock()
        files = Mount("/", _RunFiles(directory=self.folder, check_dir=False))
        app = Starlette(
            routes=[*(Route(path, self._answer) for path in PAGES), files],
            exception_handlers={RoboIRGError: error_handler(500)},
        )
        # The browser asks again each time: the records change while a run goes on.
        guard = RequestGuard(app, _refuse, {"Cache-Control": "no-cache"})
        super().__init__(guard, port)

    @property
    def address(self) -> str:
        return f"http://{LOOPBACK}:{self.port}/"

    def page(self) -> str:
        """Return the page; rendered again only if the records have changed."""
        records = self.folder / RECORDS_FILE
        with self._lock:
            state = records.stat() if records.exists() else None
            mark = None if state is None else (state.st_mtime_ns, state.st_size)
            if self._page is None or self._page[0] != mark:
                self._page = (mark, self._make_page())
            return self._page[1]

    def _answer(self, request: Request) -> Response:
        del request
        return HTMLResponse(self.page())


class _RunFiles(StaticFiles):
    """The files of a run, without those whose name begins with a dot.

    The lock, and videos that are not finished, are the run's own.
    """

    def lookup_path(self, path: str) -> tuple[str, os.stat_result | None]:
        found, state = super().lookup_path(path)
        if state is not None and "/." in found[len(str(self.directory)) :]:
            return "", None
        return found, state


def _refuse(request: Request) -> Response | None:
    """Return the response to a request that comes from a page of another site."""
    hosts, origins = request.headers.getlist("host"), request.headers.getlist("origin")
    if is_own_request(hosts, origins, LOOPBACK_NAMES):
        return None
    return PlainTextResponse("403 Forbidden\n", 403)
