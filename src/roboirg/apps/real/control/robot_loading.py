"""From the name of a robot on the command line to its object."""

from __future__ import annotations

from collections.abc import Callable

from roboirg.apps.real.control.clock import RealClock, VirtualClock
from roboirg.apps.real.control.lerobot_arm import PREFIX, make_arm
from roboirg.apps.real.control.robot import Robot
from roboirg.apps.real.control.twin import Twin
from roboirg.core.errors import UnknownNameError
from roboirg.evaluation.records.record import TWIN, Job


def make_robot(spec: str, *, real_time: bool, arrange: Callable[[Job], None]) -> Robot:
    """Return a robot that is not connected yet.

    Args:
        spec: ``twin`` or ``lerobot:package.module:function?options``.
        real_time: whether the twin runs in real time; hardware always does.
        arrange: asks the operator to arrange the table, for hardware.

    Raises:
        UnknownNameError: the spec names no robot.
        InvalidValueError: the spec is malformed.
    """
    if spec == TWIN:
        return Twin(RealClock() if real_time else VirtualClock())
    if spec.startswith(PREFIX):
        return make_arm(spec, arrange)
    raise UnknownNameError("robot", spec, (TWIN, f"{PREFIX}package.module:function"))
