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
from roboirg.core.observations import CAMERAS, PICTURE_SIZE, Pixels, proprioception
from roboirg.envs.env_settings import EnvOptions
from roboirg.envs.environment import StepResult
from roboirg.envs.factory import make
from roboirg.policies.contract.play import Moment
from roboirg.util.media import scaled_square

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
        """Check the options, and make the environment; no world is built before the first reset.

        With `video`, LeRobot's limit of steps is raised by `LONGEST_VIDEO`, as it counts the
        frames, too.
        """
        if not options.get("cameras", CAMERAS):
            raise InvalidValueError("cameras is empty; LeRobot needs at least one picture.")
        check_whole("size", size, most=PICTURE_SIZE)
        self._has_video = video
        self._size = size
        options.setdefault("demonstration_frames", "all" if video else "none")
        options.setdefault("episode", None)
        self._env = make(task, **options)
        self.observation_space = self._make_space()
        box: Any = self._env.action_space
        self.action_space = spaces.Box(box.low.astype(np.float32), box.high.astype(np.float32))
        self._max_episode_steps = options.get("max_steps", MAX_STEPS)
        if video:
            self._max_episode_steps += LONGEST_VIDEO
        self.task_description = ""
        # The video, the number of its frames, and of those that have been shown.
        self._video: Mapping[str, NDArray[Any]] = {}
        self._length = 0
        self._next_frame = 0
        # Our last observation, its first picture, and the end of the episode once it is over.
        self._seen: dict[str, Any] = {}
        self._picture: Pixels | None = None
        self._end: StepResult | None = None

    @property
    def task(self) -> str:
        """What LeRobot gives a policy where it does not know `task_description`: the same."""
        return self.task_description

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Moment:
        """Start an episode; repeat the end of the last one if LeRobot does not mean this reset.

        A vector environment resets what has ended, while LeRobot steps on until the last of a batch
        has ended. A reset is meant if it comes with a seed or an option, or if no episode has
        ended.
        """
        chosen = dict(options or {})
        is_new_rollout = chosen.pop(NEW_ROLLOUT, False)
        is_meant = is_new_rollout or seed is not None or bool(chosen)
        if self._end is not None and not is_meant:
            observation, _, _, _, info = self._end
            return observation, info
        self._end = None
        self._seen, info = self._env.reset(seed=seed, options=chosen)
        self.task_description = self._seen["instruction"]
        demonstration = info["demonstration"]
        self._next_frame = 0
        self._length = 0
        if self._has_video and demonstration.length:
            demonstration.draw()
            self._video = demonstration
            self._length = demonstration.length
        return self._observe(), self._info(success=False)

    def step(self, action: Actions) -> StepResult:
        """Execute one action; while the video is streamed, ignore it and show the next frame.

        After the end, the last transition is repeated, with reward 0.
        """
        if self._end is not None:
            return self._end
        if self._is_video_on:
            self._next_frame += 1
            return self._observe(), 0.0, False, False, self._info(success=False)
        try:
            self._seen, reward, terminated, truncated, info = self._env.step(action)
        except InvalidActionError as error:
            _log.warning("The episode ends without success: %s", error)
            self._end = self._observe(), 0.0, True, False, self._info(success=False)
            return self._end
        self.task_description = self._seen["instruction"]
        observation = self._observe()
        shown_info = self._info(success=info["is_success"])
        if terminated or truncated:
            # Repeated, it must not be rewarded again.
            self._end = observation, 0.0, terminated, truncated, shown_info
        return observation, reward, terminated, truncated, shown_info

    def render(self) -> Pixels | None:
        """Return the first camera's picture in the last observation."""
        return self._picture

    def close(self) -> None:
        """Release the episode."""
        self._env.close()

    def _make_space(self) -> spaces.Dict:
        """Return the space of observations: pictures of each camera, and the robot's state."""
        shape = (self._size, self._size, 3)
        picture: spaces.Space[Any] = spaces.Box(0, 255, shape, np.uint8)
        pictures = dict.fromkeys(self._env.cameras, picture)
        state = spaces.Box(-np.inf, np.inf, (STATE_SIZE,), np.float32)
        return spaces.Dict({"pixels": spaces.Dict(pictures), "agent_pos": state})

    @property
    def _is_video_on(self) -> bool:
        """Whether frames of the video are left to show."""
        return self._next_frame < self._length

    def _observe(self) -> dict[str, Any]:
        """Return what is seen in LeRobot's form: a frame of the video while it is played.

        Keeps the first camera's picture for `render`.
        """
        seen = self._seen
        if self._is_video_on:
            seen = {field: array[self._next_frame] for field, array in self._video.items()}
        pixels = {}
        for camera in self._env.cameras:
            pixels[camera] = scaled_square(seen[f"{camera}_rgb"], self._size)
        first_camera = self._env.cameras[0]
        self._picture = pixels[first_camera]
        return {"pixels": pixels, "agent_pos": proprioception(seen)}

    def _info(self, *, success: bool) -> dict[str, Any]:
        """Return the info of a step, which shows nothing of setting, episode or goal."""
        return {"is_success": success, "is_video_demo": self._is_video_on}
