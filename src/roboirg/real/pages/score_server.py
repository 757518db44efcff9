"""The operator's page over HTTP, on this machine alone.

Nothing is kept in memory: every page is made of the records on the disk, so a server that is
killed goes on where it was. Pages of other sites cannot score: they know no token, and names other
than this machine's are refused, whatever they resolve to.
"""

from __future__ import annotations

import hmac
import secrets
import threading
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path, PurePosixPath
from urllib.parse import parse_qsl, urlsplit

from roboirg.core.errors import InvalidValueError, RoboIRGError
from roboirg.real.pages.score_page import check_page_support, redirect_of, render
from roboirg.real.study.study_plan import PlannedTrial, StudyPlan
from roboirg.real.study.trial_log import TrialLog

LOOPBACK = "127.0.0.1"
LARGEST_FORM = 65_536
"""Bytes."""
POLICY = (
    "default-src 'none'; style-src 'nonce-{0}'; script-src 'nonce-{0}'; form-action 'self'; "
    "frame-ancestors 'none'; base-uri 'none'"
)
"""What the page may do: nothing but what it has itself, and its own forms."""


class ScoreServer(ThreadingHTTPServer):
    """Serves the page of one study; `serve_forever` as usual.

    Args:
        plan: of the study.
        folder: of its records.
        operator: who judges, for the records.
        port: 0 for any that is free.

    Raises:
        InvalidValueError: the port cannot be had.
        MissingDependencyError: Jinja is not installed.
    """

    daemon_threads = True

    def __init__(self, plan: StudyPlan, folder: Path, operator: str, port: int = 0) -> None:
        check_page_support()
        self.plan, self.folder, self.operator = plan, folder, operator
        self.token = secrets.token_urlsafe(24)
        self.writing = threading.Lock()
        try:
            super().__init__((LOOPBACK, port), _ScoreHandler)
        except (OSError, OverflowError) as error:
            raise InvalidValueError(
                f"Port {port} cannot be had ({error}); choose another or 0."
            ) from error

    @property
    def url(self) -> str:
        """The address to open; it holds the token."""
        return f"http://{LOOPBACK}:{self.server_address[1]}/?token={self.token}"

    def ledger(self) -> TrialLog:
        """What the disk says now."""
        return TrialLog.read(self.plan, self.folder)

    def score(self, form: dict[str, str]) -> str:
        """Store a verdict; returns what to tell the operator.

        Raises:
            InvalidValueError: the form says what cannot be.
            StoreError: it cannot be written.
        """
        with self.writing:
            ledger = self.ledger()
            trial = self.plan.trial(form.get("trial", ""))
            if form.get("seen") != str(ledger.count(trial.name)):
                raise InvalidValueError(
                    f"{trial.name} has changed since the page was made; nothing was stored, look "
                    "at it again."
                )
            video, trouble = self._video(form.get("video", "").strip())
            note = " ".join(form.get("note", "").split())
            record = ledger.score(
                trial, form.get("choice", ""), operator=self.operator, note=note, video=video
            )
        return f"Stored of {trial.name}: {record.cause or 'success'}{trouble}"

    def undo(self, form: dict[str, str]) -> tuple[str, str]:
        """Take the last score back; the trial, and what to tell the operator.

        Raises:
            InvalidValueError: there is none, or another than the page said.
            StoreError: it cannot be written.
        """
        with self.writing:
            ledger = self.ledger()
            if form.get("last") != (ledger.last_scored or ""):
                raise InvalidValueError("Something was scored meanwhile; nothing was taken back.")
            name = ledger.undo(operator=self.operator)
        return name, f"The score of {name} was taken back."

    def _video(self, name: str) -> tuple[str, str]:
        """The path of a film if there is one, and what is wrong with it. It costs no verdict."""
        if not name:
            return "", ""
        path = PurePosixPath(name)
        inside = not path.is_absolute() and ".." not in path.parts
        if inside and (self.folder / path).is_file():
            return path.as_posix(), ""
        return "", f" (without a video: there is no file {name!r} in the study's folder)"


