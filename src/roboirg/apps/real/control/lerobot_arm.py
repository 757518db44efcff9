"""Adapter for robots with LeRobot's interface (`lerobot.robots.Robot`).

A function of the lab, named ``lerobot:package.module:function``, configures the robot and returns
it, not yet connected. The adapter uses `connect`, `get_observation`, `send_action`, `disconnect`,
`is_connected`, `observation_features` and `action_features`. It does not import LeRobot.

`get_observation` may wait for a camera, so a thread calls it repeatedly, and the control loop gets
the newest observation. The time of a picture is when its observation arrived; a picture that equals
the last one byte by byte is not new.
"""

from __future__ import annotations

import contextlib
import importlib
import threading
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from roboirg.apps.real.control.clock import Clock, RealClock
from roboirg.apps.real.control.robot import COMMAND_RATE, Command, SensorReading
from roboirg.core.actions import ARM_JOINTS
from roboirg.core.errors import InvalidValueError
from roboirg.core.kinematics import end_effector_pose
from roboirg.evaluation.records.record import Job
from roboirg.policies.contract.option_checking import check_options
from roboirg.policies.contract.policy_urls import parse_query
from roboirg.policies.lerobot_features import FINGER_RANGE, LeRobotFeatures, scaled_square

PREFIX = "lerobot:"
FIRST_OBSERVATION_TIMEOUT_S = 60.0
METHODS = ("connect", "disconnect", "get_observation", "send_action")


class LeRobotArmOptions(LeRobotFeatures):
    """Options of a robot, after ``?`` in its spec.

    Attributes:
        depth: name of the front camera's depth picture, mm; empty for none.
        rate: commands per second.
    """

    depth: str = ""
    rate: float = Field(default=COMMAND_RATE, gt=0)


class LeRobotArm:
    """A robot with LeRobot's interface behind the interface of the control loop.

    Args:
        robot: not connected yet.
        options: names and units.
        arrange: called before a trial; returns when the table is arranged and the arm at home.

    Raises:
        InvalidValueError: the robot lacks a method, an observation or an action.
    """

    name = "lerobot"

    def __init__(
        self,
        robot: Any,  # noqa: ANN401 - LeRobot's class, or one like it
        options: LeRobotArmOptions,
        arrange: Callable[[Job], None],
    ) -> None:
        missing = [name for name in METHODS if not callable(getattr(robot, name, None))]
        if missing:
            raise InvalidValueError(
                f"{type(robot).__name__} is not a LeRobot robot; it has no {', '.join(missing)}."
            )
        self.clock: Clock = RealClock()
        self.rate = options.rate
        self._robot, self._options, self._arrange = robot, options, arrange
        self._check_features()
        self._reader: _ObservationThread | None = None
        self._cameras: tuple[str, ...] = ()
        self._gripper = options.gripper_open
        self._hold: dict[str, float] | None = None
        self._sending = threading.Lock()

    def connect(self) -> None:
        """Connect and start observing."""
        if not getattr(self._robot, "is_connected", False):
            self._robot.connect()
        pictures = (self._options.front, self._options.wrist)
        self._reader = _ObservationThread(self._robot.get_observation, pictures)

    def prepare(self, job: Job, cameras: Sequence[str]) -> None:
        """Have the table arranged, and check that observations arrive."""
        self._cameras = tuple(cameras)
        self._arrange(job)
        self._hold = None
        self._require_reader().newest(FIRST_OBSERVATION_TIMEOUT_S)

    def observe(self) -> SensorReading:
        """Return the newest observation."""
        raw, taken = self._require_reader().newest(0.0)
        options = self._options
        joints = np.array([float(raw[name]) for name in options.joints]) / options.unit
        opening = options.opening(float(raw[options.gripper]))
        fields: dict[str, Any] = {}
        for camera in self._cameras:
            fields[f"{camera}_rgb"] = scaled_square(
                np.asarray(raw[getattr(options, camera)], np.uint8)
            )
        if options.depth and "front" in self._cameras:
            depth = np.asarray(raw[options.depth]).reshape(*np.shape(raw[options.depth])[:2])
            fields["front_depth"] = scaled_square(depth, smooth=False)[..., None].astype(np.int16)
        fields["joint_positions"] = joints.astype(np.float32)
        fields["gripper"] = np.full(2, opening * FINGER_RANGE, np.float32)
        fields["end_effector"] = end_effector_pose(joints)
        names = {"front": options.front, "wrist": options.wrist}
        return SensorReading(fields, {camera: taken[names[camera]] for camera in self._cameras})

    def command(self, command: Command) -> None:
        """Send joint targets and the gripper."""
        options = self._options
        opening = (float(np.clip(command[ARM_JOINTS], -1.0, 1.0)) + 1.0) / 2.0
        with self._sending:
            self._hold = None
            self._gripper = options.gripper_closed + opening * (
                options.gripper_open - options.gripper_closed
            )
            self._robot.send_action(self._action(command[:ARM_JOINTS] * options.unit))

    def stop(self) -> None:
        """Send the joint angles of the first call since the last command as targets."""
        if self._reader is None:
            return
        with self._sending:
            if self._hold is None:
                raw, _ = self._reader.newest(0.0, strict=False)
                self._hold = self._action(
                    np.array([float(raw[name]) for name in self._options.joints])
                )
            self._robot.send_action(self._hold)

    def close(self) -> None:
        if self._reader is not None:
            with contextlib.suppress(Exception):  # the driver may fail; disconnect anyway
                self.stop()
            self._reader.close()
            self._reader = None
        self._robot.disconnect()

    def _action(self, joints: NDArray[np.float64]) -> dict[str, float]:
        action = dict(zip(self._options.joints, map(float, joints), strict=True))
        return {**action, self._options.gripper: self._gripper}

    def _require_reader(self) -> _ObservationThread:
        if self._reader is None:
            raise ConnectionError("the robot is not connected")
        return self._reader

    def _check_features(self) -> None:
        options = self._options
        state = options.vector
        pictures = [name for name in (options.front, options.wrist, options.depth) if name]
        for kind, required in (("observation", (*state, *pictures)), ("action", state)):
            features: Mapping[str, Any] = getattr(self._robot, f"{kind}_features")
            for name in required:
                if name not in features:
                    raise InvalidValueError(
                        f"{type(self._robot).__name__} has no {kind} {name!r}; it has "
                        f"{', '.join(features)}. The robot's spec can set other names."
                    )


