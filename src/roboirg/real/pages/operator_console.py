"""The operator at the terminal: told what to arrange and what happened, and may end a trial."""

from __future__ import annotations

import select
import sys

from roboirg.real.study.study_plan import PlannedTrial, StudyPlan
from roboirg.real.study.trial_log import UNSCORED
from roboirg.real.study.trial_text import places_of, turns_of
from roboirg.records.record import Job, Record


class OperatorConsole:
    """Talks to whoever sits at the terminal.

    Args:
        plan: of the study.

    Attributes:
        faulty: the errors so far, in words.
    """

    def __init__(self, plan: StudyPlan) -> None:
        self._trials = {trial.identity: trial for trial in plan.trials}
        self._total, self._count = len(plan.trials), 0
        self.faulty: list[str] = []

    def arrange(self, job: Job) -> None:
        """Say what is to be arranged, and wait for Enter.

        Raises:
            EOFError: nobody is there.
        """
        trial = self._trials[job.model_copy(update={"spec": None})]
        print(f"\n{trial.name}: arrange")  # noqa: T201 - it is a conversation
        for line in (*places_of(trial), "say:", *turns_of(trial)):
            print(f"  {line}")  # noqa: T201
        input("The arm is at home, everything in its place, nobody within reach? Enter starts. ")
        print("Enter ends the trial; the emergency stop is the robot's own.")  # noqa: T201

    def ended(self) -> bool:
        """Whether Enter has been pressed."""
        if not sys.stdin.isatty():
            return False
        ready, _, _ = select.select([sys.stdin], [], [], 0.0)
        if ready:
            sys.stdin.readline()
        return bool(ready)

    def tell(self, trial: PlannedTrial, record: Record) -> None:
        """Say how a trial ended."""
        self._count += 1
        outcome = "played" if record.cause == UNSCORED else record.outcome
        words = "" if outcome in ("success", "played") else f": {record.cause}"
        print(f"{self._count}. {trial.name} {outcome}, {record.steps} steps{words}", flush=True)  # noqa: T201
        if outcome == "error":
            self.faulty.append(f"{trial.name}: {record.cause}")
