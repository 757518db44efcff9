"""Serve the operator's page on loopback.

The server keeps nothing in memory: it renders every page from the records on the disk, so a server
that was killed continues where it was. Pages of other sites cannot score: they do not know the
token, and requests under any other name than this machine's are refused.
"""

from __future__ import annotations

import hmac
import secrets
import threading
from http import HTTPStatus
from pathlib import Path, PurePosixPath
from urllib.parse import parse_qsl, urlsplit

from roboirg.apps.real.pages.score_page import page_address, render_trial
from roboirg.apps.real.study.study_plan import PlannedTrial, StudyPlan
from roboirg.apps.real.study.trial_log import TrialLog
from roboirg.core.errors import InvalidValueError, RoboIRGError
from roboirg.util.web.http_server import HTML_TYPE, LoopbackRequestHandler, LoopbackServer
from roboirg.util.web.keyed_pages import PRIVATE_HEADERS, page_policy
from roboirg.util.web.page_templates import check_page_support
from roboirg.util.web.request_origin import LOOPBACK

MAX_FORM_BYTES = 65_536


class ScoreServer(LoopbackServer):
    """Serves the page of one study until it is shut down.

    Args:
        plan: of the study.
        folder: of its records.
        operator: name of the operator, for the records.
        port: 0 for any free port.

    Raises:
        InvalidValueError: the port is not available.
        MissingDependencyError: Jinja is not installed.
    """

    def __init__(self, plan: StudyPlan, folder: Path, operator: str, port: int = 0) -> None:
        check_page_support("The page")
        self.plan, self.folder, self.operator = plan, folder, operator
        self.token = secrets.token_urlsafe(24)
        self._writing = threading.Lock()
        super().__init__(port, _ScoreHandler)

    @property
    def url(self) -> str:
        """Address to open, with the token."""
        return f"http://{LOOPBACK}:{self.port}/?token={self.token}"

    def read_trial_log(self) -> TrialLog:
        """Read the records on the disk."""
        return TrialLog.read(self.plan, self.folder)

    def score(self, form: dict[str, str]) -> str:
        """Store a verdict; returns the message for the operator.

        Raises:
            UnknownNameError: the plan has no such trial.
            InvalidValueError: the page was out of date, or the trial has no such failure.
            StoreError: the record cannot be written.
        """
        with self._writing:
            trial_log = self.read_trial_log()
            trial = self.plan.trial(form.get("trial", ""))
            if form.get("revision") != str(trial_log.revision(trial.name)):
                raise InvalidValueError(
                    f"{trial.name} has changed since this page was loaded; nothing was stored. "
                    "Check it again."
                )
            video, warning = self._find_video(form.get("video", "").strip())
            note = " ".join(form.get("note", "").split())
            record = trial_log.score(
                trial, form.get("choice", ""), operator=self.operator, note=note, video=video
            )
        return f"Stored for {trial.name}: {record.cause or 'success'}{warning}"

    def undo(self, form: dict[str, str]) -> tuple[str, str]:
        """Undo the last score; returns the trial's name and the message for the operator.

        Raises:
            InvalidValueError: there is no score, or a newer one than the page showed.
            StoreError: the record cannot be written.
        """
        with self._writing:
            trial_log = self.read_trial_log()
            if form.get("last") != (trial_log.last_scored or ""):
                raise InvalidValueError(
                    "There is a newer score than the page showed; nothing was undone."
                )
            name = trial_log.undo(operator=self.operator)
        return name, f"The score of {name} was undone."

    def _find_video(self, name: str) -> tuple[str, str]:
        """Return a video's path, or a warning if it does not exist; the verdict counts anyway."""
        if not name:
            return "", ""
        path = PurePosixPath(name)
        inside = not path.is_absolute() and ".." not in path.parts
        if inside and (self.folder / path).is_file():
            return path.as_posix(), ""
        return "", f" (without a video: the study's folder has no file {name!r})"


class _ScoreHandler(LoopbackRequestHandler):
    """Handle requests for trials' pages, verdicts and undo."""

    server: ScoreServer

    def do_GET(self) -> None:  # noqa: N802 - name of the base class
        """Send the page of a trial."""
        parts = urlsplit(self.path)
        query = dict(parse_qsl(parts.query))
        if not self._is_allowed(query.get("token", "")):
            return
        if parts.path != "/":
            self.send_refusal(HTTPStatus.NOT_FOUND, "There is no such page.")
            return
        message = query.get("message", "")
        try:
            trial_log = self.server.read_trial_log()
            trial = _select_trial(trial_log, query.get("trial", ""))
            nonce = secrets.token_urlsafe(16)
            text = render_trial(
                trial_log, trial, token=self.server.token, nonce=nonce, message=message
            )
        except RoboIRGError as error:
            self.send_refusal(HTTPStatus.BAD_REQUEST, str(error))
            return
        self.send_bytes(text.encode(), HTML_TYPE, headers=page_policy(nonce))

    def do_POST(self) -> None:  # noqa: N802 - name of the base class
        """Store a verdict or undo one, then redirect: reloading the page must not repeat it."""
        if not self.is_local():
            self._refuse()
            return
        form = self.read_form(MAX_FORM_BYTES, message="This is not a form of this page.")
        if form is None or not self._is_allowed(form.get("token", "")):
            return
        shown: dict[str, str] = {}
        try:
            if self.path == "/score":
                message = self.server.score(form)
            elif self.path == "/undo":
                shown["trial"], message = self.server.undo(form)
            else:
                self.send_refusal(HTTPStatus.NOT_FOUND, "There is no such page.")
                return
        except RoboIRGError as error:
            message = str(error)
            if "trial" in form:
                shown["trial"] = form["trial"]
        query = {"token": self.server.token, **shown, "message": message}
        self.send_redirect(page_address(query))

    def common_headers(self) -> dict[str, str]:
        """Return headers that forbid caching, referrers with the token, and foreign content."""
        return {**super().common_headers(), **PRIVATE_HEADERS}

    def _is_allowed(self, token: str) -> bool:
        """Return whether a request comes from a page of this server; refuse it if not."""
        allowed = self.is_local() and hmac.compare_digest(
            token.encode(), self.server.token.encode()
        )
        if not allowed:
            self._refuse()
        return allowed

    def _refuse(self) -> None:
        self.send_refusal(
            HTTPStatus.FORBIDDEN, "Open the address that roboirg real score has printed."
        )


def _select_trial(trial_log: TrialLog, name: str) -> PlannedTrial:
    """Return the trial of that name; without a name the next one to score, or the last."""
    if name:
        return trial_log.plan.trial(name)
    return trial_log.next_to_score() or trial_log.plan.trials[-1]
