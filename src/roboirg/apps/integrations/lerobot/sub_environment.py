"""The environment as LeRobot wants it; needs Gymnasium, not LeRobot."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import Any, Unpack

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from roboirg.core.actions import Actions
from roboirg.core.environment_options import MAX_STEPS
from roboirg.core.errors import InvalidActionError, InvalidValueError
from roboirg.core.field_types import check_whole
from roboirg.core.observations import CAMERAS, Pixels, proprioception
from roboirg.envs.env_settings import EnvOptions
from roboirg.envs.environment import StepResult
from roboirg.envs.factory import make
from roboirg.policies.contract.play import Moment
from roboirg.util.media import PICTURE_SIZE, scaled_square

NEW_ROLLOUT = "lerobot_new_rollout"
"""Option with which LeRobot, from 0.6.1 on, marks the resets that it means."""
LONGEST_VIDEO = 2000
"""Control steps by which a streamed video may prolong an episode."""
STATE_SIZE = 8

_log = logging.getLogger(__name__)


class LeRobotSubEnvironment(gymnasium.Env[dict[str, Any], Actions]):
    """Episodes of one task, chosen by seeds: ``seed % n`` of the n in the split.

    Observation: `pixels`, uint8 (size, size, 3) for each camera; `agent_pos` float32 (8,), seven
    joints (rad) and the first finger (m). The instruction is `task_description`, which is what was
    said last. Info: `is_success`, and `is_video_demo` while the video is played. Nothing shows
    setting, episode or goal.

    After the end of an episode it repeats the last transition until a reset with a seed or with
    LeRobot's own option, because LeRobot steps on until the last of a batch has ended. An action
    that cannot be executed ends the episode without success.

    Args:
        task: name of the task.
        video: whether the video's frames are the first observations, whatever the actions; else
            they are left out.
        size: width and height of the pictures, pixels.
        **options: the other keyword arguments of `roboirg.make`.

    Raises:
        UnknownNameError: there is no such task or option's value.
        InvalidValueError: a number is out of range, or the combination is not defined.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - Gymnasium declares it this way
        "render_modes": ["rgb_array"],
        "render_fps": 20,
    }
    render_mode = "rgb_array"
    observation_space: spaces.Dict

    def __init__(
        self,
        task: str,
        *,
        video: bool = False,
        size: int = PICTURE_SIZE,
        **options: Unpack[EnvOptions],
    ) -> None:
        if not options.get("cameras", CAMERAS):
            raise InvalidValueError("cameras is empty; LeRobot needs at least one picture.")
        check_whole("size", size, most=PICTURE_SIZE)
        self._video, self._size = video, size
        usual: EnvOptions = {
            "demonstration_frames": "all" if video else "none",
            "episode": None,
        }
        chosen: EnvOptions = {**usual, **options}
        self._env = make(task, **chosen)
        self.observation_space = self._make_space()
        low, high = self._env.action_space.low, self._env.action_space.high  # type: ignore[attr-defined]
        self.action_space = spaces.Box(low.astype(np.float32), high.astype(np.float32))
        longest = LONGEST_VIDEO if video else 0
        self._max_episode_steps = options.get("max_steps", MAX_STEPS) + longest
        self.task_description = ""
        self._shown: Mapping[str, NDArray[Any]] = {}
        self._next_frame = self._length = 0
        self._seen: dict[str, Any] = {}
        self._picture: Pixels | None = None
        self._last: StepResult | None = None

    @property
    def task(self) -> str:
        """What LeRobot gives a policy where it does not know `task_description`: the same."""
        return self.task_description

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Moment:
        """Start an episode; repeat the end of the last one if LeRobot does not mean this reset."""
        chosen = dict(options or {})
        meant = chosen.pop(NEW_ROLLOUT, False) or seed is not None or chosen
        if self._last is not None and not meant:
            return self._last[0], self._last[4]
        self._last = None
        self._seen, info = self._env.reset(seed=seed, options=chosen)
        self.task_description = self._seen["instruction"]
        demonstration = info["demonstration"]
        self._next_frame = self._length = 0
        if self._video and demonstration.length:
            demonstration.draw()
            self._shown, self._length = demonstration, demonstration.length
        return self._observe(self._seen), self._info(success=False)

    def step(self, action: Actions) -> StepResult:
        """Execute one action; while the video is streamed, show its next frame instead."""
        if self._last is not None:
            return self._last
        if self._next_frame < self._length:
            self._next_frame += 1
            return self._observe(self._seen), 0.0, False, False, self._info(success=False)
        try:
            seen, reward, terminated, truncated, info = self._env.step(action)
        except InvalidActionError as error:
            _log.warning("The episode ends without success: %s", error)
            observation = self._observe(self._seen)
            self._last = observation, 0.0, True, False, self._info(success=False)
            return self._last
        self._seen = seen
        self.task_description = seen["instruction"]
        observation, after = self._observe(seen), self._info(success=info["is_success"])
        if terminated or truncated:
            # Repeated, it must not be rewarded again.
            self._last = observation, 0.0, terminated, truncated, after
        return observation, reward, terminated, truncated, after

    def render(self) -> Pixels | None:
        """Return the first camera's picture in the last observation."""
        return self._picture

    def close(self) -> None:
        """Release the episode."""
        self._env.close()

    def _make_space(self) -> spaces.Dict:
        shape = (self._size, self._size, 3)
        picture: spaces.Space[Any] = spaces.Box(0, 255, shape, np.uint8)
        pictures = dict.fromkeys(self._env.cameras, picture)
        state = spaces.Box(-np.inf, np.inf, (STATE_SIZE,), np.float32)
        return spaces.Dict({"pixels": spaces.Dict(pictures), "agent_pos": state})

    def _observe(self, seen: Mapping[str, Any]) -> dict[str, Any]:
        """Return an observation in LeRobot's form: of the video while it is played."""
        if self._next_frame < self._length:
            seen = {key: array[self._next_frame] for key, array in self._shown.items()}
        pixels = {
            camera: scaled_square(seen[f"{camera}_rgb"], self._size) for camera in self._env.cameras
        }
        self._picture = next(iter(pixels.values()))
        state = proprioception(seen["joint_positions"], seen["gripper"])
        return {"pixels": pixels, "agent_pos": state}

    def _info(self, *, success: bool) -> dict[str, Any]:
        return {"is_success": success, "is_video_demo": self._next_frame < self._length}
