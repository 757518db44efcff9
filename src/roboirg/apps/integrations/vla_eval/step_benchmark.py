"""The benchmark as vla-eval drives it; observations have the names of its RoboMME benchmark."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from vla_eval.benchmarks.base import StepBenchmark, StepResult, repeat_last_hold
from vla_eval.render import configure_sapien_render
from vla_eval.specs import IMAGE_RGB, LANGUAGE, DimSpec

from roboirg.core.actions import JOINT_ANGLE, find_action_space
from roboirg.core.environment_options import DEFAULT_MESHES, MAX_STEPS
from roboirg.core.instruction_options import DEFAULT_DELIVERY
from roboirg.core.observations import FRONT, WRIST, Demonstration
from roboirg.policies.remote.protocols.vla_eval import TASK, observation_payload
from roboirg.tasks import ALL, find_tasks

if TYPE_CHECKING:
    from roboirg.envs.env_settings import EnvOptions
    from roboirg.envs.environment import RoboIRGEnv

OPEN_GRIPPER = 1.0
ICD_VARIABLE = "ROBOIRG_LAVAPIPE_ICD"
"""Environment variable with the path of lavapipe's Vulkan manifest, for ``render: cpu``."""
_STATE = DimSpec("state", 8, "joint_positions7_finger1")
_ACTION_FORMATS = {
    JOINT_ANGLE.name: "absolute_joint_angle_gripper",
    "ee_pose": "absolute_xyz_euler_gripper",
    "waypoint": "absolute_xyz_euler_gripper_waypoint",
}


