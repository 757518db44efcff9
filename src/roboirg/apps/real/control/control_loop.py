"""The control loop: one trial of one policy on one robot.

Every control period has three steps: read the sensors; check the cameras, the policy and the loop
itself; send one checked command, or hold the position. Any fault stops the arm in the period in
which it is detected, before anything else happens.

| fault | kind of error |
| --- | --- |
| the policy raises, or its process dies | policy |
| its process is killed from outside | infrastructure |
| the policy exceeds its time limit | timeout |
| its command is malformed or outside the limits | invalid_action |
| a camera has no new picture, the robot raises | environment |
| the loop itself hangs | infrastructure |
"""

from __future__ import annotations

import contextlib
import signal
import time
import traceback
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from types import FrameType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roboirg.apps.real.control.limits import Limits
from roboirg.apps.real.control.policy_workers import PolicyReply, PolicyThread
from roboirg.apps.real.control.robot import HORIZON, Command, JudgingRobot, Robot, SensorReading
from roboirg.core.actions import ARM_JOINTS, check_chunk
from roboirg.evaluation.episode_errors import EpisodeError, attribute_errors
from roboirg.evaluation.play.rollout_result import RolloutResult
from roboirg.evaluation.records.record import Job
from roboirg.util.deadline_watch import DeadlineWatch

REPLY_WAIT_SHARE = 0.5
"""Share of a control period that the loop waits for a reply before it holds the arm."""
REPLY_TIMEOUT_S = 600.0
"""Of the machine's time, for loading a policy and its reset, when the arm is at rest; and for a
reply in virtual time, which the policy's limit does not measure."""
POLL_S = 0.25
"""How often the operator is heard while a policy computes in virtual time."""
_SLACK = 1e-9


def never() -> bool:
    """Ask for no stop."""
    return False


