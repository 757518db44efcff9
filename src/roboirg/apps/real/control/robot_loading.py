"""From the name of a robot on the command line to its object."""

from __future__ import annotations

from collections.abc import Callable

from roboirg.apps.real.control.clock import RealClock, VirtualClock
from roboirg.apps.real.control.lerobot_arm import PREFIX, make_arm
from roboirg.apps.real.control.robot import Robot
from roboirg.apps.real.control.twin import Twin
from roboirg.core.errors import UnknownNameError
from roboirg.evaluation.records.record import TWIN, Job
from roboirg.policies.contract.option_checking import check_options
from roboirg.policies.contract.policy_urls import UrlOptions, parse_query


class TwinOptions(UrlOptions):
    """Options of ``twin``.

    Attributes:
        real_time: whether it runs in real time; hardware always does.
    """

    real_time: bool = False


def make_robot(spec: str, arrange: Callable[[Job], None]) -> Robot:
    """Return a robot that is not connected yet.

    Args:
        spec: ``twin``, ``twin?real_time=true`` or ``lerobot:package.module:function?options``.
        arrange: asks the operator to arrange the table, for hardware.

    Raises:
        UnknownNameError: the spec names no robot, or an unknown option.
        InvalidValueError: the spec is malformed.
    """
    name, _, query = spec.partition("?")
    if name == TWIN:
        options = check_options(TwinOptions, parse_query(spec, query), f"robot {spec!r}")
        return Twin(RealClock() if options.real_time else VirtualClock())
    if spec.startswith(PREFIX):
        return make_arm(spec, arrange)
    raise UnknownNameError("robot", spec, (TWIN, f"{PREFIX}package.module:function"))