class _ObservationThread:
    """A thread that calls `get_observation` repeatedly."""

    def __init__(self, read: Callable[[], dict[str, Any]], pictures: Sequence[str]) -> None:
        self._read, self._pictures = read, pictures
        self._newest: dict[str, Any] | None = None
        self._taken: dict[str, float] = {}
        self._error: str | None = None
        self._arrived, self._closed = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="observations", daemon=True)
        self._thread.start()

    def newest(
        self, timeout_s: float, *, strict: bool = True
    ) -> tuple[dict[str, Any], dict[str, float]]:
        """Return the newest observation and the arrival time of each of its pictures.

        Args:
            timeout_s: for the first observation.
            strict: raise if observing has failed since.

        Raises:
            ConnectionError: there is no observation.
        """
        self._arrived.wait(timeout_s)
        if self._error is not None and strict:
            raise ConnectionError(self._error)
        if self._newest is None:
            raise ConnectionError(self._error or "the robot has not sent an observation yet")
        return self._newest, self._taken

    def close(self) -> None:
        """Stop observing."""
        self._closed.set()
        self._thread.join(FIRST_OBSERVATION_TIMEOUT_S)

    def _run(self) -> None:
        while not self._closed.is_set():
            try:
                raw = self._read()
            except Exception as error:  # noqa: BLE001 - the boundary: drivers raise anything
                self._error = f"{type(error).__name__}: {error}"
                traceback.print_exc()
                self._arrived.set()
                return
            now, last = time.monotonic(), self._newest
            taken = dict(self._taken)
            for name in self._pictures:
                if last is None or not np.array_equal(raw[name], last[name]):
                    taken[name] = now
            self._newest, self._taken = raw, taken
            self._arrived.set()


def make_arm(spec: str, arrange: Callable[[Job], None]) -> LeRobotArm:
    """Return the robot of a spec such as ``lerobot:my_lab.arm:make?degrees=true``.

    Raises:
        InvalidValueError: the spec is malformed, the function cannot be imported, or it returns
            something else.
    """
    address, _, query = spec.removeprefix(PREFIX).partition("?")
    module_name, _, name = address.partition(":")
    options = check_options(LeRobotArmOptions, parse_query(spec, query), f"robot {spec!r}")
    try:
        make = getattr(importlib.import_module(module_name), name)
    except (ValueError, ImportError, AttributeError) as error:
        raise InvalidValueError(
            f"Robot {spec!r}: {error}; write lerobot:package.module:function?option=value."
        ) from error
    return LeRobotArm(make(), options, arrange)
