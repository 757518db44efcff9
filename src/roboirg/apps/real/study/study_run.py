"""Run a study on a robot: all open trials of the plan, in order."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, get_args

import msgspec

from roboirg.apps.real.control.control_loop import ControlLoop, never
from roboirg.apps.real.control.limits import Limits
from roboirg.apps.real.control.policy_workers import PolicyProcess, PolicyThread
from roboirg.apps.real.control.robot import HORIZON, JudgingRobot, Robot
from roboirg.apps.real.study.study_plan import PlannedTrial, StudyPlan
from roboirg.apps.real.study.trial_log import UNSCORED, TrialLog
from roboirg.cli.names import known_name
from roboirg.core.actions import JOINT_ANGLE
from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.core.instruction_options import DEFAULT_DELIVERY
from roboirg.evaluation.hosting.policy_descriptions import describe_policy
from roboirg.evaluation.plan.option_parsing import name_and_spec
from roboirg.evaluation.play.job_instruction import instruct_job
from roboirg.evaluation.play.rollout_result import make_record, utc_now
from roboirg.evaluation.records.record import Job, Record
from roboirg.language import LANGUAGE_VERSION
from roboirg.policies.by_name.loading import is_privileged
from roboirg.policies.by_name.policy_specs import SYSTEM
from roboirg.policies.by_name.systems import find_system
from roboirg.policies.contract.policy_urls import is_url, parse_query, split_url
from roboirg.policies.contract.random_state import episode_policy_seed
from roboirg.util.atomic_write import locked

ROBOT_LOCK = ".robot.lock"

Scorer = Literal["judge", "operator"]
_SCHEME, _OPTION = "mme-vla", "execute"


@dataclass
class Study:
    """Plays the trials of a plan.

    Attributes:
        plan: of the study.
        folder: of the records.
        robot: connected and closed here.
        limits: of commands and times.
        scorer: the robot's own judge, or an operator on the page.
        stop_requested: returns whether the operator has ended the present trial.
        on_record: called with every trial and its record.
    """

    plan: StudyPlan
    folder: Path
    robot: Robot
    limits: Limits = field(default_factory=Limits)
    scorer: Scorer = "operator"
    stop_requested: Callable[[], bool] = never
    on_record: Callable[[PlannedTrial, Record], None] = lambda _trial, _record: None
    _workers: dict[str, PolicyThread] = field(default_factory=dict)

    def run(self, policies: Sequence[str] = (), *, retry_errors: bool = True) -> tuple[Record, ...]:
        """Play the open trials; an error ends its own trial only.

        Args:
            policies: names in the plan of the policies to play, or ``NAME=SPEC`` for another spec
                than the plan's; empty for all.
            retry_errors: whether to play trials again that ended in an error or are void.

        Returns:
            The records of the trials that were played.

        Raises:
            UnknownNameError: a policy is not in the plan.
            InvalidValueError: a policy cannot act on this robot, another process uses it, or a
                trial's instruction is to be delivered in turns.
            StoreError: records cannot be read or written.
        """
        _check_delivery(self.plan)
        specs = self._selected_specs(policies)
        cameras = {name: self._check_policy(spec or name) for name, spec in specs.items()}
        trial_log = TrialLog.read(self.plan, self.folder)
        _check_versions(trial_log, specs)
        to_play = ("open", "error", "void") if retry_errors else ("open",)
        trials = [
            msgspec.structs.replace(
                trial, job=msgspec.structs.replace(trial.job, spec=specs[trial.job.policy])
            )
            for trial in self.plan.trials
            if trial.job.policy in specs and trial_log.state(trial.name) in to_play
        ]
        with lock_robot(self.folder):
            try:
                self.robot.connect()
                return tuple(self._play(trial, cameras, trial_log) for trial in trials)
            finally:
                for worker in self._workers.values():
                    worker.close()
                self._workers.clear()
                self.robot.close()

    def _play(
        self, trial: PlannedTrial, cameras: Mapping[str, tuple[str, ...]], trial_log: TrialLog
    ) -> Record:
        """Play one trial and store its record."""
        job, started_at, start = trial.job, utc_now(), time.monotonic()
        worker = self._worker(job)
        loop = ControlLoop(
            self.robot, worker, self.limits, cameras[job.policy], self.stop_requested
        )
        seed = episode_policy_seed(job.policy_seed, trial.episode.seed)
        result = loop.play(job, job.policy_spec, seed, instruct_job(job).text)
        if result.error is not None:
            # The worker may be dead or still busy: the next trial gets a new one.
            worker.close()
            del self._workers[job.policy]
        metadata: dict[str, object] = {
            "robot": self.robot.name, "held": loop.held, "overruns": loop.overruns,
            "rate": self.robot.rate,
        }  # fmt: skip
        record = make_record(
            job, result, started_at=started_at, duration_s=round(time.monotonic() - start, 3)
        )
        if result.error is None and self.scorer == "operator":
            if isinstance(self.robot, JudgingRobot):
                found = record.attribution
                metadata["judge"] = {
                    "outcome": record.outcome,
                    "failure": None if found is None else found.failure,
                }
            record = _without_verdict(record)
        stored = trial_log.add(trial, record, metadata)
        self.on_record(trial, stored)
        return stored

    def _worker(self, job: Job) -> PolicyThread:
        if job.policy not in self._workers:
            privileged = is_privileged(job.policy_spec)
            self._workers[job.policy] = PolicyThread() if privileged else PolicyProcess()
        return self._workers[job.policy]

    def _selected_specs(self, policies: Sequence[str]) -> dict[str, str | None]:
        """Return the spec of each policy to play by its name; None where the name is the spec."""
        planned = {trial.job.policy: trial.job.spec for trial in self.plan.trials}
        specs: dict[str, str | None] = {}
        for name, spec in map(name_and_spec, policies or self.plan.policies):
            if name not in planned:
                raise UnknownNameError("policy in the plan", name, planned)
            chosen = planned[name] or name if spec == name else spec
            played = at_horizon(chosen)
            specs[name] = None if played == name else played
        return specs

    def _check_policy(self, spec: str) -> tuple[str, ...]:
        """Check that a policy can act on this robot, and return the cameras that it uses."""
        needs = describe_policy(spec).needs
        if needs.actions != JOINT_ANGLE.name:
            raise InvalidValueError(
                f"Policy {spec!r} acts in {needs.actions!r}; the control loop "
                f"supports {JOINT_ANGLE.name!r} only."
            )
        if needs.observe_every is not None:
            raise InvalidValueError(
                f"Policy {spec!r} requires observe_every={needs.observe_every}; the control loop "
                "gives one observation for each chunk."
            )
        if is_privileged(spec) and not isinstance(self.robot, JudgingRobot):
            raise InvalidValueError(
                f"Policy {spec!r} reads the simulator's state, which only the twin has; play it "
                "with --robot twin."
            )
        return needs.cameras


def _check_delivery(plan: StudyPlan) -> None:
    """Raise if an instruction is to be delivered in turns."""
    for trial in plan.trials:
        if trial.job.options.delivery != DEFAULT_DELIVERY:
            raise InvalidValueError(
                f"Trial {trial.name!r} has delivery={trial.job.options.delivery!r}; in a study "
                f"with a robot the whole instruction is given at once ({DEFAULT_DELIVERY!r})."
            )


def select_scorer(name: str, robot: Robot) -> Scorer:
    """Return who scores the trials on a robot.

    Args:
        name: judge or operator; empty for the robot's judge if it has one.
        robot: of the study.

    Raises:
        UnknownNameError: the name is neither judge nor operator.
        InvalidValueError: the robot has no judge.
    """
    has_judge = isinstance(robot, JudgingRobot)
    if not name:
        return "judge" if has_judge else "operator"
    scorer: Scorer = known_name("scorer", name, get_args(Scorer))
    if scorer == "judge" and not has_judge:
        raise InvalidValueError(
            f"The robot {robot.name!r} cannot judge; score its trials with roboirg real score."
        )
    return scorer


def _check_versions(trial_log: TrialLog, policies: Mapping[str, str | None]) -> None:
    """Refuse to mix two versions of a policy, the language or the environment."""
    now = {
        name: describe_policy(spec or name, again=True).version for name, spec in policies.items()
    }
    for trial in trial_log.plan.trials:
        record = trial_log.newest(trial.name)
        if record is None or record.policy not in now:
            continue
        for name, stored, current in (
            ("the policy", record.policy_version, now[record.policy]),
            ("the language", record.language_version, str(LANGUAGE_VERSION)),
            ("the environment", record.environment_version, ENVIRONMENT_VERSION),
        ):
            if stored != current:
                raise InvalidValueError(
                    f"{trial_log.folder} holds {trial.name} with {name} in version {stored}, which "
                    f"is {current} now; make a plan in another folder."
                )


def lock_robot(folder: Path) -> AbstractContextManager[None]:
    """Lock the robot of a study, which only one process at a time may command."""
    taken = f"Another process plays the study in {folder}; wait for it or stop it."
    return locked(folder / ROBOT_LOCK, taken)


def _without_verdict(record: Record) -> Record:
    """Return a record that waits for the operator's verdict, without what the judge saw."""
    return msgspec.structs.replace(
        record, outcome="error", error="infrastructure", cause=UNSCORED, attribution=None, events=()
    )


def at_horizon(spec: str) -> str:
    """Return a policy's spec with the study's horizon.

    Policies and systems behind ``mme-vla://`` execute fewer actions in simulation, as RoboMME's
    client does. What already names a number keeps it, as TTT-Expert's stride.
    """
    head, _, query = spec.partition("?")
    option = _OPTION
    url = spec
    if head.startswith(f"{SYSTEM}:"):
        url = find_system(head.partition(":")[2], parse_query(spec, query)).policy
        option = f"policy.{_OPTION}"
    if not is_url(url) or split_url(url).scheme != _SCHEME or _OPTION in split_url(url).options:
        return spec
    return f"{spec}{'&' if query else '?'}{option}={HORIZON}"
