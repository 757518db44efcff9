"""The Gymnasium environment: an episode and an instruction in, observations out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from roboirg.core.actions import JOINT_ANGLE, check_action, check_chunk, find_action_space
from roboirg.core.episode import Episode, Stage
from roboirg.core.errors import InvalidValueError, MotionPlanningError, UnknownNameError
from roboirg.core.observations import CAMERAS, DemonstrationFrames
from roboirg.episodes.splits import get_episode
from roboirg.judging import Event, Status, plain_subgoal
from roboirg.language import instruct
from roboirg.simulation.controllers import make_controller
from roboirg.simulation.demonstration.demonstration_cache import replay_or_plan
from roboirg.simulation.demonstration.demonstration_video import make_video
from roboirg.simulation.demonstration.recording import Recording
from roboirg.simulation.episode_session import EpisodeSession
from roboirg.simulation.episode_state import EpisodeState
from roboirg.simulation.observation_builder import (
    ObservationBuilder,
    ObservationSpec,
    history_space,
    observation_space,
)
from roboirg.simulation.rendering.pixel_grounding import PixelGrounding
from roboirg.simulation.rendering.render_device import describe, find_render_device
from roboirg.simulation.rendering.render_mode import find_rendering

MAX_STEPS = 1300
"""Control steps a policy has, as in RoboMME's published experiments."""
LONGEST_INSTRUCTION = 100_000
PRINTABLE = "".join(chr(code) for code in range(32, 127))
COMPLETED = "all tasks completed"
"""The subgoal after the last stage."""

FrameHook = Callable[["RoboIRGEnv", bool], None]


