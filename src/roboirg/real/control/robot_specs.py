"""Robots by their specs on the command line."""

from __future__ import annotations

from collections.abc import Callable
from typing import get_args

from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.real.control.clock import RealClock, VirtualClock
from roboirg.real.control.lerobot_arm import PREFIX, make_arm
from roboirg.real.control.robot import JudgingRobot, Robot
from roboirg.real.control.twin import Twin
from roboirg.real.study.study_run import Scorer
from roboirg.records.record import Job

TWIN = "twin"


def make_robot(spec: str, *, real_time: bool, arrange: Callable[[Job], None]) -> Robot:
    """A robot that is not connected yet.

    Args:
        spec: ``twin`` or ``lerobot:package.module:function?options``.
        real_time: of the twin; hardware knows no other time.
        arrange: has the table arranged, for hardware.

    Raises:
        UnknownNameError: it is neither.
        InvalidValueError: the spec is malformed.
    """
    if spec == TWIN:
        return Twin(RealClock() if real_time else VirtualClock())
    if spec.startswith(PREFIX):
        return make_arm(spec, arrange)
    raise UnknownNameError("robot", spec, (TWIN, f"{PREFIX}package.module:function"))


def check_scorer(name: str, robot: Robot) -> Scorer:
    """Who scores; by default the robot's judge if it has one.

    Raises:
        UnknownNameError: it is neither judge nor operator.
        InvalidValueError: the robot has no judge.
    """
    has_judge = isinstance(robot, JudgingRobot)
    if not name:
        return "judge" if has_judge else "operator"
    for known in get_args(Scorer):
        if name == known:
            if known == "judge" and not has_judge:
                raise InvalidValueError(
                    f"The robot {robot.name!r} cannot judge; score its trials with "
                    "roboirg real score."
                )
            scorer: Scorer = known
            return scorer
    raise UnknownNameError("scorer", name, get_args(Scorer))
