"""Serve the page on which people listen."""

from __future__ import annotations

import functools
import re
from collections.abc import Sequence
from http import HTTPStatus
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboirg.apps.people.listening_session import ListeningSession, OutOfDateError
from roboirg.core.errors import RoboIRGError
from roboirg.util.web.keyed_pages import KeyedPageHandler, KeyedPageServer, stored_key
from roboirg.util.web.page_templates import check_page_support, template_environment
from roboirg.util.web.request_origin import LOOPBACK

if TYPE_CHECKING:
    import jinja2

PACKAGE = "roboirg.apps.people"
STYLES = ("base", "people")
_MEDIA = re.compile(r"/media/((?:pictures|videos)/[0-9a-f]{8,64}\.(?:png|mp4))")
_PERSON = "X-Person"


class ListenServer(KeyedPageServer):
    """Serves one study until it is shut down.

    Args:
        folder: of the study.
        host: address to listen at.
        port: 0 for any free port.
        names: further names under which browsers reach this machine.
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
        names: Sequence[str] = (),
        people: int | None = None,
    ) -> None:
        check_page_support("The page")
        self.session = ListeningSession(folder, people)
        try:
            super().__init__(_ListenHandler, stored_key(folder), host, port, names)
        except RoboIRGError:
            self.session.close()
            raise

    def server_close(self) -> None:
        """Close the socket and the file of answers."""
        super().server_close()
        self.session.close()


class _ListenHandler(KeyedPageHandler):
    """Handle requests for the page, its pictures, and answers."""

    server: ListenServer

    def answer_get(self, path: str) -> None:
        """Send the page, what it shows, or a picture."""
        if path == "/":
            consent = self.server.session.study.consent.strip().split("\n\n")
            self.send_page(functools.partial(_render, consent))
        elif path == "/state":
            self._reply(lambda: self.server.session.state(self.headers.get(_PERSON, "")))
        elif found := _MEDIA.fullmatch(path):
            try:
                with (self.server.session.questions_folder / found[1]).open("rb") as file:
                    self.send_file(file, path)
            except OSError:
                self.send_missing()
        else:
            self.send_missing()

    def answer_post(self, path: str, body: dict[str, Any]) -> None:
        """Let a person join, answer, or take an answer back."""
        session, code = self.server.session, self.headers.get(_PERSON, "")
        number = body.get("number")
        if path == "/join":
            if body.get("consent") is not True:
                self.send_refusal(HTTPStatus.BAD_REQUEST, "You have not agreed to take part.")
                return
            self._reply(lambda: {"code": session.join()})
        elif type(number) is not int:
            self.send_refusal(HTTPStatus.BAD_REQUEST, "The request names no question.")
        elif path == "/answer":
            self._reply(lambda: session.answer(code, number, body))
        elif path == "/undo":
            self._reply(lambda: session.undo(code, number))
        else:
            self.send_missing()

    def _reply(self, act: Any) -> None:  # noqa: ANN401 - returns what is sent
        """Send what a function returns, or why it could not."""
        try:
            value = act()
        except OutOfDateError as error:
            self.send_refusal(HTTPStatus.CONFLICT, str(error))
        except RoboIRGError as error:
            self.send_refusal(HTTPStatus.BAD_REQUEST, str(error))
        else:
            self.send_json(value)


@functools.cache
def _template() -> jinja2.Template:
    return template_environment(PACKAGE).get_template("listen.html.j2")


def _render(consent: Sequence[str], nonce: str) -> str:
    return _template().render(nonce=nonce, consent=consent, styles=STYLES)
