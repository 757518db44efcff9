"""A study on a robot: every trial of the plan that is not done yet, in order."""

from __future__ import annotations

import fcntl
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from roboirg.core.actions import JOINT_ANGLE
from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.evaluation.plan import instruct_job
from roboirg.evaluation.plan_parsing import name_and_spec
from roboirg.evaluation.rollout_result import make_record, utc_now
from roboirg.language import LANGUAGE_VERSION
from roboirg.policies.loading import is_privileged, load_policy_class, policy_version
from roboirg.policies.requirements import (
    wanted_actions,
    wanted_cameras,
    wanted_history,
)
from roboirg.real.control.control_loop import ControlLoop
from roboirg.real.control.limits import Limits
from roboirg.real.control.policy_process import PolicyHost, ProcessHost, ThreadHost
from roboirg.real.control.robot import JudgingRobot, Robot
from roboirg.real.study.study_plan import PlannedTrial, StudyPlan
from roboirg.real.study.trial_log import UNSCORED, TrialLog
from roboirg.records.record import Job, Record

ROBOT_LOCK = ".robot.lock"

Scorer = Literal["judge", "operator"]


def _never() -> bool:
    return False


@dataclass
class Study:
    """Plays a plan.

    Attributes:
        plan: what.
        folder: of the records.
        robot: on which; it is connected and closed here.
        limits: of commands and times.
        scorer: the robot's own judge, or an operator on the page.
        ended: whether the operator has ended the present trial.
        told: called with every record.
    """

    plan: StudyPlan
    folder: Path
    robot: Robot
    limits: Limits = field(default_factory=Limits)
    scorer: Scorer = "operator"
    ended: Callable[[], bool] = _never
    told: Callable[[PlannedTrial, Record], None] = lambda _trial, _record: None
    _hosts: dict[str, PolicyHost] = field(default_factory=dict)

    def run(self, policies: Sequence[str] = (), *, retry_errors: bool = True) -> tuple[Record, ...]:
        """Play what is not done; a trial that ends in an error does not end the study.

        Args:
            policies: only theirs, by their names in the plan, or ``NAME=SPEC`` if it is made in
                another way today; all of the plan's if it is empty.
            retry_errors: play again what ended in an error or was declared void.

        Returns:
            The records of the trials that were played.

        Raises:
            InvalidValueError: a policy is not in the plan, or cannot act on this robot.
            StoreError: records cannot be read or written.
        """
        wanted = self._wanted(policies)
        cameras = {name: self._cameras_of(spec or name) for name, spec in wanted.items()}
        ledger = TrialLog.read(self.plan, self.folder)
        _check_versions(ledger, wanted)
        undone = ("open", "error", "void") if retry_errors else ("open",)
        todo = [
            trial.model_copy(
                update={"job": trial.job.model_copy(update={"spec": wanted[trial.job.policy]})}
            )
            for trial in self.plan.trials
            if trial.job.policy in wanted and ledger.state(trial.name) in undone
        ]
        with alone_with_robot(self.folder):
            try:
                self.robot.connect()
                return tuple(self._trial(trial, cameras, ledger) for trial in todo)
            finally:
                for host in self._hosts.values():
                    host.close()
                self._hosts.clear()
                self.robot.close()

    def _trial(
        self, trial: PlannedTrial, cameras: Mapping[str, tuple[str, ...]], ledger: TrialLog
    ) -> Record:
        job, started_at, start = trial.job, utc_now(), time.monotonic()
        host = self._host(job)
        loop = ControlLoop(self.robot, host, self.limits, cameras[job.policy], self.ended)
        course = loop.play(job, job.policy_spec, policy_seed(trial), instruct_job(job).text)
        if course.error is not None:
            # It may still be busy, or dead: the next trial gets another.
            host.close()
            del self._hosts[job.policy]
        said: dict[str, object] = {
            "robot": self.robot.name, "held": loop.held, "overruns": loop.overruns,
            "rate": self.robot.rate,
        }  # fmt: skip
        record = make_record(
            job, course, started_at=started_at, duration_s=round(time.monotonic() - start, 3)
        )
        if course.error is None and self.scorer == "operator":
            if isinstance(self.robot, JudgingRobot):
                found = record.attribution
                said["judge"] = {
                    "outcome": record.outcome,
                    "failure": None if found is None else found.failure,
                }
            record = _left_open(record)
        stored = ledger.add(trial, record, said)
        self.told(trial, stored)
        return stored

    def _host(self, job: Job) -> PolicyHost:
        if job.policy not in self._hosts:
            apart = not is_privileged(job.policy_spec)
            self._hosts[job.policy] = ProcessHost() if apart else ThreadHost()
        return self._hosts[job.policy]

    def _wanted(self, policies: Sequence[str]) -> dict[str, str | None]:
        """The spec of each policy that is to be played, where it is not its name."""
        planned = {trial.job.policy: trial.job.spec for trial in self.plan.trials}
        wanted: dict[str, str | None] = {}
        for name, spec in map(name_and_spec, policies or self.plan.policies):
            if name not in planned:
                raise UnknownNameError("policy in the plan", name, planned)
            wanted[name] = planned[name] if spec == name else spec
        return wanted

    def _cameras_of(self, spec: str) -> tuple[str, ...]:
        """The cameras that a policy wants, if it can act here."""
        found = load_policy_class(spec)
        if wanted_actions(found) != JOINT_ANGLE:
            raise InvalidValueError(
                f"Policy {spec!r} acts in {wanted_actions(found).name!r}; the control loop takes "
                f"{JOINT_ANGLE.name!r} alone."
            )
        if wanted_history(found) is not None:
            raise InvalidValueError(
                f"Policy {spec!r} wants observe_every={wanted_history(found)}; the control loop "
                "has an observation for each chunk."
            )
        if is_privileged(spec) and not isinstance(self.robot, JudgingRobot):
            raise InvalidValueError(
                f"Policy {spec!r} looks behind the scenes, which only the twin has; play it with "
                "--robot twin."
            )
        return wanted_cameras(found)


