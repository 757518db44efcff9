"""The state of every trial, read from the records alone, so that a killed process loses nothing.

Records are only appended. The newest record of a trial counts, in the tables too.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import msgspec
from pydantic import JsonValue

from roboirg.apps.real.study.failure_choices import FailureChoice, failure_choices
from roboirg.apps.real.study.study_plan import PlannedTrial, StudyPlan
from roboirg.core.errors import InvalidValueError
from roboirg.policies.contract.policy_calls import REAL_TRIAL
from roboirg.records.record import Record
from roboirg.records.store import RecordStore, iterate_records
from roboirg.runs.episode_errors import format_cause
from roboirg.runs.job_instruction import PreparedJob
from roboirg.runs.play.episode_record import begin_record

VOID = format_cause("infrastructure", "the operator declared the trial void")

State = Literal["open", "scored", "void"]
"""Not scored; scored; declared void."""

ROBOT = "a robot"
"""Name in the records of the robot that played a trial."""

SUCCESS = "success"
"""The choice of a trial in which the robot did what was meant."""
VOID_CHOICE = "void"
"""The choice of a trial that says nothing about the policy."""


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

    @classmethod
    def read(cls, plan: StudyPlan, folder: Path) -> TrialLog:
        """Read the records of a folder that are of this plan's trials and of a real robot.

        Records of simulated episodes, which may be in the same folder, are passed over.

        Raises:
            StoreError: the records cannot be read.
        """
        trial_log = cls(plan, folder)
        names = {trial.identity: trial.name for trial in plan.trials}
        for record in iterate_records(folder):
            name = names.get(record.identity)
            if name is not None and record.robot is not None:
                trial_log._history.setdefault(name, []).append(record)
        return trial_log

    def newest(self, name: str) -> Record | None:
        """Return the record of a trial that counts; None if there is none."""
        history = self._history.get(name)
        return history[-1] if history else None

    def revision(self, name: str) -> int:
        """Return a number that changes with the record of a trial."""
        return len(self._history.get(name, ()))

    def state(self, name: str) -> State:
        """Return the state of a trial: open, scored or void; its newest record decides."""
        record = self.newest(name)
        if record is None:
            return "open"
        return "void" if record.outcome == "error" else "scored"

    def next_to_score(self) -> PlannedTrial | None:
        """Return the first trial without a verdict."""
        for trial in self.plan.trials:
            if self.state(trial.name) == "open":
                return trial
        return None

    def score(
        self, trial: PlannedTrial, choice: str, *, operator: str, note: str = "", video: str = ""
    ) -> Record:
        """Store an operator's verdict and return its record, which is then on the disk.

        A trial may be scored again: the new record replaces the old one in tables, and keeps its
        video and other fields.

        Args:
            trial: to score.
            choice: ``success``, ``void``, or the key of one of the trial's failures.
            operator: name of the operator.
            note: free text.
            video: path of a video, relative to the folder; empty keeps that of the last record.

        Raises:
            InvalidValueError: the trial has no such failure.
            StoreError: the record cannot be written.
        """
        before = self.newest(trial.name) or begin_record(PreparedJob(trial.job))
        metadata = dict(before.policy_metadata)
        metadata[REAL_TRIAL] = {
            "operator": operator,
            "note": note,
            "trial": trial.name,
            "plan": self.plan.fingerprint,
        }
        record = msgspec.structs.replace(
            before,
            **_verdict(trial, choice, note),
            video=video or before.video,
            policy_metadata=metadata,
            robot=ROBOT,
            plan=self.plan.fingerprint,
        )
        with RecordStore(self.folder) as store:
            store.append(record)
        self._history.setdefault(trial.name, []).append(record)
        return record


def _verdict(trial: PlannedTrial, choice: str, note: str) -> dict[str, Any]:
    """Return the fields of a record that a choice decides: outcome, error, cause and attribution.

    `choice` is `SUCCESS`, `VOID_CHOICE` or the key of a failure.
    """
    cleared = {"error": None, "cause": None, "attribution": None}  # of an earlier verdict
    if choice == SUCCESS:
        return {**cleared, "outcome": "success"}
    if choice == VOID_CHOICE:
        cause = f"{VOID}; {note}" if note else VOID
        return {**cleared, "outcome": "error", "error": "infrastructure", "cause": cause}
    failure = _failure(trial, choice).attribution(note)
    return {
        **cleared,
        "outcome": "failure",
        "cause": failure.sentence,
        "attribution": failure,
    }


def _failure(trial: PlannedTrial, key: str) -> FailureChoice:
    """Return the failure of a key, such as ``"wrong_place:box_green"``.

    Raises:
        InvalidValueError: the trial has no such failure.
    """
    choices = {failure.key: failure for failure in failure_choices(trial.episode)}
    if key not in choices:
        raise InvalidValueError(
            f"A trial of {trial.job.task} cannot fail by {key!r}; its failures are "
            f"{', '.join(choices)}."
        )
    return choices[key]


def trial_metadata(record: Record) -> dict[str, JsonValue]:
    """Return the metadata of a real trial in its record; empty for other records."""
    metadata = record.policy_metadata.get(REAL_TRIAL)
    return dict(metadata) if isinstance(metadata, dict) else {}
