"""What goes wrong stops the arm within a control period, and is an error of that trial alone."""

import math
import os
import re
import signal
import threading
import time

import msgspec
import numpy as np
import pytest

from roboirg.apps.real.control.clock import RealClock
from roboirg.apps.real.control.control_loop import ControlLoop
from roboirg.apps.real.control.limits import Limits
from roboirg.apps.real.control.policy_workers import PolicyProcess, PolicyThread
from roboirg.apps.real.control.robot import COMMAND_RATE
from roboirg.apps.real.control.twin import Twin
from roboirg.apps.real.study.study_plan import make_study
from roboirg.apps.real.study.study_run import Study
from roboirg.apps.real.study.trial_log import TrialLog
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.records.record import Job

pytestmark = pytest.mark.sim

PERIOD = 1.0 / COMMAND_RATE
JOB = Job(
    policy="x",
    task="PutInBox",
    split="val",
    episode=1,
    max_steps=200,
    options=InstructionOptions("explicit"),
)
CHUNK = 20


class Watched(Twin):
    """The twin, and a log of what it was told when."""

    def __init__(self, clock=None):
        super().__init__(clock)
        self.log = []

    def prepare(self, job, cameras):
        super().prepare(job, cameras)
        self.log = []

    def command(self, command):
        self.log.append((self.clock.now() - self._started_at, "command", command.copy()))
        super().command(command)

    def stop(self):
        self.log.append((self.clock.now() - self._started_at, "stop", None))
        super().stop()

    def last_command(self):
        return max((when for when, kind, _ in self.log if kind == "command"), default=-math.inf)

    def first_stop_after(self, moment):
        return min(when for when, kind, _ in self.log if kind == "stop" and when >= moment)


class Blinking(Watched):
    """A camera takes no more pictures from a certain moment on."""

    blind, since = "wrist", 0.0

    def taken(self, camera):
        usual = super().taken(camera)
        return min(usual, self._started_at + self.since) if camera == self.blind else usual


def play(name, robot=None, *, limits=None, worker=None, cameras=(), job=JOB):
    robot = robot or Watched()
    worker = worker or PolicyThread()
    loop = ControlLoop(robot, worker, limits or Limits(), cameras)
    result = loop.play(job, f"faulty_policies:{name}", 0, "Do it.")
    worker.close()
    return result, robot, loop


def test_a_policy_that_stays_uses_its_time_in_chunks():
    result, robot, loop = play("Still")
    assert (result.outcome, result.error, result.steps) == ("failure", None, JOB.max_steps)
    assert result.timed_out
    assert loop.held == 0
    # One command in every control period, by the virtual clock.
    moments = [when for when, kind, _ in robot.log if kind == "command"]
    assert np.allclose(moments, np.arange(JOB.max_steps) * PERIOD)


@pytest.mark.parametrize(
    ("name", "row", "words"),
    [
        ("Jumps", 7, r"^invalid action: joint 4 would move at 10\.\d+ rad/s; at most 1\.5\.$"),
        ("NotFinite", 0, r"^invalid action: Action value 3 is nan; .*"),
        ("Dives", None, r"^invalid action: the tool would go to [xz] = .* workspace is from .*"),
        ("BeyondJoint", None, r"^invalid action: joint 7 would (move|go) .*"),
    ],
)
def test_a_command_outside_the_limits_is_never_sent(name, row, words):
    limits = Limits(workspace_low=(0.2, -0.5, 0.15))
    result, robot, _ = play(name, limits=limits)
    assert (result.outcome, result.error) == ("error", "invalid_action")
    assert re.match(words, result.cause), result.cause
    # In the period in which the bad command was due the arm was stopped instead.
    last = robot.last_command()
    assert robot.first_stop_after(last) - last <= PERIOD + 1e-9
    if row is not None:
        assert result.steps == 2 * CHUNK + row
    sent = np.array([command for _, kind, command in robot.log if kind == "command"])
    assert np.isfinite(sent).all()
    assert np.abs(np.diff(sent[:, :7], axis=0)).max() <= limits.joint_speed * PERIOD + 1e-9


def test_a_late_policy_is_waited_for_at_rest_and_then_given_up():
    result, robot, loop = play("Late", limits=Limits(policy_timeout_s=1.0))
    assert (result.outcome, result.error) == ("error", "timeout")
    assert result.cause == "timeout: policy's act() took longer than 1 s"
    asked = 2 * CHUNK * PERIOD
    assert robot.last_command() == pytest.approx(asked - PERIOD)
    # The arm stops in the very period in which a command is missing.
    assert robot.first_stop_after(robot.last_command()) == pytest.approx(asked)
    assert loop.held == 22
    # And the joints stay where they are.
    joints = robot.observe().joints
    assert np.abs(joints - robot._hold[:7]).max() < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("worker", [PolicyThread, PolicyProcess])
