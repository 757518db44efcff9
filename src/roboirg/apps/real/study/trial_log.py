"""The state of every trial, read from the records alone, so that a killed process loses nothing.

A trial whose score was undone has a record too: an error, which counts in no rate. Records are only
appended. The newest record of a trial counts, in the tables too.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import msgspec
from pydantic import JsonValue

from roboirg.apps.real.study.failure_choices import failure_choices
from roboirg.apps.real.study.study_plan import PlannedTrial, StudyPlan
from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.episode_errors import format_cause
from roboirg.evaluation.play.episode_record import begin_record
from roboirg.evaluation.play.job_instruction import PreparedJob
from roboirg.evaluation.records.record import Record
from roboirg.evaluation.records.store import RecordStore, iterate_records
from roboirg.policies.contract.policy_calls import REAL_TRIAL

WITHDRAWN = format_cause("infrastructure", "the operator undid the score")
VOID = format_cause("infrastructure", "the operator declared the trial void")

State = Literal["open", "scored", "void"]
"""Not scored; scored; declared void."""

ROBOT = "a robot"
"""Name in the records of the robot that played a trial."""

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
        """Read the records of a folder, but for simulated ones.

        Raises:
            StoreError: the records cannot be read.
        """
        trial_log = cls(plan, folder)
        names = {trial.identity: trial.name for trial in plan.trials}
        for record in iterate_records(folder):
            name = names.get(record.identity)
            if name is not None and record.robot is not None:
                trial_log._apply(name, record)
        return trial_log

    def _apply(self, name: str, record: Record) -> None:
        """Update the history of a trial by its next record."""
        history = self._history.setdefault(name, [])
        if trial_metadata(record).get("action") == "undo":
            if history:
                history.pop()
            if name in self._scored:
                last = len(self._scored) - 1 - self._scored[::-1].index(name)
                del self._scored[last]
            return
        history.append(record)
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
        return "void" if str(record.cause).startswith(VOID) else "open"

    def next_to_score(self) -> PlannedTrial | None:
        """Return the first trial without a verdict."""
        return next((one for one in self.plan.trials if self.state(one.name) == "open"), None)

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
        base = self.newest(trial.name) or begin_record(PreparedJob(trial.job))
        changes: dict[str, Any] = {
            "outcome": "success", "error": None, "cause": None, "attribution": None,
            "video": video or base.video,
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
            found = choices[choice].attribution(note)
            changes |= {"outcome": "failure", "cause": found.sentence, "attribution": found}
        return self._append(trial, msgspec.structs.replace(base, **changes), metadata)

    def undo(self, *, operator: str) -> str:
        """Withdraw the newest score, so that the record before it counts again.

        Args:
            operator: name of the operator.

        Returns:
            The trial's name.

        Raises:
            InvalidValueError: there is no score.
            StoreError: the record cannot be written.
        """
        name = self.last_scored
        if name is None:
            raise InvalidValueError("There is no score to undo.")
        history = self._history[name]
        previous = history[-2] if len(history) > 1 else _withdrawn(history[-1])
        metadata = {**trial_metadata(previous), "action": "undo", "operator": operator}
        self._append(self.plan.trial(name), previous, metadata)
        return name

    def _append(self, trial: PlannedTrial, record: Record, metadata: dict[str, Any]) -> Record:
        merged: dict[str, JsonValue] = {
            **trial_metadata(record), **metadata,
            "trial": trial.name, "plan": self.plan.fingerprint,
        }  # fmt: skip
        complete = msgspec.structs.replace(
            record,
            policy_metadata={**record.policy_metadata, REAL_TRIAL: merged},
            robot=ROBOT,
            plan=self.plan.fingerprint,
        )
        with RecordStore(self.folder) as store:
            store.append(complete)
        self._apply(trial.name, complete)
        return complete


def trial_metadata(record: Record) -> dict[str, JsonValue]:
    """Return the metadata of a real trial in its record; empty for other records."""
    metadata = record.policy_metadata.get(REAL_TRIAL)
    return dict(metadata) if isinstance(metadata, dict) else {}


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
