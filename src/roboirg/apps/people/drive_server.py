"""Serve the page on which a person drives an episode."""

from __future__ import annotations

import functools
import re
import secrets
import threading
from collections.abc import Sequence
from http import HTTPStatus
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

import msgspec

from roboirg.apps.people.driving_run import drive_episode, next_seed
from roboirg.apps.people.driving_session import DrivingSession
from roboirg.apps.people.listen_server import PACKAGE
from roboirg.evaluation.records.record import Job
from roboirg.util.web.keyed_pages import KeyedPageHandler, KeyedPageServer
from roboirg.util.web.page_templates import check_page_support, template_environment
from roboirg.util.web.request_origin import LOOPBACK

if TYPE_CHECKING:
    import jinja2

STYLES = ("base", "people", "drive")
_PICTURE = re.compile(r"/picture/(front|wrist)/[0-9]+")


class DriveServer(KeyedPageServer):
    """Lets one person at a time drive one episode, again and again, until it is shut down.

    Args:
        job: what to drive.
        folder: of the records.
        host: address to listen at.
        port: 0 for any free port.
        names: further names under which browsers reach this machine.

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
        names: Sequence[str] = (),
    ) -> None:
        check_page_support("The page")
        self._job, self._folder = job, folder
        self._starting = threading.Lock()
        self._thread: threading.Thread | None = None
        next_seed(job, folder)
        super().__init__(_DriveHandler, secrets.token_urlsafe(18), host, port, names)
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
        """Close the socket and end the episode."""
        super().server_close()
        with self._starting:
            self._end_episode()

    def _end_episode(self) -> None:
        self.session.stop()
        if self._thread is not None:
            self._thread.join()


class _DriveHandler(KeyedPageHandler):
    """Handle requests for the page, its pictures, news and commands."""

    server: DriveServer

    def answer_get(self, path: str) -> None:
        """Send the page, what is new, a picture or the video."""
        session = self.server.session
        if path == "/":
            self.send_page(_render)
        elif path == "/news":
            after = parse_qs(urlsplit(self.path).query).get("after", [""])[0]
            self.send_json(session.news(int(after) if after.isdecimal() else -1))
        elif found := _PICTURE.fullmatch(path):
            self._send_media(session.picture(found[1]), "image/jpeg")
        elif path == "/video.mp4":
            self._send_media(session.video, "video/mp4")
        else:
            self.send_missing()

    def answer_post(self, path: str, body: dict[str, Any]) -> None:
        """Take a command, or start the episode again."""
        if path == "/begin":
            self.server.begin()
            self.send_json({})
        elif path != "/command":
            self.send_missing()
        elif self.server.session.command(body):
            self.send_json({})
        else:
            self.send_refusal(HTTPStatus.CONFLICT, "The robot is not waiting for a command.")

    def _send_media(self, content: bytes | None, content_type: str) -> None:
        if content is None:
            self.send_missing()
        else:
            self.send_bytes(content, content_type)


@functools.cache
def _template() -> jinja2.Template:
    return template_environment(PACKAGE).get_template("drive.html.j2")


def _render(nonce: str) -> str:
    return _template().render(nonce=nonce, styles=STYLES)
