"""The operator's terminal: asks for arrangements, reports trials and can end one."""

from __future__ import annotations

import select
import sys

import msgspec

from roboirg.apps.real.study.study_plan import PlannedTrial, StudyPlan
from roboirg.apps.real.study.trial_log import UNSCORED
from roboirg.apps.real.study.trial_text import describe_positions, spoken_turns
from roboirg.evaluation.records.record import Job, Record


class OperatorConsole:
    """Prints to the operator's terminal and reads the Enter key.

    Args:
        plan: of the study.

    Attributes:
        errors: a line for each trial that ended in an error.
    """

    def __init__(self, plan: StudyPlan) -> None:
        self._trials = {trial.identity: trial for trial in plan.trials}
        self._count = 0
        self.errors: list[str] = []

    def request_arrangement(self, job: Job) -> None:
        """Print what to arrange and say, and wait for Enter.

        Raises:
            EOFError: standard input is closed.
        """
        trial = self._trials[msgspec.structs.replace(job, spec=None)]
        print(f"\n{trial.name}: arrange")  # noqa: T201 - this class is a terminal
        for line in (*describe_positions(trial), "say:", *spoken_turns(trial)):
            print(f"  {line}")  # noqa: T201
        input(
            "Is the arm at home, everything in its place and every person out of reach? "
            "Press Enter to start. "
        )
        print("Press Enter to end the trial; in an emergency use the robot's own stop.")  # noqa: T201

    def stop_requested(self) -> bool:
        """Return whether Enter has been pressed."""
        if not sys.stdin.isatty():
            return False
        ready, _, _ = select.select([sys.stdin], [], [], 0.0)
        if ready:
            sys.stdin.readline()
        return bool(ready)

    def report(self, trial: PlannedTrial, record: Record) -> None:
        """Print how a trial ended."""
        self._count += 1
        outcome = "played" if record.cause == UNSCORED else record.outcome
        cause = "" if outcome in ("success", "played") else f": {record.cause}"
        print(f"{self._count}. {trial.name} {outcome}, {record.steps} steps{cause}", flush=True)  # noqa: T201
        if outcome == "error":
            self.errors.append(f"{trial.name}: {record.cause}")
