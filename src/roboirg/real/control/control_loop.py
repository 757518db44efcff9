"""The control loop: one trial of one policy on one robot.

At every control period, in this order: sense; check the cameras, the policy and the loop itself;
send one checked command, or hold the position. Whatever is wrong stops the arm in the period in
which it is noticed, before anything else happens.

| what goes wrong | kind of error |
| --- | --- |
| the policy raises, or its process dies | policy |
| it takes longer than it may | timeout |
| its command is malformed or outside the limits | invalid_action |
| a camera has no new picture, the robot raises | environment |
| the loop itself came to a halt | infrastructure |
"""

from __future__ import annotations

import contextlib
import traceback
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roboirg.core.actions import ARM_JOINTS, check_chunk
from roboirg.evaluation.episode_errors import EpisodeError, attribute_errors
from roboirg.evaluation.rollout_result import RolloutResult
from roboirg.real.control.deadman import LoopWatchdog
from roboirg.real.control.limits import Limits
from roboirg.real.control.policy_process import PolicyHost, PolicyReply
from roboirg.real.control.robot import HORIZON, Command, JudgingRobot, Robot, SensorReading
from roboirg.records.record import Job

ANSWER_SHARE = 0.5
"""Share of a control period that the loop waits for an answer before it holds the arm."""
SETUP_TIMEOUT_S = 600.0
"""For loading a policy and its reset; the arm is at rest."""
_SLACK = 1e-9


def _never() -> bool:
    return False


