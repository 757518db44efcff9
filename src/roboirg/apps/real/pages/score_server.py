"""Serve the operator's page on loopback.

The server keeps nothing in memory: it renders every page from the records on the disk, so a server
that was killed continues where it was. Pages of other sites cannot score: they do not know the
key, and requests under any other name than this machine's are refused.
"""

from __future__ import annotations

import secrets
import threading
from pathlib import Path, PurePosixPath
from urllib.parse import parse_qsl, urlencode

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response
from starlette.routing import Route

from roboirg.apps.real.pages.score_page import render_trial
from roboirg.apps.real.study.study_plan import PlannedTrial, StudyPlan
from roboirg.apps.real.study.trial_log import TrialLog
from roboirg.core.errors import InvalidValueError, RoboIRGError
from roboirg.util.web.app_server import read_body
from roboirg.util.web.keyed_pages import MAX_BODY_BYTES, KeyedPageServer, page_response
from roboirg.util.web.page_templates import check_page_support


class ScoreServer(KeyedPageServer):
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
        """Listen at the port, with a new key; answer once `serve_forever` is called."""
        check_page_support("The page")
        self.plan = plan
        self.folder = folder
        self.operator = operator
        self._writing = threading.Lock()
        routes = [
            Route("/", self._page),
            Route("/score", self._take_form, methods=["POST"]),
        ]
        super().__init__(routes, secrets.token_urlsafe(18), port)

    def read_trial_log(self) -> TrialLog:
        """Read the records on the disk."""
        return TrialLog.read(self.plan, self.folder)

    def score(self, form: dict[str, str]) -> str:
        """Store a verdict from the page's form; returns the message for the operator.

        The form's ``revision`` must be the trial's present one, so that two open pages cannot
        overwrite each other's verdicts; a lock keeps requests apart.

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
            name = form.get("video", "").strip()
            video = self._find_video(name)
            record = trial_log.score(
                trial,
                form.get("choice", ""),
                operator=self.operator,
                note=" ".join(form.get("note", "").split()),
                video=video,
            )
        message = f"Stored for {trial.name}: {record.cause or 'success'}"
        if name and not video:  # the verdict counts anyway
            message += f" (without a video: the study's folder has no file {name!r})"
        return message

    def _find_video(self, name: str) -> str:
        """Return the path of a video in the study's folder; empty if there is no such file in it.

        Paths that lead out of the folder count as missing.
        """
        path = PurePosixPath(name)
        is_inside = not path.is_absolute() and ".." not in path.parts
        if is_inside and (self.folder / path).is_file():
            return path.as_posix()
        return ""

    def _page(self, request: Request) -> Response:
        """Answer a request for the page of a trial, rendered anew from the records on the disk."""
        trial_log = self.read_trial_log()
        trial = _select_trial(trial_log, request.query_params.get("trial", ""))
        message = request.query_params.get("message", "")
        return page_response(
            lambda nonce: render_trial(trial_log, trial, nonce=nonce, message=message)
        )

    async def _take_form(self, request: Request) -> Response:
        """Store a verdict, then redirect: reloading the page must not repeat it.

        An error of ours becomes the message on the trial's page; after success the next trial is
        shown.
        """
        body = await read_body(request, MAX_BODY_BYTES)
        form = dict(parse_qsl(body.decode("utf-8", "replace"), keep_blank_values=True))
        try:
            shown = {"message": await run_in_threadpool(self.score, form)}
        except RoboIRGError as error:
            shown = {"trial": form.get("trial", ""), "message": str(error)}
        return RedirectResponse(f"/?{urlencode(shown)}", 303)


def _select_trial(trial_log: TrialLog, name: str) -> PlannedTrial:
    """Return the trial of that name; without a name the next one to score, or the last."""
    if name:
        return trial_log.plan.trial(name)
    return trial_log.next_to_score() or trial_log.plan.trials[-1]