def test_in_virtual_time_a_slow_machine_is_not_a_slow_policy(worker):
    result, _, loop = play("Slow", limits=Limits(policy_timeout_s=0.05), worker=worker())
    assert (result.outcome, result.error, result.steps) == ("failure", None, JOB.max_steps)
    assert loop.held == 0


def test_a_policy_that_never_replies_is_given_up_and_named():
    class Mute(PolicyThread):
        """Its policy acts, but the replies are lost."""

        def send(self, method, *args):
            self.lost = method == "act"
            super().send(method, *args)

        def receive(self, timeout_s):
            return None if self.lost else super().receive(timeout_s)

    robot, worker = Watched(), Mute()
    loop = ControlLoop(robot, worker, Limits())
    make = worker.send

    def limited(method, *args):
        # Loading and resetting may take long on this machine.
        loop.reply_timeout_s = 0.2 if method == "act" else 600.0
        make(method, *args)

    worker.send = limited
    result = loop.play(JOB, "faulty_policies:Still", 0, "Do it.")
    worker.close()
    assert (result.outcome, result.error) == ("error", "timeout")
    assert result.cause == "timeout: policy's act() did not return within 0.2 s"
    assert robot.last_command() == -math.inf


def test_a_policy_that_thinks_for_a_while_is_waited_for():
    result, _, loop = play("Thoughtful")
    assert result.error is None
    # Of every 25 periods 5 are waited.
    chunks = math.ceil((JOB.max_steps - CHUNK) / (CHUNK + 5))
    assert loop.held == 5 * chunks


@pytest.mark.parametrize(
    ("name", "cause"),
    [
        ("Raises", "policy: ValueError: no idea"),
        ("Leaves", "policy: the process ended with exit code 3 in the policy's act()"),
    ],
)
def test_a_policy_that_dies_stops_the_arm(name, cause):
    result, robot, _ = play(name, worker=PolicyProcess())
    assert (result.outcome, result.error, result.cause) == ("error", "policy", cause)
    last = robot.last_command()
    assert last == pytest.approx((2 * CHUNK - 1) * PERIOD)
    assert robot.first_stop_after(last) - last <= PERIOD + 1e-9


def test_a_policy_that_is_killed_while_the_arm_moves_stops_it():
    worker = PolicyProcess()

    class Killing(Watched):
        def command(self, command):
            super().command(command)
            if len(self.log) == 30:
                os.kill(*worker._hosts.pids, signal.SIGKILL)
                while worker.loss() is None:
                    time.sleep(0.001)

    result, robot, _ = play("Still", Killing(), worker=worker)
    assert result.cause == "infrastructure: the process died of signal 9"
    assert result.steps == 30
    assert robot.first_stop_after(robot.last_command()) - robot.last_command() <= PERIOD + 1e-9


@pytest.mark.parametrize("blind", ["front", "wrist"])
def test_a_camera_that_stops_stops_the_arm(blind):
    robot = Blinking()
    # The last picture is 1/60 s after a command; it is too old 0.05 s later.
    robot.blind, robot.since = blind, 1.0 + 1.0 / 60.0
    limits = Limits()
    result, _, _ = play("Watching", robot, cameras=("front", "wrist"), limits=limits)
    assert (result.outcome, result.error) == ("error", "environment")
    assert result.cause.startswith(f"environment: no new picture from the {blind} camera for 0.0")
    overdue = robot.since + limits.picture_age_s
    stopped = robot.first_stop_after(overdue - 1e-9)
    assert stopped - overdue <= PERIOD
    assert robot.last_command() <= overdue


def test_cameras_that_work_stop_nothing():
    result, _, _ = play("Watching", cameras=("front", "wrist"))
    assert result.error is None


def test_a_robot_that_raises_is_stopped():
    class Broken(Watched):
        def command(self, command):
            if len(self.log) == 30:
                raise ConnectionError("the controller is gone")
            super().command(command)

    result, robot, _ = play("Still", Broken())
    assert result.cause == "environment: ConnectionError: the controller is gone"
    assert result.error == "environment"
    assert robot.log[-1][1] == "stop"


def test_in_real_time_too_a_killed_policy_stops_the_arm_long_before_the_watchdog():
    worker, robot = PolicyProcess(), Watched(RealClock())
    killed, over = [], threading.Event()

    def kill():
        while not any(kind == "command" for _, kind, _ in robot.log):
            if over.wait(0.005):
                return
        os.kill(*worker._hosts.pids, signal.SIGKILL)
        killed.append(robot.clock.now() - robot._started_at)

    killer = threading.Thread(target=kill, daemon=True)
    killer.start()
    # Longer than a busy machine needs to notice a dead process.
    limits = Limits(watchdog_timeout_s=300.0, policy_timeout_s=300.0)
    job = msgspec.structs.replace(JOB, max_steps=2_000)
    result, _, _ = play("Still", robot, worker=worker, limits=limits, job=job)
    over.set()
    killer.join()
    assert result.cause.startswith("infrastructure: the process died of signal 9")
    assert robot.first_stop_after(killed[0]) - killed[0] <= limits.watchdog_timeout_s / 2
    gaps = np.diff([when for when, kind, _ in robot.log if kind == "command"])
    # A busy machine may log a command late; the one after it then only seems early.
    punctual = gaps[:-1] < 1.5 * PERIOD
    assert (gaps[1:][punctual] > 0.5 * PERIOD).all()


