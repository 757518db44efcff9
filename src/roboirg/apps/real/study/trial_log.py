"""The state of every trial, read from the records alone, so that a killed process loses nothing.

A played trial that waits for the operator, and one whose score was undone, have a record too: an
error, which counts in no rate. Records are only appended. The newest record of a trial counts, in
the tables too.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import msgspec
from pydantic import JsonValue

from roboirg.apps.real.study.failure_choices import failure_choices
from roboirg.apps.real.study.study_plan import PlannedTrial, StudyPlan
from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.episode_errors import format_cause
from roboirg.evaluation.play.rollout_result import RolloutResult, make_record, utc_now
from roboirg.evaluation.records.record import REAL_TRIAL, Record, real_robot
from roboirg.evaluation.records.record_codec import StoreError
from roboirg.evaluation.records.store import RecordStore, iterate_records

UNSCORED = format_cause("infrastructure", "played; waiting for the operator's verdict")
WITHDRAWN = format_cause("infrastructure", "the operator undid the score")
VOID = format_cause("infrastructure", "the operator declared the trial void")

State = Literal["open", "waiting", "scored", "void", "error"]
"""Not played; played but not scored; scored; declared void; ended in an error."""

LOCK_TIMEOUT_S = 10.0
LOCK_RETRY_S = 0.02

SUCCESS, VOID_CHOICE = "success", "void"


@dataclass
class TrialLog:
    """The trials of a plan with their records.

    Attributes:
        plan: of the study.
        folder: of the records.
    """

    plan: StudyPlan
    folder: Path
    _history: dict[str, list[Record]] = field(default_factory=dict)
    _scored: list[str] = field(default_factory=list)

    @classmethod
    def read(cls, plan: StudyPlan, folder: Path) -> TrialLog:
        """Read the records of a folder.

        Raises:
            StoreError: the records cannot be read.
        """
        trial_log = cls(plan, folder)
        names = {trial.identity: trial.name for trial in plan.trials}
        for record in iterate_records(folder):
            name = names.get(record.identity)
            if name is not None:
                trial_log._apply(name, record)
        return trial_log

    def _apply(self, name: str, record: Record) -> None:
        """Update the history of a trial by its next record."""
        history = self._history.setdefault(name, [])
        action = trial_metadata(record).get("action")
        if action == "undo":
            if history:
                history.pop()
            if name in self._scored:
                last = len(self._scored) - 1 - self._scored[::-1].index(name)
                del self._scored[last]
            return
        history.append(record)
        if action == "score":
            self._scored.append(name)

    def newest(self, name: str) -> Record | None:
        """Return the record of a trial that counts; None if there is none."""
        history = self._history.get(name)
        return history[-1] if history else None

    def revision(self, name: str) -> int:
        """Return a number that changes with the record of a trial."""
        return len(self._history.get(name, ()))

    def state(self, name: str) -> State:
        """Return the state of a trial."""
        record = self.newest(name)
        if record is None:
            return "open"
        if record.outcome != "error":
            return "scored"
        cause = str(record.cause)
        if cause == UNSCORED:
            return "waiting"
        if cause == WITHDRAWN:
            return "open"
        return "void" if cause.startswith(VOID) else "error"

    def next_to_score(self) -> PlannedTrial | None:
        """Return the first played trial that waits for a verdict, else the first open one."""
        for state in ("waiting", "open"):
            for trial in self.plan.trials:
                if self.state(trial.name) == state:
                    return trial
        return None

    @property
    def last_scored(self) -> str | None:
        """Name of the trial whose score `undo` withdraws."""
        return self._scored[-1] if self._scored else None

    def score(
        self, trial: PlannedTrial, choice: str, *, operator: str, note: str = "", video: str = ""
    ) -> Record:
        """Store an operator's verdict and return its record, which is then on the disk.

        Args:
            trial: to score.
            choice: ``success``, ``void``, or the key of one of the trial's failures.
            operator: name of the operator.
            note: free text.
            video: path of a video, relative to the folder.

        Raises:
            InvalidValueError: the trial has no such failure.
            StoreError: the record cannot be written.
        """
        metadata = {"action": "score", "operator": operator, "note": note}
        base = self.newest(trial.name) or make_record(
            trial.job, RolloutResult(), started_at=utc_now()
        )
        changes: dict[str, Any] = {
            "outcome": "success", "error": None, "cause": None, "attribution": None,
            "video": video or base.video, "details": None,
        }  # fmt: skip
        if choice == VOID_CHOICE:
            cause = f"{VOID}; {note}" if note else VOID
            changes |= {"outcome": "error", "error": "infrastructure", "cause": cause}
        elif choice != SUCCESS:
            choices = {one.key: one for one in failure_choices(trial.episode)}
            if choice not in choices:
                raise InvalidValueError(
                    f"A trial of {trial.job.task} cannot fail by {choice!r}; its failures are "
                    f"{', '.join(choices)}."
                )
            found = choices[choice].attribution(base.steps, note)
            changes |= {"outcome": "failure", "cause": found.sentence, "attribution": found}
        return self._append(trial, msgspec.structs.replace(base, **changes), metadata)

    def undo(self, *, operator: str) -> str:
        """Withdraw the newest score, so that the record before it counts again.

        Args:
            operator: name of the operator.

        Returns:
            The trial's name.

        Raises:
            InvalidValueError: there is no score, or the trial has been played again since.
            StoreError: the record cannot be written.
        """
        name = self.last_scored
        if name is None:
            raise InvalidValueError("There is no score to undo.")
        history = self._history[name]
        if trial_metadata(history[-1]).get("action") != "score":
            raise InvalidValueError(f"{name} has been played again since it was scored.")
        previous = history[-2] if len(history) > 1 else _withdrawn(history[-1])
        metadata = {**trial_metadata(previous), "action": "undo", "operator": operator}
        self._append(self.plan.trial(name), previous, metadata)
        return name

    def add(self, trial: PlannedTrial, record: Record, metadata: dict[str, Any]) -> Record:
        """Store the record of a trial that was played.

        Args:
            trial: that was played.
            record: without metadata of the real trial.
            metadata: to add to the record.

        Raises:
            StoreError: the record cannot be written.
        """
        return self._append(trial, record, {"action": "play", **metadata})

    def _append(self, trial: PlannedTrial, record: Record, metadata: dict[str, Any]) -> Record:
        merged: dict[str, JsonValue] = {
            **trial_metadata(record), **metadata,
            "trial": trial.name, "plan": self.plan.fingerprint,
        }  # fmt: skip
        complete = msgspec.structs.replace(
            record,
            policy_metadata={**record.policy_metadata, REAL_TRIAL: merged},
            robot=real_robot(merged),
            plan=self.plan.fingerprint,
        )
        _append_record(self.folder, complete)
        self._apply(trial.name, complete)
        return complete


def trial_metadata(record: Record) -> dict[str, JsonValue]:
    """Return the metadata of a real trial in its record; empty for other records."""
    metadata = record.policy_metadata.get(REAL_TRIAL)
    return dict(metadata) if isinstance(metadata, dict) else {}


def _append_record(folder: Path, record: Record) -> None:
    """Append a record; wait while another process writes, such as the robot's loop or the page."""
    deadline = time.monotonic() + LOCK_TIMEOUT_S
    while True:
        try:
            with RecordStore(folder) as store:
                store.append(record)
        except StoreError:
            if time.monotonic() > deadline:
                raise
            time.sleep(LOCK_RETRY_S)
        else:
            return


def _withdrawn(record: Record) -> Record:
    """Return the record of a trial whose only score was undone."""
    return msgspec.structs.replace(
        record,
        outcome="error",
        error="infrastructure",
        cause=WITHDRAWN,
        attribution=None,
        video=None,
    )
