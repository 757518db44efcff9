"""A robot with LeRobot's interface, in real time: a stand-in object that has it."""

import re

import lab_arm
import numpy as np
import pytest

from roboirg.apps.real.control.clock import RealClock, VirtualClock
from roboirg.apps.real.control.lerobot_arm import (
    LeRobotArm,
    LeRobotArmOptions,
    make_arm,
)
from roboirg.apps.real.control.limits import Limits
from roboirg.apps.real.control.robot import JudgingRobot
from roboirg.apps.real.control.robot_loading import make_robot
from roboirg.apps.real.study.study_plan import make_study
from roboirg.apps.real.study.study_run import Study, select_scorer
from roboirg.apps.real.study.trial_log import TrialLog
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.evaluation.records.record import REAL_TRIAL
from roboirg.policies.lerobot_features import scaled_square

WATCHING, STILL = "faulty_policies:Watcher", "faulty_policies:Still"
# A busy machine is slow: what is tested here is not how quick it is.
PATIENT = Limits(picture_age_s=300.0, watchdog_timeout_s=300.0, policy_timeout_s=300.0)


def study_of(tmp_path, policies, arm, **options):
    plan = make_study(
        policies, tasks=("PutInBox",), settings=("explicit",), trials=1, demonstrations=0,
        max_steps=30,
    )  # fmt: skip
    arranged = []
    robot = LeRobotArm(arm, LeRobotArmOptions(**options), arranged.append)
    return plan, Study(plan, tmp_path, robot, PATIENT), arranged


def test_a_trial_waits_for_its_operator_and_the_arm_holds(tmp_path):
    arm = lab_arm.LabArm()
    plan, study, arranged = study_of(tmp_path, (WATCHING,), arm)
    (record,) = study.run()
    assert arranged == [plan.trials[0].job]
    assert TrialLog.read(plan, tmp_path).state(plan.trials[0].name) == "waiting"
    assert (record.steps, record.outcome) == (30, "error")
    assert not arm.is_connected
    # The policy asked for joint 1 to go on by 0.01 in each step of a chunk; the arm holds for steps
    # in which the policy has not answered yet, and a chunk may begin at joints that were observed
    # some steps before; both happen more often on a busy machine.
    first = [action["joint_1.pos"] for _, action in arm.sent]
    moved = record.steps - record.policy_metadata[REAL_TRIAL]["held"]
    assert 0.01 * moved - 0.12 <= max(first) <= 0.01 * moved + 0.02
    # At the end the arm holds.
    assert arm.sent[-1][1]["joint_1.pos"] == pytest.approx(max(first), abs=0.12)


def test_units_and_names_are_options(tmp_path):
    class InDegrees(lab_arm.LabArm):
        def __init__(self):
            super().__init__()
            turned = {f"j{n}": np.degrees(a) for n, a in enumerate(lab_arm.HOME, 1)}
            self.joints = turned | {"hand": 80.0}

    arm = InDegrees()
    options = LeRobotArmOptions(
        joint="j{}", gripper="hand", gripper_open=80.0, gripper_closed=2.0, degrees=True
    )
    robot = LeRobotArm(arm, options, lambda job: None)
    robot.connect()
    robot.prepare(None, ("front",))
    sensed = robot.observe()
    assert np.allclose(sensed.joints, lab_arm.HOME, atol=1e-6)
    assert np.allclose(sensed.fields["gripper"], 0.04)
    assert sensed.fields["front_rgb"].shape == (256, 256, 3)
    assert np.allclose(sensed.fields["end_effector"][:3], [-0.0605, 0, 0.5223], atol=0.01)
    robot.command(np.append(np.array(lab_arm.HOME) + 0.01, -1.0))
    assert arm.sent[-1][1]["j4"] == pytest.approx(-90.0 + np.degrees(0.01))
    assert arm.sent[-1][1]["hand"] == 2.0
    robot.close()


@pytest.mark.parametrize(
    ("fault", "cause"),
    [
        ("blind_after", r"environment: no new picture from the front camera for \d"),
        ("breaks_after", "environment: ConnectionError: OSError: cable"),
    ],
)
def test_hardware_that_fails_stops_and_is_an_error(tmp_path, fault, cause, capsys):
    arm = lab_arm.LabArm()
    setattr(arm, fault, 10)
    _, study, _ = study_of(tmp_path, (WATCHING,), arm)
    if fault == "blind_after":
        study.limits = PATIENT.model_copy(update={"picture_age_s": 0.5})
    (record,) = study.run()
    assert record.error == "environment"
    assert re.match(cause, record.cause)
    assert record.steps < 30
    held = [action for _, action in arm.sent[-2:]]
    assert held[-1]["joint_1.pos"] == pytest.approx(held[0]["joint_1.pos"], abs=0.03)


def test_a_robot_that_lacks_something_is_refused():
    with pytest.raises(InvalidValueError, match="is not a LeRobot robot; it has no disconnect"):
        make_arm("lerobot:lab_arm:make_none", lambda job: None)
    with pytest.raises(InvalidValueError, match="has no observation 'panda_1'"):
        make_arm("lerobot:lab_arm:make?joint=panda_{}", lambda job: None)
    with pytest.raises(InvalidValueError, match="option rate"):
        make_arm("lerobot:lab_arm:make?rate=0", lambda job: None)
    with pytest.raises(InvalidValueError, match=r"write lerobot:package\.module:function"):
        make_arm("lerobot:nowhere:make", lambda job: None)
    with pytest.raises(UnknownNameError, match="no robot 'arm'"):
        make_robot("arm", lambda job: None)
    arm = make_robot("lerobot:lab_arm:make", lambda job: None)
    assert not isinstance(arm, JudgingRobot)
    assert select_scorer("", arm) == "operator"
    with pytest.raises(InvalidValueError, match="cannot judge"):
        select_scorer("judge", arm)


def test_privileged_policies_are_for_the_twin(tmp_path):
    _, study, _ = study_of(tmp_path, ("listener",), lab_arm.LabArm())
    with pytest.raises(InvalidValueError, match="which only the twin has"):
        study.run()


def test_a_policy_by_url_is_refused_for_what_its_options_need(tmp_path):
    _, study, _ = study_of(tmp_path, ("mme-vla://localhost:1",), lab_arm.LabArm())
    with pytest.raises(InvalidValueError, match=r"requires observe_every=1; the control loop"):
        study.run()


def test_pictures_are_cut_to_the_middle():
    picture = np.zeros((480, 640, 3), np.uint8)
    picture[:, 80:560] = 200
    assert (scaled_square(picture) == 200).all()
    depth = np.full((480, 640), 1234, np.uint16)
    assert (scaled_square(depth, smooth=False) == 1234).all()


def test_the_twin_takes_real_time_as_an_option():
    assert isinstance(make_robot("twin", print).clock, VirtualClock)
    assert isinstance(make_robot("twin?real_time=true", print).clock, RealClock)
    with pytest.raises(UnknownNameError, match="realtime"):
        make_robot("twin?realtime=true", print)