@pytest.mark.slow
def test_after_a_late_command_comes_a_whole_period():
    class Stalling(Watched):
        def observe(self):
            if len(self.log) == 15:
                time.sleep(5 * PERIOD)
            return super().observe()

    robot = Stalling(RealClock())
    result, _, loop = play("Still", robot, limits=Limits(watchdog_timeout_s=300.0))
    assert result.error is None
    assert loop.overruns >= 1
    moments = [when for when, kind, _ in robot.log if kind == "command"]
    late = next(n for n, when in enumerate(moments) if when >= robot.log[14][0] + 5 * PERIOD)
    assert moments[late + 1] - moments[late] > 0.5 * PERIOD


def test_a_hanging_loop_is_stopped_by_the_watchdog():
    class Stuck(Watched):
        hung = False

        def observe(self):
            # On a busy machine, the arm may have been stopped before, for a late answer.
            if (before := len(self.log)) >= 15 and not self.hung:
                self.hung = True
                while not any(kind == "stop" for _, kind, _ in self.log[before:]):
                    time.sleep(0.01)
            return super().observe()

    robot = Stuck(RealClock())
    result, _, _ = play(
        "Still", robot, limits=Limits(watchdog_timeout_s=0.3), worker=PolicyProcess()
    )
    assert result.error == "infrastructure"
    assert re.match(r"infrastructure: the control loop hung for \d", result.cause)


@pytest.mark.slow
def test_a_trial_that_goes_wrong_does_not_end_the_study(tmp_path):
    policies = [f"faulty_policies:{name}" for name in ("Still", "Jumps", "Late", "Leaves")]
    plan = make_study(
        policies, tasks=("PutInBox",), settings=("explicit", "spatial"), trials=1,
        demonstrations=0, max_steps=120,
    )  # fmt: skip
    study = Study(plan, tmp_path, Watched(), Limits(policy_timeout_s=1.0), scorer="judge")
    records = study.run()
    assert len(records) == 8
    found = {record.policy.partition(":")[2]: record for record in records}
    assert found["Still"].outcome == "failure"
    assert found["Still"].attribution.failure == "nothing_reached"
    assert {name: one.error for name, one in found.items()} == {
        "Still": None, "Jumps": "invalid_action", "Late": "timeout", "Leaves": "policy",
    }  # fmt: skip
    trial_log = TrialLog.read(plan, tmp_path)
    states = {trial.job.policy: trial_log.state(trial.name) for trial in plan.trials}
    assert sorted(states.values()) == ["error", "error", "error", "scored"]
    # Errors are tried again, what has a verdict is not; or nothing is.
    assert study.run(retry_errors=False) == ()
    assert {record.policy for record in study.run()} == set(policies) - {policies[0]}


def test_two_versions_of_a_policy_are_not_mixed(tmp_path, monkeypatch):
    module = tmp_path / "of_two_versions.py"
    monkeypatch.syspath_prepend(tmp_path)
    words = "from faulty_policies import Still\n\n\nclass Versioned(Still):\n    version = "
    module.write_text(f'{words}"one"\n', encoding="utf-8")
    folder = tmp_path / "study"
    folder.mkdir()
    plan = make_study(
        ("of_two_versions:Versioned",), tasks=("PutInBox",), settings=("explicit", "direct"),
        trials=1, demonstrations=0, max_steps=5,
    )  # fmt: skip
    study = Study(plan, folder, Watched(), scorer="judge")
    assert len(study.run()) == 2
    module.write_text(f'{words}"two"\n', encoding="utf-8")
    with pytest.raises(InvalidValueError, match="the policy in version one, which is two now"):
        study.run()


def test_a_policy_may_have_a_name_and_be_made_in_another_way_later(tmp_path):
    plan = make_study(
        ("mine=faulty_policies:Raises",), tasks=("PutInBox",), settings=("explicit",), trials=1,
        demonstrations=0, max_steps=60,
    )  # fmt: skip
    assert plan.policies == ("mine",)
    study = Study(plan, tmp_path, Watched(), scorer="judge")
    (record,) = study.run()
    assert (record.policy, record.error) == ("mine", "policy")
    (record,) = study.run(["mine=faulty_policies:Still"])
    assert (record.policy, record.spec) == ("mine", "faulty_policies:Still")
    assert record.outcome == "failure"
    assert TrialLog.read(plan, tmp_path).state(plan.trials[0].name) == "scored"
