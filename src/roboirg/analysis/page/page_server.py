"""Serve the folder of a run on loopback: its page together with its videos.

It answers GET and HEAD from this machine only, with files inside the run's folder only. Byte ranges
are supported, so that a browser can seek in a video.
"""

from __future__ import annotations

from pathlib import Path

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Mount
from starlette.staticfiles import StaticFiles

from roboirg.util.web.app_server import AppServer, RequestGuard
from roboirg.util.web.request_origin import LOOPBACK_NAMES, is_own_request


def run_server(folder: Path, port: int = 0) -> AppServer:
    """Return the server of a run's folder; port 0 is any free one."""
    files = Mount("/", StaticFiles(directory=folder.resolve(), check_dir=False))
    # The browser asks again each time: the page may be written anew.
    guard = RequestGuard(Starlette(routes=[files]), _refuse, {"Cache-Control": "no-cache"})
    return AppServer(guard, port)


def _refuse(request: Request) -> Response | None:
    """Return an error response to a request from another site's page; None for our own pages."""
    hosts = request.headers.getlist("host")
    origins = request.headers.getlist("origin")
    if is_own_request(hosts, origins, LOOPBACK_NAMES):
        return None
    return PlainTextResponse("403 Forbidden\n", 403)
