"""The twin: the robot's interface on the simulator, in virtual or in real time."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from roboirg.core.actions import ARM_JOINTS, JOINT_ANGLE
from roboirg.evaluation.rollout import EnvRequirements, make_env
from roboirg.evaluation.rollout_result import RolloutResult
from roboirg.real.control.clock import Clock, VirtualClock
from roboirg.real.control.robot import CAMERA_RATE, COMMAND_RATE, Command, SensorReading
from roboirg.records.record import Job

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv

NOTHING_DRAWN = "none"
_NEVER = 2**62


class Twin:
    """The simulated robot. It knows how a trial ended.

    Its cameras take pictures 30 times a second; what they show is drawn when it is read. While a
    policy thinks in virtual time the world stands still, unless the policy says how long it took.

    Args:
        clock: virtual by default: as fast as possible, and exact.
    """

    name = "twin"
    rate = COMMAND_RATE

    def __init__(self, clock: Clock | None = None) -> None:
        self.clock: Clock = VirtualClock() if clock is None else clock
        self.env: RoboIRGEnv | None = None
        self._began = 0.0
        self._feeling: dict[str, Any] = {}
        self._infos: list[dict[str, Any]] = []
        self._hold: Command | None = None
        self._gripper = 1.0
        self.cameras: tuple[str, ...] = ()
        # The dead-man's thread may stop the arm while the loop does something else.
        self.lock = threading.RLock()

    def connect(self) -> None:
        """Nothing is to be done."""

    def prepare(self, job: Job, cameras: Sequence[str]) -> None:
        """Build the scene of the trial."""
        self.cameras = tuple(cameras)
        env = make_env(job, EnvRequirements((), JOINT_ANGLE))
        if cameras:
            # Pictures are to be had, but only those that are read are drawn.
            env.set_frame_hook(_look_away, every=_NEVER)
        # Of its own for every trial: a policy that was given up may still have the last one.
        self.lock = threading.RLock()
        self._feeling, info = env.reset()
        self._infos = [info]
        self.env, self._hold, self._gripper = env, None, 1.0
        self._began = self.clock.now()

    def observe(self) -> SensorReading:
        """Joints and fingers now, and pictures that are drawn when they are read."""
        felt = {name: value for name, value in self._feeling.items() if name != "instruction"}
        taken = {camera: self.taken(camera) for camera in self.cameras}
        return SensorReading(_Fields(felt, self._playing(), self.cameras), taken)

    def taken(self, camera: str) -> float:  # noqa: ARG002 - of both cameras alike
        """When a camera's newest picture was taken, s."""
        count = math.floor((self.clock.now() - self._began) * CAMERA_RATE + 1e-6)
        return self._began + count / CAMERA_RATE

    def command(self, command: Command) -> None:
        """One control step."""
        with self.lock:
            self._hold, self._gripper = None, float(command[ARM_JOINTS])
            self._step(command)

    def stop(self) -> None:
        """One control step on the spot."""
        if not self.lock.acquire(blocking=False):
            return  # a policy plans in this scene: it stands still meanwhile
        try:
            if self.env is None or self.is_over():
                return
            if self._hold is None:
                joints = np.asarray(self._feeling["joint_positions"], dtype=np.float64)
                self._hold = np.append(joints, self._gripper)
            self._step(self._hold)
        finally:
            self.lock.release()

    def close(self) -> None:
        """Forget the scene."""
        self.env = None

    def is_over(self) -> bool:
        """Whether the judge has a verdict, or time is up."""
        return self._playing().status != "ongoing"

    def judge(self, course: RolloutResult) -> None:
        """Fill in what happened and, if the trial is over, the judge's verdict."""
        first, *later = self._infos
        device = str(self._playing().render_device)
        course.render_device = None if device == NOTHING_DRAWN else device
        course.turn = int(first["elapsed_steps"])
        for info in (first, *later):
            course.add_events(info)
        last = self._infos[-1]
        course.record_status(last["status"], last.get("cause"), last["steps"])

    def _step(self, command: Command) -> None:
        self._feeling, *_, info = self._playing().step(command)
        self._infos.append(info)

    def _playing(self) -> RoboIRGEnv:
        if self.env is None:
            raise RuntimeError("the twin has not been prepared for a trial")
        return self.env


class _Fields(Mapping[str, Any]):
    """An observation whose pictures are drawn when they are read."""

    def __init__(self, felt: dict[str, Any], env: RoboIRGEnv, cameras: Sequence[str]) -> None:
        self._felt, self._env = felt, env
        pictures = [f"{camera}_rgb" for camera in cameras]
        depth = ["front_depth"] if "front" in cameras else []
        self._names = (*pictures, *depth, *felt)

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name in self._felt:
            found: NDArray[Any] = self._felt[name]
            return found
        if name not in self._names:
            raise KeyError(name)
        camera, _, kind = name.rpartition("_")
        if kind == "depth":
            return self._env.session.world.cameras.depth(camera)
        return self._env.picture(camera)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


def _look_away(_env: RoboIRGEnv, _is_demonstration: bool) -> None:
    pass