@dataclass
class ControlLoop:
    """Plays one trial.

    Attributes:
        robot: connected.
        worker: runs the policy.
        limits: of commands and times.
        cameras: names of the cameras that the policy uses.
        stop_requested: returns whether the operator has ended the trial; called in every period.
        reply_timeout_s: seconds of the machine's time after which a policy hangs; in virtual time
            the limits measure only the time that the policy reports.
        held: control periods in which the arm waited for the policy.
        overruns: control periods that took longer than a period.
    """

    robot: Robot
    worker: PolicyThread
    limits: Limits
    cameras: Sequence[str] = ()
    stop_requested: Callable[[], bool] = never
    reply_timeout_s: float = REPLY_TIMEOUT_S
    held: int = 0
    overruns: int = 0
    _actions: deque[Command] = field(default_factory=deque)
    _requested_at: float | None = None
    _reply: PolicyReply | None = None
    _instruction: str = ""
    _is_prepared: bool = False
    _sent_at: float = float("-inf")
    _last: NDArray[np.float64] = field(default_factory=lambda: np.zeros(ARM_JOINTS))

    def play(self, job: Job, spec: str, seed: int, instruction: str) -> RolloutResult:
        """Play a trial to its end; the arm is always at rest afterwards.

        Args:
            job: the trial.
            spec: of the policy.
            seed: of the policy.
            instruction: given to the policy.

        Returns:
            Without a verdict if the robot does not judge.
        """
        result = RolloutResult(cause=None, error=None)
        self._instruction = instruction
        try:
            with self._stopping():
                self._set_up(job, spec, seed, result)
                with contextlib.ExitStack() as stack:
                    watchdog = None
                    # A privileged policy in this process may block the interpreter; it runs on the
                    # twin only.
                    if self.robot.clock.is_real and not self.worker.shares_scene:
                        watchdog = stack.enter_context(DeadlineWatch(self.robot.stop))
                    self._run(job, result, watchdog)
            if isinstance(self.robot, JudgingRobot):
                with attribute_errors("environment"):
                    self.robot.judge(result)
            result.usage = self._request("close") or {}
        except EpisodeError as error:
            if isinstance(self.robot, JudgingRobot) and self._is_prepared:
                with contextlib.suppress(Exception):  # the events before the error are optional
                    self.robot.judge(result)
            result.record_error(error.kind, error.cause, error.details)
        return result

    @contextlib.contextmanager
    def _stopping(self) -> Iterator[None]:
        """Stop the arm at the end, also after an error; a failure to stop is an error too."""
        try:
            yield
        except BaseException:  # Ctrl-C too
            with contextlib.suppress(Exception):  # the first error is the one to report
                self.robot.stop()
            raise
        with attribute_errors("environment"):
            self.robot.stop()

    def _set_up(self, job: Job, spec: str, seed: int, result: RolloutResult) -> None:
        """Load the policy, prepare the robot and reset the policy; the arm does not move."""
        self._request("make", spec, seed)
        with attribute_errors("environment"):
            self.robot.prepare(job, self.cameras)
            reading = self.robot.observe()
        self._is_prepared = True
        env = getattr(self.robot, "env", None)
        if env is not None and self.worker.shares_scene:
            self._request("attach", env, getattr(self.robot, "lock"))  # noqa: B009
        # Real trials have no demonstration video.
        no_frames = {
            name: np.zeros((0, *np.shape(value)), np.asarray(value).dtype)
            for name, value in reading.fields.items()
        }
        result.policy_metadata, result.needs, result.inference = self._request(
            "reset", self._instruction, no_frames
        )
        self._last = reading.joints

    def _run(self, job: Job, result: RolloutResult, watchdog: DeadlineWatch | None) -> None:
        clock, period = self.robot.clock, 1.0 / self.robot.rate
        deadline = clock.now()
        for step in range(job.max_steps):
            if watchdog is not None:
                if watchdog.acted_after is not None:
                    silence = f"{watchdog.acted_after:.3f} s"
                    raise EpisodeError("infrastructure", f"the control loop hung for {silence}", "")
                watchdog.begin(self.limits.watchdog_timeout_s)
            self._step(period)
            result.steps = step + 1
            deadline += period
            if clock.now() > deadline:
                # A late command delays the next ones: after it comes a whole period.
                self.overruns += 1
                deadline = max(clock.now(), self._sent_at + period)
            clock.wait_until(deadline)
            if isinstance(self.robot, JudgingRobot) and self.robot.is_over():
                return
            if self.stop_requested():
                return

    def _step(self, period: float) -> None:
        """Run one control period: send one command, or hold the position."""
        with attribute_errors("environment"):
            reading = self.robot.observe()
        self._check_cameras(reading)
        loss = self.worker.loss()
        if loss is not None:
            raise EpisodeError(loss.kind, str(loss), "")
        self._update_actions(reading, period)
        if not self._actions:
            with attribute_errors("environment"):
                self.robot.stop()
            self.held += 1
            self._last = reading.joints
            self._check_policy_timeout()
            return
        command = self._actions.popleft()
        with attribute_errors("policy"):
            self.limits.check(command, self._last, reading.joints, period)
        with attribute_errors("environment"):
            self._sent_at = self.robot.clock.now()
            self.robot.command(command)
        self._last = command[:ARM_JOINTS]

    def _check_cameras(self, reading: SensorReading) -> None:
        now = self.robot.clock.now()
        for camera in self.cameras:
            age = now - reading.taken.get(camera, float("-inf"))
            if age > self.limits.picture_age_s + _SLACK:
                message = f"no new picture from the {camera} camera for {age:.3f} s"
                raise EpisodeError("environment", message, "")

    def _update_actions(self, reading: SensorReading, period: float) -> None:
        """Request a chunk when the last one is used up, and take it when it has arrived."""
        clock = self.robot.clock
        if self._actions:
            return
        if self._requested_at is None:
            with attribute_errors("environment"):
                observation = {**reading.fields, "instruction": self._instruction}
            self._requested_at, self._reply = clock.now(), None
            self.worker.send("act", observation)
        if self._reply is None:
            # Virtual time stands still while a policy computes; the reply holds its latency.
            self._reply = (
                self.worker.receive(REPLY_WAIT_SHARE * period)
                if clock.is_real
                else self._receive("act()", self.stop_requested)
            )
        if self._reply is None:
            return
        waited = clock.now() - self._requested_at
        if not clock.is_real and waited < self._reply.latency_s - _SLACK:
            return
        rows = self._reply.result()
        with attribute_errors("policy"):
            self._actions.extend(check_chunk(rows)[:HORIZON])
        self._requested_at = self._reply = None

    def _check_policy_timeout(self) -> None:
        if self._requested_at is None:
            return
        waited = self.robot.clock.now() - self._requested_at
        if waited > self.limits.policy_timeout_s + _SLACK:
            limit = f"{self.limits.policy_timeout_s:g} s"
            raise EpisodeError("timeout", f"policy's act() took longer than {limit}", "")

    def _request(self, method: str, *args: Any) -> Any:  # noqa: ANN401
        """Call a method of the policy while the arm is at rest, and return its result."""
        self.worker.send(method, *args)
        reply = self._receive(f"{method}()")
        return None if reply is None else reply.result()

    def _receive(self, what: str, stopped: Callable[[], bool] = never) -> PolicyReply | None:
        """Wait for a reply in the machine's time; None if the operator ends the trial."""
        deadline = time.monotonic() + self.reply_timeout_s
        while (left := deadline - time.monotonic()) > 0:
            reply = self.worker.receive(min(POLL_S, left))
            if reply is not None or stopped():
                return reply
        stack = "".join(traceback.format_stack(limit=3))
        limit = f"{self.reply_timeout_s:g} s"
        raise EpisodeError("timeout", f"policy's {what} did not return within {limit}", stack)


class Interruption:
    """Turns SIGINT and SIGTERM into KeyboardInterrupt, and remembers them.

    Python drops what is raised in finalizers and in callbacks of libraries. An arm must not move on
    because of that, so the control loop asks again in each period.
    """

    def __init__(self) -> None:
        self._came = False

    def watch(self) -> None:
        """Handle the signals from now on, in the main thread; an ignored SIGINT stays ignored."""
        signal.signal(signal.SIGTERM, self._handle)
        if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
            signal.signal(signal.SIGINT, self._handle)

    def before(self, requested: Callable[[], bool]) -> Callable[[], bool]:
        """Return a function that raises KeyboardInterrupt after a signal, else asks `requested`."""

        def ask() -> bool:
            if self._came:
                raise KeyboardInterrupt
            return requested()

        return ask

    def _handle(self, _number: int, _frame: FrameType | None) -> None:
        self._came = True
        raise KeyboardInterrupt
