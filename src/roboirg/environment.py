"""The Gymnasium environment: an episode and an instruction in, observations out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from roboirg.actions import (
    ACTION_HIGH,
    ACTION_LOW,
    ARM_JOINTS,
    JOINT_HIGH,
    JOINT_LOW,
    check_action,
    check_chunk,
)
from roboirg.episode import Episode
from roboirg.errors import InvalidValueError, UnknownNameError
from roboirg.judging import Event, Status, plain_subgoal
from roboirg.language import instruct
from roboirg.observations import CAMERAS, Demonstration, check_cameras
from roboirg.simulation.cameras import SIZE
from roboirg.simulation.device import describe, find_render_device
from roboirg.simulation.proprioception import Proprioception
from roboirg.simulation.session import Session
from roboirg.splits import get_episode

MAX_STEPS = 1300
"""Control steps a policy has, as in RoboMME's published experiments."""
LONGEST_INSTRUCTION = 100_000
PRINTABLE = "".join(chr(code) for code in range(32, 127))

FrameHook = Callable[["RoboIRGEnv", bool], None]


class RoboIRGEnv(gymnasium.Env[dict[str, Any], NDArray[np.floating[Any]]]):
    """One episode of one task, stated in one setting.

    Observation: `front_rgb` and `wrist_rgb` uint8 (256, 256, 3) for the cameras asked for;
    `joint_positions` float32 (7,) rad; `gripper` float32 (2,) m; `end_effector` float64 (6,)
    position (m) and extrinsic x-y-z angles (rad) of the tool centre in the world frame;
    `instruction` text.

    Action: (8,) absolute joint targets in rad and the gripper, +1 open to -1 closed; one control
    step of 0.05 s.

    Reward: 1 at the step that completes the task, else 0.

    Episode end: terminated on success or failure, truncated after `max_steps`.

    Info: `status` (ongoing, success, failure, timeout), `cause`, `steps` of the policy,
    `elapsed_steps` since the world began, `events` since the last call, `subgoal` in words; at
    reset `demonstration`, arrays as in the observation with a leading axis T.

    Args:
        task: name of the task, or an episode made by hand (then `split` and `episode` are its own).
        setting: explicit, direct, reasoning, contextual or spatial.
        form: implicit, or resolved for its paired explicit counterpart.
        split: train, val or test.
        episode: number of the episode in the split, from 0.
        stages: which of the five stages of a contextual instruction are spoken.
        distractor: neutral or competing.
        distractors: how many distractors are spoken.
        frame: whose left and right a spatial instruction uses: robot or camera.
        cameras: which pictures observations hold; () plays without drawing.
        max_steps: control steps that the policy has.
        render_mode: None or "rgb_array" (front and wrist side by side).

    Raises:
        UnknownNameError: a task, setting, split, form or camera does not exist.
        InvalidValueError: the split has no such episode, or the combination is not defined.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - Gymnasium declares it so
        "render_modes": ["rgb_array"],
        "render_fps": 20,
    }
    observation_space: spaces.Dict

    def __init__(
        self,
        task: str | Episode,
        setting: str = "explicit",
        form: str = "implicit",
        split: str = "test",
        episode: int = 0,
        *,
        stages: Sequence[int] = (1, 2, 3, 4, 5),
        distractor: str = "neutral",
        distractors: int = 1,
        frame: str = "robot",
        cameras: Sequence[str] = CAMERAS,
        max_steps: int = MAX_STEPS,
        render_mode: str | None = None,
    ) -> None:
        self.episode = task if isinstance(task, Episode) else get_episode(task, split, episode)
        self.instruction = instruct(
            self.episode,
            setting,
            form,
            stages=stages,
            distractor=distractor,
            distractors=distractors,
            frame=frame,
        )
        self.cameras = check_cameras(cameras)
        if not isinstance(max_steps, int) or max_steps < 1:
            raise InvalidValueError(
                f"max_steps is {max_steps!r}; it has to be a whole number of at least 1."
            )
        if render_mode not in (None, "rgb_array"):
            raise UnknownNameError("render mode", render_mode, ["rgb_array"])
        self.max_steps = max_steps
        self.render_mode = render_mode
        self.observation_space = _observation_space(self.cameras)
        self.action_space = spaces.Box(ACTION_LOW, ACTION_HIGH, dtype=np.float64)
        self._session: Session | None = None
        self._feeling: Proprioception | None = None
        self._frame_hook: FrameHook | None = None
        self._hook_period = 1
        self._steps = 0
        self._reported = 0

    @property
    def session(self) -> Session:
        """The episode being played.

        Raises:
            ResetNeeded: `reset` has not been called yet.
        """
        if self._session is None:
            raise gymnasium.error.ResetNeeded("Call reset() before anything else.")
        return self._session

    @property
    def proprioception(self) -> Proprioception:
        """What the robot feels.

        Raises:
            ResetNeeded: `reset` has not been called yet.
        """
        if self._feeling is None:
            raise gymnasium.error.ResetNeeded("Call reset() before anything else.")
        return self._feeling

    @property
    def status(self) -> str:
        """ongoing, success, failure or timeout."""
        if self.session.status is Status.ONGOING and self._steps >= self.max_steps:
            return "timeout"
        return str(self.session.status)

    @property
    def events(self) -> Sequence[Event]:
        """Everything that happened since reset, the demonstration included."""
        return tuple(self.session.events)

    @property
    def render_device(self) -> str:
        """The device that draws the pictures, or "none" while nothing is drawn."""
        return describe(find_render_device()).name if self._visible else "none"

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begin the episode anew; it is the same each time, whatever the seed."""
        super().reset(seed=seed, options=options)
        self._session = Session(self.episode, visible=self._visible)
        self._feeling = Proprioception(self._session.world.robot)
        self._steps = self._reported = 0
        frames: list[dict[str, Any]] = []

        def record() -> None:
            self.proprioception.follow()
            frames.append(self._sense())
            self._call_hook(demonstration=True)

        self._session.play_demonstration(record)
        self._feeling.follow()
        observation = self._observe()
        self._call_hook(demonstration=False)
        return observation, {**self._info(), "demonstration": self._stack(frames)}

    def step(self, action: ArrayLike) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Execute one action for one control step.

        Raises:
            InvalidActionError: wrong shape, not numeric or not finite; nothing has moved.
            ResetNeeded: the episode is over or has not begun.
        """
        return self.step_chunk(check_action(action)[None])

    def step_chunk(
        self, actions: ArrayLike
    ) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Execute several actions, as far as the episode lasts, and observe once at the end.

        Like so many calls of `step`, without the pictures that nobody would look at.

        Args:
            actions: (n, 8), n >= 1.

        Raises:
            InvalidActionError: wrong shape, not numeric or not finite; nothing has moved.
            ResetNeeded: the episode is over or has not begun.
        """
        chunk = check_chunk(actions)
        if self.status != "ongoing":
            raise gymnasium.error.ResetNeeded(f"The episode is over ({self.status}); call reset().")
        for action in chunk:
            self.session.step(action)
            self.proprioception.follow()
            self._steps += 1
            self._call_hook(demonstration=False)
            if self.status != "ongoing":
                break
        status = self.status
        terminated = status in {Status.SUCCESS, Status.FAILURE}
        reward = float(status == Status.SUCCESS)
        return self._observe(), reward, terminated, status == "timeout", self._info()

    def render(self) -> NDArray[np.uint8] | None:
        """Front and wrist picture side by side, uint8 (256, 512, 3); None without render mode."""
        if self.render_mode is None:
            return None
        return np.hstack([self.picture(camera) for camera in CAMERAS])

    def picture(self, camera: str) -> NDArray[np.uint8]:
        """What a camera sees now, uint8 (256, 256, 3).

        Raises:
            InvalidValueError: there is no such camera, or nothing is drawn in this environment.
        """
        return self.session.world.picture(camera)

    def set_frame_hook(self, hook: FrameHook, every: int = 1) -> None:
        """Call ``hook(env, is_demonstration)`` after every so many control steps.

        It also makes pictures available where observations hold none; takes effect at the
        next reset.
        """
        self._frame_hook, self._hook_period = hook, every

    def close(self) -> None:
        """Forget the episode being played."""
        self._session = self._feeling = None

    @property
    def _visible(self) -> bool:
        drawn = bool(self.cameras) or self.render_mode is not None
        return drawn or self._frame_hook is not None

    def _call_hook(self, *, demonstration: bool) -> None:
        due = self.session.world.elapsed % self._hook_period == 0
        if self._frame_hook is not None and (due or self.status != "ongoing"):
            self._frame_hook(self, demonstration)

    def _sense(self) -> dict[str, Any]:
        """The observation without the instruction."""
        pictures = {f"{camera}_rgb": self.picture(camera) for camera in self.cameras}
        return {**pictures, **self.proprioception.read()}

    def _observe(self) -> dict[str, Any]:
        return {**self._sense(), "instruction": self.instruction.text}

    def _stack(self, frames: Sequence[dict[str, Any]]) -> Demonstration:
        keys = [key for key in self.observation_space if key != "instruction"]
        if not frames:
            return {key: _empty(self.observation_space[key]) for key in keys}
        return {key: np.stack([frame[key] for frame in frames]) for key in keys}

    def _info(self) -> dict[str, Any]:
        session = self.session
        fresh = session.events[self._reported :]
        self._reported = len(session.events)
        stage = session.judge.current
        return {
            "status": self.status,
            "cause": session.judge.cause,
            "steps": self._steps,
            "elapsed_steps": session.world.elapsed,
            "events": [event.as_dict() for event in fresh],
            "subgoal": plain_subgoal(stage) if stage is not None else "all stages completed",
        }


def _observation_space(cameras: Sequence[str]) -> spaces.Dict:
    picture = spaces.Box(0, 255, (SIZE, SIZE, 3), np.uint8)
    # Joints may pass their limits by a little while they are pushed.
    slack = 0.1
    joints = spaces.Box(
        (JOINT_LOW - slack).astype(np.float32), (JOINT_HIGH + slack).astype(np.float32)
    )
    return spaces.Dict(
        {
            **{f"{camera}_rgb": picture for camera in cameras},
            "joint_positions": joints,
            "gripper": spaces.Box(-0.01, 0.05, (2,), np.float32),
            "end_effector": spaces.Box(-np.inf, np.inf, (ARM_JOINTS - 1,), np.float64),
            "instruction": spaces.Text(LONGEST_INSTRUCTION, charset=PRINTABLE),
        }
    )


def _empty(space: spaces.Space[Any]) -> NDArray[Any]:
    return np.zeros((0, *(space.shape or ())), dtype=space.dtype)
