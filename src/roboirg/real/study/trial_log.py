"""What is known of every trial: read from the records alone, so that nothing is lost by a kill.

A trial that was played on a robot and waits for its operator, and one whose score was taken back,
have a record too: an error, which is in no rate. Records are only ever added. The newest of a trial
counts, for the tables as for this.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from pydantic import JsonValue

from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.episode_errors import format_cause
from roboirg.evaluation.rollout_result import RolloutResult, make_record, utc_now
from roboirg.real.study.failure_choices import failure_choices
from roboirg.real.study.study_plan import PlannedTrial, StudyPlan
from roboirg.records.record import Record
from roboirg.records.store import RECORDS_FILE, RecordStore, StoreError, read_contents

METADATA = "real_trial"
"""Under which a record's ``policy_metadata`` hold what is said of a real trial."""
UNSCORED = format_cause("infrastructure", "played, and waiting for the operator's verdict")
WITHDRAWN = format_cause("infrastructure", "the operator took the score back")
VOID = format_cause("infrastructure", "the operator declared the trial void")

State = Literal["open", "waiting", "scored", "void", "error"]
"""Not played or scored; played but not scored; with a verdict; declared void; ended in an error."""

LOCK_PATIENCE_S = 10.0
LOCK_PAUSE_S = 0.02

SUCCESS, VOID_CHOICE = "success", "void"


@dataclass
class TrialLog:
    """The trials of a plan and their records.

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
        """What the folder says now.

        Raises:
            StoreError: the records cannot be read.
        """
        ledger = cls(plan, folder)
        names = {trial.identity: trial.name for trial in plan.trials}
        for record in read_contents(folder / RECORDS_FILE).records:
            name = names.get(record.identity)
            if name is not None:
                ledger._take(name, record)
        return ledger

    def _take(self, name: str, record: Record) -> None:
        history = self._history.setdefault(name, [])
        action = said_of(record).get("action")
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
        """The record of a trial that counts; None while there is none."""
        history = self._history.get(name)
        return history[-1] if history else None

    def count(self, name: str) -> int:
        """A number that changes whenever a trial's record does."""
        return len(self._history.get(name, ()))

    def state(self, name: str) -> State:
        """How a trial stands."""
        record = self.newest(name)
        if record is None:
            return "open"
        if record.outcome != "error":
            return "scored"
        said = str(record.cause)
        if said == UNSCORED:
            return "waiting"
        if said == WITHDRAWN:
            return "open"
        return "void" if said.startswith(VOID) else "error"

    def to_score(self) -> PlannedTrial | None:
        """The first trial without a verdict: of those that were played, else of all."""
        for states in (("waiting",), ("open",)):
            for trial in self.plan.trials:
                if self.state(trial.name) in states:
                    return trial
        return None

    @property
    def last_scored(self) -> str | None:
        """The trial whose score would be taken back."""
        return self._scored[-1] if self._scored else None

    def score(
        self, trial: PlannedTrial, choice: str, *, operator: str, note: str = "", video: str = ""
    ) -> Record:
        """Store an operator's verdict; when this returns, it is on the disk.

        Args:
            trial: which.
            choice: ``success``, ``void``, or the key of one of the trial's failures.
            operator: who judges.
            note: in free words.
            video: path of the film, relative to the folder.

        Raises:
            InvalidValueError: the trial cannot fail so.
            StoreError: it cannot be written.
        """
        said = {"action": "score", "operator": operator, "note": note}
        base = self.newest(trial.name) or make_record(
            trial.job, RolloutResult(), started_at=utc_now()
        )
        changes: dict[str, Any] = {
            "outcome": "success", "error": None, "cause": None, "attribution": None,
            "video": video or base.video, "details": None,
        }  # fmt: skip
        if choice == VOID_CHOICE:
            words = f"{VOID}; {note}" if note else VOID
            changes |= {"outcome": "error", "error": "infrastructure", "cause": words}
        elif choice != SUCCESS:
            choices = {one.key: one for one in failure_choices(trial.episode)}
            if choice not in choices:
                raise InvalidValueError(
                    f"A trial of {trial.job.task} cannot fail by {choice!r}; known: "
                    f"{', '.join(choices)}."
                )
            found = choices[choice].attribution(base.steps, note)
            changes |= {"outcome": "failure", "cause": found.sentence, "attribution": found}
        return self._append(trial, base.model_copy(update=changes), said)

    def undo(self, *, operator: str) -> str:
        """Take back the newest score: what was before it counts again. Returns the trial's name.

        Raises:
            InvalidValueError: there is none, or the trial has been played again since.
            StoreError: it cannot be written.
        """
        name = self.last_scored
        if name is None:
            raise InvalidValueError("There is no score to take back.")
        history = self._history[name]
        if said_of(history[-1]).get("action") != "score":
            raise InvalidValueError(f"{name} has been played again since it was scored.")
        before = history[-2] if len(history) > 1 else _withdrawn(history[-1])
        said = {**said_of(before), "action": "undo", "operator": operator}
        self._append(self.plan.trial(name), before, said)
        return name

    def add(self, trial: PlannedTrial, record: Record, said: dict[str, Any]) -> Record:
        """Store what came of playing a trial.

        Raises:
            StoreError: it cannot be written.
        """
        return self._append(trial, record, {"action": "play", **said})

    def _append(self, trial: PlannedTrial, record: Record, said: dict[str, Any]) -> Record:
        words: dict[str, JsonValue] = {
            **said_of(record), **said, "trial": trial.name, "plan": self.plan.fingerprint,
        }  # fmt: skip
        metadata = {**record.policy_metadata, METADATA: words}
        whole = record.model_copy(
            update={"policy_metadata": metadata, "plan": self.plan.fingerprint}
        )
        append(self.folder, whole)
        self._take(trial.name, whole)
        return whole


def said_of(record: Record) -> dict[str, JsonValue]:
    """What a record says of a real trial; empty if it is of none."""
    said = record.policy_metadata.get(METADATA)
    return dict(said) if isinstance(said, dict) else {}


def append(folder: Path, record: Record) -> None:
    """Add a record, waiting for others that write: the robot's loop and the page may both be open.

    Raises:
        StoreError: it cannot be written.
    """
    deadline = time.monotonic() + LOCK_PATIENCE_S
    while True:
        try:
            with RecordStore(folder) as store:
                store.append(record)
        except StoreError:
            if time.monotonic() > deadline:
                raise
            time.sleep(LOCK_PAUSE_S)
        else:
            return


def _withdrawn(record: Record) -> Record:
    return record.model_copy(
        update={
            "outcome": "error", "error": "infrastructure", "cause": WITHDRAWN,
            "attribution": None, "video": None,
        }
    )  # fmt: skip