class RoboIRGBenchmark(StepBenchmark):  # type: ignore[misc] # vla-eval has no types here
    """Episodes of all tasks in one setting; episode i of the harness is ours of the same number.

    Observation: `images` with `agentview` and `wrist`, uint8 (256, 256, 3); `states` float32 (8,),
    seven joints (rad) and the first finger (m); `task_description`, what was said last. The first
    one of an episode with a video also has `video_history`, `wrist_video_history` and
    `episode_restart`. Names of tasks, settings and episodes stay with the harness: what it sends at
    an episode's start is `TASK`.

    Action: `actions`, (8,), or (7,) in the other action spaces.

    Args:
        tasks: names of tasks; None for the benchmark's.
        setting, form, split, delivery, meshes: as in `roboirg.make`.
        action_space: joint_angle, ee_pose or waypoint.
        max_steps: control steps that a policy has.
        send_wrist_image, send_state, send_video_history: what observations hold; a model server may
            choose those that the configuration leaves out.

    Raises:
        UnknownNameError: there is no such task or action space.
    """

    render_backends = frozenset({"gpu", "cpu"})
    _ALL_RECORD_FIELDS: ClassVar[frozenset[str]] = frozenset({"reward", "terminated", "truncated"})

    def __init__(
        self,
        tasks: Sequence[str] | None = None,
        setting: str = "explicit",
        form: str = "implicit",
        split: str = "test",
        action_space: str = JOINT_ANGLE.name,
        max_steps: int = MAX_STEPS,
        delivery: str = DEFAULT_DELIVERY,
        meshes: str = DEFAULT_MESHES,
        send_wrist_image: bool = True,
        send_state: bool = True,
        send_video_history: bool = True,
    ) -> None:
        """Check tasks and action space, and keep the options; nothing is played or imported yet."""
        super().__init__()
        self.tasks = find_tasks(tasks or [ALL])
        self.setting = setting
        self.split = split
        self.action_space = find_action_space(action_space)
        self.max_steps = max_steps
        self._sends_wrist = send_wrist_image
        self._sends_state = send_state
        self._sends_video = send_video_history
        self._env_options: EnvOptions = {
            "setting": setting,
            "form": form,
            "delivery": delivery,
            "split": split,
            "actions": self.action_space.name,
            "cameras": (FRONT, WRIST) if send_wrist_image else (FRONT,),
            "demonstration_frames": "all" if send_video_history else "none",
            "max_steps": max_steps,
            "meshes": meshes,
        }
        self._env: RoboIRGEnv | None = None
        # The video, until it is shown with the first observation.
        self._video: Demonstration | None = None

    @classmethod
    def configure_render(cls, mode: str) -> dict[str, str]:
        """Choose the GPU's Vulkan driver or lavapipe before the simulator is imported."""
        chosen: dict[str, str] = configure_sapien_render(mode, ICD_VARIABLE)
        return chosen

    def get_tasks(self) -> list[dict[str, Any]]:
        """Return the tasks, for the harness's results; a policy does not get them."""
        return [{"name": task, "suite": f"{self.setting}-{self.split}"} for task in self.tasks]

    def reset(self, task: dict[str, Any]) -> dict[str, Any]:
        """Start an episode.

        Args:
            task: one of `get_tasks`, with the harness's ``episode_idx``. Its contents are replaced
                by `TASK`, because the harness sends them to the policy.
        """
        from roboirg.envs.factory import make

        name = task["name"]
        options: EnvOptions = {**self._env_options, "episode": task["episode_idx"]}
        task.clear()
        task.update(TASK)
        self.cleanup()
        self._env = make(name, **options)
        observation, info = self._env.reset()
        video = info["demonstration"]
        if self._sends_video and video.length:
            video.draw()
            self._video = video
        self._recorder.record_video(observation["front_rgb"])
        return observation

    def step(self, action: Mapping[str, Any]) -> StepResult:
        """Execute one action.

        Raises:
            InvalidActionError: it is missing, of a wrong shape, or not finite.
        """
        rows = action.get("actions", action.get("action"))
        observation, reward, terminated, truncated, info = self._playing.step(rows)
        self._recorder.record_video(observation["front_rgb"])
        self._recorder.record_step(reward=reward, terminated=terminated, truncated=truncated)
        return StepResult(observation, reward, terminated or truncated, info)

    def make_obs(self, raw_obs: Mapping[str, Any], task: Mapping[str, Any]) -> dict[str, Any]:  # noqa: ARG002
        """Return what the policy is shown; the video only with an episode's first observation."""
        video = self._video
        self._video = None
        return observation_payload(
            raw_obs, video, has_wrist=self._sends_wrist, has_state=self._sends_state
        )

    def get_step_result(self, step_result: StepResult) -> dict[str, Any]:
        """Return the verdict and nothing else: the harness sends it to the policy."""
        return {"success": bool(step_result.info.get("is_success", False))}

    def get_metadata(self) -> dict[str, Any]:
        """Return the limits; without them the harness stops after 300 steps."""
        from roboirg.tasks.splits.splits import split_size

        episodes = split_size(self.split)
        return {"max_steps": self.max_steps, "max_episodes_per_task": episodes}

    def get_action_spec(self) -> dict[str, DimSpec]:
        """Return the size and meaning of an action, in vla-eval's terms."""
        space = self.action_space
        return {"action": DimSpec("action", space.size, _ACTION_FORMATS[space.name])}

    def get_observation_spec(self) -> dict[str, DimSpec]:
        """Return which pictures, texts and numbers an observation holds, in vla-eval's terms."""
        fields = {"agentview": IMAGE_RGB, "language": LANGUAGE}
        if self._sends_wrist:
            fields["wrist"] = IMAGE_RGB
        if self._sends_state:
            fields["state"] = _STATE
        return fields

    def get_hold_action(self, last_action: dict[str, Any] | None) -> dict[str, Any]:
        """Return an action that keeps the robot at rest: the last one again.

        At first, one that keeps the joints where they are, with the gripper open.
        """
        if last_action is None and self.action_space.name == JOINT_ANGLE.name:
            joints = self._last_result.obs["joint_positions"]
            at_rest = np.append(joints, OPEN_GRIPPER)
            return {"actions": at_rest.astype(np.float32)}
        held: dict[str, Any] = repeat_last_hold(last_action, self.action_space.size)
        return held

    def cleanup(self) -> None:
        """Close the environment."""
        if self._env is not None:
            self._env.close()
        self._env = None
        self._video = None

    @property
    def _playing(self) -> RoboIRGEnv:
        """The environment of the episode that has begun."""
        if self._env is None:
            raise RuntimeError("No episode has begun; call reset() first.")
        return self._env