@dataclass
class ControlLoop:
    """Plays one trial.

    Attributes:
        robot: connected.
        host: the policy's.
        limits: of commands and times.
        cameras: whose pictures the policy wants.
        ended: whether an operator has ended the trial; asked in every period.
        held: control periods in which the arm waited for the policy.
        overruns: control periods that took longer than a period.
    """

    robot: Robot
    host: PolicyHost
    limits: Limits
    cameras: Sequence[str] = ()
    ended: Callable[[], bool] = _never
    held: int = 0
    overruns: int = 0
    _rows: deque[Command] = field(default_factory=deque)
    _asked: float | None = None
    _reply: PolicyReply | None = None
    _instruction: str = ""
    _is_prepared: bool = False
    _last: NDArray[np.float64] = field(default_factory=lambda: np.zeros(ARM_JOINTS))

    def play(self, job: Job, spec: str, seed: int, instruction: str) -> RolloutResult:
        """Play a trial to its end; the arm is at rest afterwards, whatever happened.

        The course of a robot that does not judge is left without a verdict.
        """
        course = RolloutResult(cause=None, error=None)
        self._instruction = instruction
        try:
            with self._stopping():
                self._set_up(job, spec, seed, course)
                with contextlib.ExitStack() as stack:
                    dead_man = None
                    # A policy in this process may keep the interpreter busy, and only on the twin.
                    if self.robot.clock.is_real and not self._shares_scene:
                        dead_man = LoopWatchdog(self.robot.stop, self.limits.dead_man_s)
                        stack.enter_context(dead_man)
                    self._run(job, course, dead_man)
            if isinstance(self.robot, JudgingRobot):
                with attribute_errors("environment"):
                    self.robot.judge(course)
            course.usage = self._request("close") or {}
        except EpisodeError as fault:
            if isinstance(self.robot, JudgingRobot) and self._is_prepared:
                with contextlib.suppress(Exception):  # what happened before is an extra
                    self.robot.judge(course)
            course.record_error(fault.kind, fault.cause, fault.details)
        return course

    @contextlib.contextmanager
    def _stopping(self) -> Iterator[None]:
        """Stop the arm at the end, above all after a fault; a stop that fails is one."""
        try:
            yield
        except BaseException:  # Ctrl-C too
            with contextlib.suppress(Exception):  # what happened first is what is told
                self.robot.stop()
            raise
        with attribute_errors("environment"):
            self.robot.stop()

    def _set_up(self, job: Job, spec: str, seed: int, course: RolloutResult) -> None:
        """Everything before the arm may move."""
        self._request("make", spec, seed)
        with attribute_errors("environment"):
            self.robot.prepare(job, self.cameras)
            sensed = self.robot.observe()
        self._is_prepared = True
        env = getattr(self.robot, "env", None)
        if env is not None and self._shares_scene:
            self._request("attach", env, getattr(self.robot, "lock"))  # noqa: B009
        # No video comes before a real trial.
        nothing = {
            name: np.zeros((0, *np.shape(value)), np.asarray(value).dtype)
            for name, value in sensed.fields.items()
        }
        course.policy_metadata = self._request("reset", self._instruction, nothing)
        self._last = sensed.joints

    @property
    def _shares_scene(self) -> bool:
        return bool(getattr(self.host, "shares_scene", False))

    def _run(self, job: Job, course: RolloutResult, dead_man: LoopWatchdog | None) -> None:
        clock, period = self.robot.clock, 1.0 / self.robot.rate
        due = clock.now()
        for tick in range(job.max_steps):
            if dead_man is not None:
                if dead_man.tripped_after is not None:
                    silence = f"{dead_man.tripped_after:.3f} s"
                    raise EpisodeError(
                        "infrastructure", f"the control loop stood still for {silence}", ""
                    )
                dead_man.feed()
            self._tick(period)
            course.steps = tick + 1
            due += period
            if clock.now() > due:
                # Between two commands lies a period, even if one came late: none are made up for.
                self.overruns += 1
                due = clock.now()
            clock.wait_until(due)
            if isinstance(self.robot, JudgingRobot) and self.robot.is_over():
                return
            if self.ended():
                return

    def _tick(self, period: float) -> None:
        """One control period: one command, or the position held."""
        with attribute_errors("environment"):
            sensed = self.robot.observe()
        self._check_cameras(sensed)
        death = self.host.death()
        if death is not None:
            raise EpisodeError("policy", death, "")
        self._listen(sensed, period)
        if not self._rows:
            with attribute_errors("environment"):
                self.robot.stop()
            self.held += 1
            self._last = sensed.joints
            self._check_patience()
            return
        command = self._rows.popleft()
        with attribute_errors("policy"):
            self.limits.check(command, self._last, sensed.joints, period)
        with attribute_errors("environment"):
            self.robot.command(command)
        self._last = command[:ARM_JOINTS]

    def _check_cameras(self, sensed: SensorReading) -> None:
        now = self.robot.clock.now()
        for camera in self.cameras:
            age = now - sensed.taken.get(camera, float("-inf"))
            if age > self.limits.picture_age_s + _SLACK:
                words = f"no new picture from the {camera} camera for {age:.3f} s"
                raise EpisodeError("environment", words, "")

    def _listen(self, sensed: SensorReading, period: float) -> None:
        """Ask for a chunk when there is none left, and take it when it is there."""
        clock = self.robot.clock
        if self._rows:
            return
        if self._asked is None:
            with attribute_errors("environment"):
                seen = {**sensed.fields, "instruction": self._instruction}
            self._asked, self._reply = clock.now(), None
            self.host.ask("act", seen)
        if self._reply is None:
            # Virtual time stands still while a policy thinks, and a policy says how long it took.
            patience = ANSWER_SHARE * period if clock.is_real else self._real_patience()
            self._reply = self.host.answer(patience)
        if self._reply is None:
            return
        thought = clock.now() - self._asked
        if not clock.is_real and thought < self._reply.latency_s - _SLACK:
            return
        rows = self._reply.checked()
        with attribute_errors("policy"):
            self._rows.extend(check_chunk(rows)[:HORIZON])
        self._asked = self._reply = None

    def _real_patience(self) -> float:
        """Real seconds to wait for an answer where time stands still: all of them, but once."""
        is_first = self._asked is not None and self.robot.clock.now() - self._asked <= _SLACK
        return self.limits.policy_timeout_s if is_first else 0.0

    def _check_patience(self) -> None:
        if self._asked is None:
            return
        thought = self.robot.clock.now() - self._asked
        if thought > self.limits.policy_timeout_s + _SLACK:
            limit = f"{self.limits.policy_timeout_s:g} s"
            raise EpisodeError("timeout", f"policy's act() took longer than {limit}", "")

    def _request(self, what: str, *args: Any) -> Any:  # noqa: ANN401
        """Have the policy do something while the arm is at rest."""
        self.host.ask(what, *args)
        reply = self.host.answer(SETUP_TIMEOUT_S)
        if reply is None:
            stack = "".join(traceback.format_stack(limit=3))
            raise EpisodeError(
                "timeout", f"policy's {what} took longer than {SETUP_TIMEOUT_S:g} s", stack
            )
        return reply.checked()