def policy_seed(trial: PlannedTrial) -> int:
    """The policy's seed in a trial: the same as in simulation."""
    seeds = np.random.SeedSequence((trial.job.policy_seed, trial.episode.seed))
    return int(seeds.generate_state(1)[0])


def _check_versions(ledger: TrialLog, policies: Mapping[str, str | None]) -> None:
    """Refuse to mix words, worlds or policies of two versions."""
    now = {name: policy_version(spec or name) for name, spec in policies.items()}
    for trial in ledger.plan.trials:
        record = ledger.newest(trial.name)
        if record is None or record.policy not in now:
            continue
        for what, theirs, ours in (
            ("the policy", record.policy_version, now[record.policy]),
            ("the language", record.language_version, str(LANGUAGE_VERSION)),
            ("the environment", record.environment_version, ENVIRONMENT_VERSION),
        ):
            if theirs != ours:
                raise InvalidValueError(
                    f"{ledger.folder} holds {trial.name} with {what} in version {theirs}, which "
                    f"is {ours} now; make a plan in another folder."
                )


@contextmanager
def alone_with_robot(folder: Path) -> Iterator[None]:
    """Only one process at a time may command the robot of a study.

    Raises:
        InvalidValueError: another does.
    """
    lock = os.open(folder / ROBOT_LOCK, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InvalidValueError(
                f"Another process plays the study in {folder}; wait for it or stop it."
            ) from None
        yield
    finally:
        os.close(lock)


def _left_open(record: Record) -> Record:
    """Played to its end, without a verdict yet: what a judge saw is not for the operator."""
    return record.model_copy(
        update={
            "outcome": "error",
            "error": "infrastructure",
            "cause": UNSCORED,
            "attribution": None,
            "events": (),
        }
    )
