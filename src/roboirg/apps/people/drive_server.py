"""Serve the page on which a person drives an episode."""

from __future__ import annotations

import secrets
import threading
from pathlib import Path
from typing import Any

import msgspec
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from roboirg.apps.people.driving_run import drive_episode, next_seed
from roboirg.apps.people.driving_session import DrivingSession
from roboirg.apps.people.listen_server import people_template
from roboirg.evaluation.records.record import Job
from roboirg.util.web.keyed_pages import KeyedPageServer, json_endpoint, page_response
from roboirg.util.web.page_templates import check_page_support
from roboirg.util.web.request_origin import LOOPBACK

STYLES = ("base", "people", "drive")


class DriveServer(KeyedPageServer):
    """Lets one person at a time drive one episode, again and again, until it is shut down.

    Args:
        job: what to drive.
        folder: of the records.
        host: address to listen at.
        port: 0 for any free port.

    Raises:
        InvalidValueError: the port is not available, or the address is not this machine's.
        StoreError: the folder holds something else than records.
        MissingDependencyError: Jinja is not installed.
    """

    def __init__(
        self,
        job: Job,
        folder: Path,
        host: str = LOOPBACK,
        port: int = 0,
    ) -> None:
        check_page_support("The page")
        self._job, self._folder = job, folder
        self._starting = threading.Lock()
        self._thread: threading.Thread | None = None
        next_seed(job, folder)
        routes = [
            Route("/", self._page),
            Route("/news", self._news),
            Route("/picture/{camera}/{number:int}", self._picture),
            Route("/video.mp4", self._video),
            Route("/begin", json_endpoint(self._begin), methods=["POST"]),
            Route("/command", json_endpoint(self._command), methods=["POST"]),
        ]
        super().__init__(routes, secrets.token_urlsafe(18), host, port)
        self.session = DrivingSession("idle")

    def begin(self) -> None:
        """Start the episode from its beginning; one that is under way ends without a record."""
        with self._starting:
            self._end_episode()
            self.session = DrivingSession()
            seed = next_seed(self._job, self._folder)
            job = msgspec.structs.replace(self._job, policy_seed=seed)
            self._thread = threading.Thread(
                target=drive_episode, args=(job, self._folder, self.session), daemon=True
            )
            self._thread.start()

    def server_close(self) -> None:
        """End the episode, whose news a page waits for, and close the socket."""
        with self._starting:
            self._end_episode()
        super().server_close()

    def _end_episode(self) -> None:
        self.session.stop()
        if self._thread is not None:
            self._thread.join()

    def _page(self, request: Request) -> Response:
        del request
        return page_response(_render)

    def _news(self, request: Request) -> Response:
        after = request.query_params.get("after", "")
        return JSONResponse(self.session.news(int(after) if after.isdecimal() else -1))

    def _picture(self, request: Request) -> Response:
        return _media(self.session.picture(request.path_params["camera"]), "image/jpeg")

    def _video(self, request: Request) -> Response:
        del request
        return _media(self.session.video, "video/mp4")

    def _begin(self, request: Request, body: dict[str, Any]) -> object:
        del request, body
        self.begin()
        return {}

    def _command(self, request: Request, body: dict[str, Any]) -> object:
        del request
        if not self.session.command(body):
            raise HTTPException(409, "The robot is not waiting for a command.")
        return {}


def _media(content: bytes | None, content_type: str) -> Response:
    if content is None:
        raise HTTPException(404)
    return Response(content, media_type=content_type)


def _render(nonce: str) -> str:
    return people_template("drive.html.j2").render(nonce=nonce, styles=STYLES)