class _ScoreHandler(BaseHTTPRequestHandler):
    """One request."""

    server: ScoreServer
    protocol_version = "HTTP/1.1"
    timeout = 30

    def do_GET(self) -> None:
        """A trial's page."""
        parts = urlsplit(self.path)
        query = dict(parse_qsl(parts.query))
        if not self._is_ours(query.get("token", "")):
            return
        if parts.path != "/":
            self._refuse(HTTPStatus.NOT_FOUND, "There is no such page.")
            return
        try:
            ledger = self.server.ledger()
            trial = _shown(ledger, query.get("trial", ""))
            text = render(ledger, trial, token=self.server.token, message=query.get("message", ""))
        except RoboIRGError as error:
            self._refuse(HTTPStatus.BAD_REQUEST, str(error))
            return
        self._send(HTTPStatus.OK, text, "text/html")

    def do_POST(self) -> None:
        """A verdict, or taking one back."""
        form = self._form()
        if form is None or not self._is_ours(form.get("token", "")):
            return
        shown: dict[str, str] = {}
        try:
            if self.path == "/score":
                message = self.server.score(form)
            elif self.path == "/undo":
                shown["trial"], message = self.server.undo(form)
            else:
                self._refuse(HTTPStatus.NOT_FOUND, "There is no such page.")
                return
        except RoboIRGError as error:
            message = str(error)
            if "trial" in form:
                shown["trial"] = form["trial"]
        # A page that is loaded again must not score again.
        self.send_response(HTTPStatus.SEE_OTHER)
        address = redirect_of({"token": self.server.token, **shown, "message": message})
        self.send_header("Location", address)
        self.send_header("Content-Length", "0")
        self.end_headers()

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002
        """Say nothing: addresses hold the token."""

    def _form(self) -> dict[str, str] | None:
        length = self.headers.get("Content-Length", "")
        if not length.isdigit() or int(length) > LARGEST_FORM:
            self.close_connection = True
            self._refuse(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, "That is no form of this page.")
            return None
        body = self.rfile.read(int(length)).decode("utf-8", "replace")
        return dict(parse_qsl(body, keep_blank_values=True))

    def _is_ours(self, token: str) -> bool:
        """Whether the request comes from a page of this server; refused if it does not."""
        port = self.server.server_address[1]
        host = self.headers.get("Host", "")
        origin = self.headers.get("Origin")
        known = [f"{name}:{port}" for name in (LOOPBACK, "localhost")]
        allowed = (
            host in known
            # "null" is what a browser sends that is told to send no referrer.
            and origin in (None, "null", *(f"http://{one}" for one in known))
            and hmac.compare_digest(token.encode(), self.server.token.encode())
        )
        if not allowed:
            self._refuse(
                HTTPStatus.FORBIDDEN, "Open the address that roboirg real score has printed."
            )
        return allowed

    def _refuse(self, status: HTTPStatus, words: str) -> None:
        self._send(status, words + "\n", "text/plain")

    def _send(self, status: HTTPStatus, text: str, kind: str) -> None:
        body, nonce = text.encode(), self.server.token
        self.send_response(status)
        for name, value in (
            ("Content-Type", f"{kind}; charset=utf-8"),
            ("Content-Length", str(len(body))),
            ("Cache-Control", "no-store"),
            ("Referrer-Policy", "no-referrer"),
            ("X-Content-Type-Options", "nosniff"),
            ("Content-Security-Policy", POLICY.format(nonce)),
        ):
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)


def _shown(ledger: TrialLog, name: str) -> PlannedTrial:
    """The trial that is asked for, else the first to score, else the last."""
    if name:
        return ledger.plan.trial(name)
    return ledger.to_score() or ledger.plan.trials[-1]
