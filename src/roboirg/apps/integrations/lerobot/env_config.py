"""The environment's configuration in LeRobot, from 0.6 on: ``lerobot-eval --env.type=roboirg``."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from gymnasium.vector import VectorEnv
from lerobot.configs import FeatureType, PolicyFeature
from lerobot.envs.configs import EnvConfig
from lerobot.envs.utils import _LazyAsyncVectorEnv

from roboirg.apps.integrations.lerobot.sub_environment import STATE_SIZE, LeRobotSubEnvironment
from roboirg.apps.integrations.lerobot.vector import make_batch, sub_environments
from roboirg.core.actions import find_action_space
from roboirg.core.environment_options import DEFAULT_MESHES, MAX_STEPS
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import (
    DEFAULT_DELIVERY,
    DEFAULT_DISTRACTOR,
    DEFAULT_FRAME,
)
from roboirg.core.observations import CAMERAS, PICTURE_SIZE


@EnvConfig.register_subclass("roboirg")
@dataclass
class RoboIRGEnvConfig(EnvConfig):  # type: ignore[misc] # LeRobot has no types
    """Options of ``--env.type=roboirg``; those not named here are as in `roboirg.make`.

    Attributes:
        task: names of tasks, separated by commas; each becomes a group of results, called
            ``task-setting-split``.
        cameras: likewise of cameras.
        size: width and height of the pictures, pixels.
        video: whether the video's frames are the first observations.
        episode_length: control steps that a policy has.
        features: what a policy may see, by the environment's names.
        features_map: LeRobot's names for them.
    """

    task: str = "PickXtimes"
    setting: str = "explicit"
    form: str = "implicit"
    split: str = "test"
    actions: str = "joint_angle"
    cameras: str = ",".join(CAMERAS)
    size: int = PICTURE_SIZE
    distractor: str = DEFAULT_DISTRACTOR
    frame: str = DEFAULT_FRAME
    delivery: str = DEFAULT_DELIVERY
    meshes: str = DEFAULT_MESHES
    video: bool = False
    fps: int = 20
    episode_length: int = MAX_STEPS
    features: dict[str, PolicyFeature] = field(default_factory=dict)
    features_map: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Declare the features: the action, the robot's state, and a picture for each camera.

        Each has the environment's name, ``pixels/front``, with type and shape, and LeRobot's name
        for it, ``observation.images.front``.
        """
        size = find_action_space(self.actions).size
        self.features |= {
            "action": PolicyFeature(type=FeatureType.ACTION, shape=(size,)),
            "agent_pos": PolicyFeature(type=FeatureType.STATE, shape=(STATE_SIZE,)),
        }
        self.features_map |= {"action": "action", "agent_pos": "observation.state"}
        for camera in _split(self.cameras):
            picture = PolicyFeature(type=FeatureType.VISUAL, shape=(self.size, self.size, 3))
            self.features[f"pixels/{camera}"] = picture
            self.features_map[f"pixels/{camera}"] = f"observation.images.{camera}"

    @property
    def gym_kwargs(self) -> dict[str, Any]:
        """Keyword arguments of `LeRobotSubEnvironment`."""
        return {
            "setting": self.setting,
            "form": self.form,
            "split": self.split,
            "actions": self.actions,
            "distractor": self.distractor,
            "frame": self.frame,
            "delivery": self.delivery,
            "meshes": self.meshes,
            "size": self.size,
            "video": self.video,
            "cameras": _split(self.cameras),
            "max_steps": self.episode_length,
        }

    def create_envs(
        self, n_envs: int, use_async_envs: bool = True
    ) -> dict[str, dict[int, VectorEnv[Any, Any, Any]]]:
        """Return a vector environment for each task.

        Raises:
            UnknownNameError: there is no such task, or an option's value does not exist.
            InvalidValueError: a number is out of range, or the combination is not defined.
        """
        tasks = _split(self.task)
        if not tasks:
            raise InvalidValueError("--env.task names no task.")
        environments = {}
        for task in tasks:
            group = f"{task}-{self.setting}-{self.split}"
            environments[group] = {0: self._create(task, n_envs, use_async_envs)}
        return environments

    def _create(self, task: str, n_envs: int, use_async: bool) -> VectorEnv[Any, Any, Any]:
        """Return the vector environment of a task; its processes start when it is first used.

        With `use_async`, each of several episodes has a process; else all are played in this one.
        """
        options = self.gym_kwargs
        example = LeRobotSubEnvironment(task, **options)  # checks the options; builds no world
        if not use_async or n_envs == 1:
            return make_batch(task, n_envs, False, options)
        lazy: VectorEnv[Any, Any, Any] = _LazyAsyncVectorEnv(
            sub_environments(task, n_envs, options),
            example.observation_space,
            example.action_space,
            example.metadata,
        )
        return lazy


def _split(names: str) -> tuple[str, ...]:
    """Return the names in a list with commas."""
    return tuple(name.strip() for name in names.split(",") if name.strip())