class RoboIRGEnv(gymnasium.Env[dict[str, Any], NDArray[np.floating[Any]]]):
    """One episode of one task, stated in one setting.

    Observation: `front_rgb` and `wrist_rgb` uint8 (256, 256, 3) for the cameras asked for;
    `joint_positions` float32 (7,) rad; `gripper` float32 (2,) m; `end_effector` float64 (6,)
    position (m) and extrinsic x-y-z angles (rad) of the tool center in the world frame;
    `instruction` text. With `depth`, `front_depth` and `wrist_depth` int16 (256, 256, 1) mm; with
    `calibration`, `front_extrinsic` float32 (3, 4), `front_intrinsic` (3, 3), and of the wrist.
    With `observe_every`, `history`: a tuple of such observations.

    Action: of the space that `actions` names. `joint_angle` (8,): absolute joint targets in rad
    and the gripper, +1 open to -1 closed; one control step of 0.05 s. `ee_pose` (7,): position (m)
    and extrinsic x-y-z angles (rad) of the tool center in the world frame and the gripper; one
    control step. `waypoint` (7,): the same pose, reached in a straight move of many control steps;
    there -1 closes the gripper and +1 opens it in six more, anything else leaves it. The episode
    fails at a pose that cannot be reached.

    Reward: 1 at the step that completes the task, else 0.

    Episode end: terminated on success or failure, truncated after `max_steps`.

    Info: `status` (ongoing, success, failure, timeout), `cause`, `steps` of the policy,
    `elapsed_steps` since the world began, `events` since the last call, `subgoal` in words, with
    `grounded` also `grounded_subgoal`; at reset `demonstration`, arrays as in the observation with
    a leading axis T (pictures are drawn when they are read), and `demonstration_subgoals`, T texts.

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
        actions: joint_angle, ee_pose or waypoint.
        cameras: which pictures observations hold; () plays without drawing.
        depth: whether observations hold depth for the same cameras.
        calibration: whether observations hold the matrices of the same cameras.
        grounded: whether info names the pixels of the subgoal's object; costs drawing.
        demonstration_frames: which pictures the video has: "all", "none", or n for every n-th.
        observe_every: n adds `history`, the observations after every n-th control step since the
            last observation, to each.
        history_cameras: whose pictures those have; the same as observations by default.
        meshes: "faithful", or "light" for quicker pictures that differ a little from RoboMME's.
        max_steps: control steps that the policy has.
        render_mode: None or "rgb_array" (front and wrist side by side).

    Raises:
        UnknownNameError: a task, setting, split, form, action space or camera does not exist.
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
        actions: str = JOINT_ANGLE.name,
        cameras: Sequence[str] = CAMERAS,
        depth: bool = False,
        calibration: bool = False,
        grounded: bool = False,
        demonstration_frames: DemonstrationFrames = "all",
        observe_every: int | None = None,
        history_cameras: Sequence[str] | None = None,
        meshes: str = "faithful",
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
        self._space = find_action_space(actions)
        self.actions = self._space.name
        self._wishes = ObservationSpec(
            cameras,
            depth,
            calibration,
            demonstration_frames,
            observe_every,
            history_cameras,
            find_rendering(meshes),
        ).checked()
        self.cameras = tuple(self._wishes.cameras)
        self.demonstration_frames, self.observe_every = demonstration_frames, observe_every
        self.history_cameras = tuple(self._wishes.of_history.cameras)
        if not isinstance(max_steps, int) or max_steps < 1:
            raise InvalidValueError(
                f"max_steps is {max_steps!r}; it has to be a whole number of at least 1."
            )
        if render_mode not in (None, "rgb_array"):
            raise UnknownNameError("render mode", render_mode, ["rgb_array"])
        self.max_steps = max_steps
        self.render_mode = render_mode
        self.observation_space = self._make_observation_space()
        self.action_space = spaces.Box(self._space.low, self._space.high, dtype=np.float64)
        self.grounded = grounded
        self._play: EpisodeState | None = None
        self._frame_hook: FrameHook | None = None
        self._hook_period = 1

    @property
    def session(self) -> EpisodeSession:
        """The episode being played.

        Raises:
            ResetNeeded: `reset` has not been called yet.
        """
        return self._playing.session

    @property
    def status(self) -> str:
        """ongoing, success, failure or timeout."""
        status = self.session.status
        if status is Status.ONGOING and self._playing.steps >= self.max_steps:
            return "timeout"
        return str(status)

    @property
    def subgoal(self) -> str:
        """What is to be done now, in words; with `grounded`, with the pixels of what is meant."""
        play, stage = self._playing, self.session.judge.published
        if play.grounding is not None:
            return play.grounding.text
        return COMPLETED if stage is None else plain_subgoal(stage)

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
        recording = replay_or_plan(self.episode, self._show, watched=self._frame_hook is not None)
        self._follow(self.session.judge.published)
        play = self._playing
        shown = {
            "demonstration": make_video(self.episode, recording, self._wishes, play.felt),
            "demonstration_subgoals": play.labels,
        }
        return self._observe(), {**self._info(), **shown}

    def step(self, action: ArrayLike) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Execute one action: one control step, or many in the waypoint space.

        Raises:
            InvalidActionError: wrong shape, not numeric or not finite; nothing has moved.
            ResetNeeded: the episode is over or has not begun.
        """
        return self.step_chunk(check_action(action, self._space)[None])

    def step_chunk(
        self, actions: ArrayLike
    ) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Execute several actions, as far as the episode lasts, and observe once at the end.

        Like so many calls of `step`, without the pictures that nobody would look at.

        Args:
            actions: (n, 8), in the other spaces (n, 7), n >= 1.

        Raises:
            InvalidActionError: wrong shape, not numeric or not finite; nothing has moved.
            ResetNeeded: the episode is over or has not begun.
        """
        chunk = check_chunk(actions, self._space)
        if self.status != "ongoing":
            raise gymnasium.error.ResetNeeded(f"The episode is over ({self.status}); call reset().")
        for action in chunk:
            self._execute(action)
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
        self._play = None

    @property
    def _visible(self) -> bool:
        drawn = bool(self.cameras) or self.grounded or self.render_mode is not None
        return drawn or self._frame_hook is not None

    @property
    def _playing(self) -> EpisodeState:
        if self._play is None:
            raise gymnasium.error.ResetNeeded("Call reset() before anything else.")
        return self._play

    def _make_observation_space(self) -> spaces.Dict:
        said = {"instruction": spaces.Text(LONGEST_INSTRUCTION, charset=PRINTABLE)}
        fields = {**observation_space(self._wishes), **said}
        if self.observe_every is not None:
            recalled = spaces.Dict({**history_space(self._wishes), **said})
            fields["history"] = spaces.Sequence(recalled)
        return spaces.Dict(fields)

    def _show(self, recording: Recording | None) -> Recording:
        """Begin the episode and play its demonstration."""
        play = self._play = self._begin()

        def follow(stage: Stage) -> None:
            self._follow(stage, demonstration=True)
            play.felt.append(play.senses.feel())
            play.labels.append(play.label(stage))

        return play.session.play_demonstration(follow, recording)

    def _begin(self) -> EpisodeState:
        session = EpisodeSession(
            self.episode, visible=self._visible, rendering=self._wishes.rendering
        )
        world = session.world
        return EpisodeState(
            session,
            ObservationBuilder(world, self._wishes),
            make_controller(self._space, world.robot),
            PixelGrounding(world.bodies, world.cameras) if self.grounded else None,
        )

    def _execute(self, action: NDArray[np.float64]) -> None:
        """One checked action, as far as the episode lasts."""
        try:
            for piece in self._playing.controller.pieces(action):
                for row in piece:
                    self.session.step(row)
                    self._playing.steps += 1
                    self._follow(self.session.judge.published)
                    self._remember()
                    if self.status != "ongoing":
                        return
        except MotionPlanningError as error:
            # An outcome, not a fault: it is the policy's choice where to go.
            self.session.judge.fail(str(error))

    def _follow(self, stage: Stage | None, *, demonstration: bool = False) -> None:
        """What has to be done after each control step.

        Args:
            stage: whose label is current.
            demonstration: whether it belongs to the video.
        """
        self._playing.follow(stage)
        self._call_hook(demonstration=demonstration)

    def _call_hook(self, *, demonstration: bool) -> None:
        due = self.session.world.elapsed % self._hook_period == 0
        if self._frame_hook is not None and (due or self.status != "ongoing"):
            self._frame_hook(self, demonstration)

    def _remember(self) -> None:
        """Keep an observation from within a chunk, if one is wanted now."""
        if self.observe_every is not None and self._playing.steps % self.observe_every == 0:
            recalled = self._playing.senses.recall()
            self._playing.history.append({**recalled, "instruction": self.instruction.text})

    def _observe(self) -> dict[str, Any]:
        observation = {**self._playing.senses.read(), "instruction": self.instruction.text}
        if self.observe_every is not None:
            observation["history"] = tuple(self._playing.history)
            self._playing.history.clear()
        return observation

    def _info(self) -> dict[str, Any]:
        play, judge = self._playing, self.session.judge
        info = {
            "status": self.status,
            "cause": judge.cause,
            "steps": play.steps,
            "elapsed_steps": self.session.world.elapsed,
            "events": [event.as_dict() for event in play.fresh_events()],
            "subgoal": COMPLETED if judge.published is None else plain_subgoal(judge.published),
        }
        if play.grounding is not None:
            info["grounded_subgoal"] = play.grounding.text
        return info
