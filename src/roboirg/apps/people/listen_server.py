"""Serve the page on which people listen."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from roboirg.apps.people.listening_session import ListeningSession, OutOfDateError
from roboirg.core.errors import InvalidValueError, RoboIRGError
from roboirg.evaluation.grounding_items.media_store import PICTURES, VIDEOS
from roboirg.util.web.keyed_pages import KeyedPageServer, json_endpoint, page_response, stored_key
from roboirg.util.web.page_templates import check_page_support, template_environment
from roboirg.util.web.request_origin import LOOPBACK

if TYPE_CHECKING:
    import jinja2

STYLES = ("base", "people")


class ListenServer(KeyedPageServer):
    """Serves one study until it is shut down.

    Args:
        folder: of the study.
        host: address to listen at.
        port: 0 for any free port.
        people: how many may take part, if not as many as planned.

    Raises:
        InvalidValueError: the folder holds no study, or the port is not available.
        StoreError: another process serves the study.
        MissingDependencyError: Jinja is not installed.
    """

    def __init__(
        self,
        folder: Path,
        host: str = LOOPBACK,
        port: int = 0,
        people: int | None = None,
    ) -> None:
        check_page_support("The page")
        self.session = ListeningSession(folder, people)
        questions = self.session.questions_folder
        # These two only: the folder's lists hold the answers.
        media = [
            Mount(f"/media/{name}", StaticFiles(directory=questions / name))
            for name in (PICTURES, VIDEOS)
            if (questions / name).is_dir()
        ]
        routes = [
            Route("/", self._page),
            Route("/state", self._state),
            *media,
            Route("/join", json_endpoint(self._join), methods=["POST"]),
            Route("/answer", json_endpoint(self._answer), methods=["POST"]),
            Route("/undo", json_endpoint(self._undo), methods=["POST"]),
        ]
        try:
            key = stored_key(folder)
            super().__init__(routes, key, host, port, {OutOfDateError: 409})
        except RoboIRGError:
            self.session.close()
            raise

    def server_close(self) -> None:
        """Close the socket and the file of answers."""
        super().server_close()
        self.session.close()

    def _page(self, request: Request) -> Response:
        del request
        consent = self.session.study.consent.strip().split("\n\n")
        return page_response(functools.partial(_render, consent))

    def _state(self, request: Request) -> Response:
        return JSONResponse(self.session.state(_person(request)))

    def _join(self, request: Request, body: dict[str, Any]) -> object:
        del request
        if body.get("consent") is not True:
            raise InvalidValueError("You have not agreed to take part.")
        return {"code": self.session.join()}

    def _answer(self, request: Request, body: dict[str, Any]) -> object:
        return self.session.answer(_person(request), _number(body), body)

    def _undo(self, request: Request, body: dict[str, Any]) -> object:
        return self.session.undo(_person(request), _number(body))


def _person(request: Request) -> str:
    """Return the code of the person whose page sent a request; empty without one."""
    return request.headers.get("X-Person", "")


def _number(body: dict[str, Any]) -> int:
    number = body.get("number")
    if type(number) is not int:
        raise InvalidValueError("The request names no question.")
    return number


@functools.cache
def people_template(name: str) -> jinja2.Template:
    """Return a template of a page for people."""
    return template_environment("roboirg.apps.people").get_template(name)


def _render(consent: Sequence[str], nonce: str) -> str:
    return people_template("listen.html.j2").render(nonce=nonce, consent=consent, styles=STYLES)
