"""The twin: the robot interface on the simulator, in virtual or real time."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from roboirg.apps.real.control.clock import Clock, VirtualClock
from roboirg.apps.real.control.robot import CAMERA_RATE, COMMAND_RATE, Command, SensorReading
from roboirg.core.actions import ARM_JOINTS
from roboirg.evaluation.play.guarded_loop import NO_RENDER_DEVICE
from roboirg.evaluation.play.job_instruction import PreparedJob
from roboirg.evaluation.play.policy_environment import make_env
from roboirg.evaluation.play.rollout_result import RolloutResult
from roboirg.evaluation.records.record import TWIN, Job
from roboirg.policies.contract.policy_needs import PolicyNeeds

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv

_NEVER = 2**62


class Twin:
    """A simulated robot that judges its trials.

    Its cameras take pictures 30 times a second; a picture is rendered when it is read. While a
    policy computes in virtual time the world stands still, unless the policy reports its latency.

    Args:
        clock: virtual by default: as fast as possible, and exact.
    """

    name = TWIN
    rate = COMMAND_RATE

    def __init__(self, clock: Clock | None = None) -> None:
        self.clock: Clock = VirtualClock() if clock is None else clock
        self.env: RoboIRGEnv | None = None
        self._started_at = 0.0
        self._proprioception: dict[str, Any] = {}
        self._infos: list[dict[str, Any]] = []
        self._hold: Command | None = None
        self._gripper = 1.0
        self.cameras: tuple[str, ...] = ()
        # The watchdog's thread may stop the arm while the loop steps the environment.
        self.lock = threading.RLock()

    def connect(self) -> None:
        """Do nothing."""

    def prepare(self, job: Job, cameras: Sequence[str]) -> None:
        """Build the scene of the trial."""
        self.cameras = tuple(cameras)
        env = make_env(PreparedJob(job), PolicyNeeds(cameras=()))
        if cameras:
            # With a frame hook the environment can render; only pictures that are read are.
            env.set_frame_hook(_draw_nothing, every=_NEVER)
        # A new lock for every trial: an abandoned policy may still hold the last one.
        self.lock = threading.RLock()
        self._proprioception, info = env.reset()
        self._infos = [info]
        self.env, self._hold, self._gripper = env, None, 1.0
        self._started_at = self.clock.now()

    def observe(self) -> SensorReading:
        """Return the joints and fingers now, and pictures that are rendered when they are read."""
        fields = {name: one for name, one in self._proprioception.items() if name != "instruction"}
        taken = {camera: self.taken(camera) for camera in self.cameras}
        return SensorReading(_LazyObservation(fields, self._require_env(), self.cameras), taken)

    def taken(self, camera: str) -> float:  # noqa: ARG002 - the same for both cameras
        """Return the time of a camera's newest picture, s."""
        count = math.floor((self.clock.now() - self._started_at) * CAMERA_RATE + 1e-6)
        return self._started_at + count / CAMERA_RATE

    def command(self, command: Command) -> None:
        """Take one control step."""
        with self.lock:
            self._hold, self._gripper = None, float(command[ARM_JOINTS])
            self._step(command)

    def stop(self) -> None:
        """Take one control step in place."""
        if not self.lock.acquire(blocking=False):
            return  # a policy plans in this scene, which stands still meanwhile
        try:
            if self.env is None or self.is_over():
                return
            if self._hold is None:
                joints = np.asarray(self._proprioception["joint_positions"], dtype=np.float64)
                self._hold = np.append(joints, self._gripper)
            self._step(self._hold)
        finally:
            self.lock.release()

    def close(self) -> None:
        """Drop the scene."""
        self.env = None

    def is_over(self) -> bool:
        """Return whether the judge has a verdict, or time is up."""
        return self._require_env().status != "ongoing"

    def judge(self, result: RolloutResult) -> None:
        """Fill in the events and, if the trial is over, the judge's verdict."""
        first, *later = self._infos
        device = str(self._require_env().render_device)
        result.render_device = None if device == NO_RENDER_DEVICE else device
        result.policy_start_step = int(first["elapsed_steps"])
        for info in (first, *later):
            result.add_events(info)
        last = self._infos[-1]
        result.record_status(last["status"], last.get("cause"), last["steps"])

    def _step(self, command: Command) -> None:
        self._proprioception, *_, info = self._require_env().step(command)
        self._infos.append(info)

    def _require_env(self) -> RoboIRGEnv:
        if self.env is None:
            raise RuntimeError("the twin has not been prepared for a trial")
        return self.env


class _LazyObservation(Mapping[str, Any]):
    """An observation whose pictures are rendered when they are read."""

    def __init__(
        self, proprioception: dict[str, Any], env: RoboIRGEnv, cameras: Sequence[str]
    ) -> None:
        self._proprioception, self._env = proprioception, env
        pictures = [f"{camera}_rgb" for camera in cameras]
        depth = ["front_depth"] if "front" in cameras else []
        self._names = (*pictures, *depth, *proprioception)

    def __getitem__(self, name: str) -> NDArray[Any]:
        if name in self._proprioception:
            found: NDArray[Any] = self._proprioception[name]
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


def _draw_nothing(_env: RoboIRGEnv, _is_demonstration: bool) -> None:
    pass
