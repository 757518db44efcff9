"""The Gymnasium environment of one episode and one instruction."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Unpack

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from roboirg.core.actions import CHOICE, Actions, check_action, check_chunk, find_action_space
from roboirg.core.choices import Choice, check_choices
from roboirg.core.delivery import SpokenInstruction
from roboirg.core.episode import Episode, Stage
from roboirg.core.errors import InvalidValueError, MotionPlanningError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.observations import CAMERAS, Pixels
from roboirg.core.subgoal_text import Point
from roboirg.envs.demonstration_play import replay_or_plan
from roboirg.envs.env_settings import RENDER_MODES, EnvOptions, EnvSettings, choose_index
from roboirg.envs.episode_state import EpisodeState
from roboirg.envs.observation_spaces import make_observation_space
from roboirg.judging import Event, Status, plain_subgoal
from roboirg.language import Instruction
from roboirg.language.arms import say_arm
from roboirg.simulation.controllers import make_controller
from roboirg.simulation.episode_session import EpisodeSession
from roboirg.simulation.observation_builder import ObservationBuilder
from roboirg.simulation.pixel_grounding import PixelGrounding, objects_at
from roboirg.simulation.recording import Recording
from roboirg.simulation.rendering.render_device import describe_device, find_render_device
from roboirg.simulation.video.demonstration_video import make_video
from roboirg.tasks.choices import choices_of
from roboirg.tasks.splits.recordings import is_recorded, recorded_actions

COMPLETED = "All tasks completed"
"""The subgoal after the last stage."""

FrameHook = Callable[["RoboIRGEnv", bool], None]
"""Called with the environment, and with whether the step belongs to the demonstration."""


StepResult = tuple[dict[str, Any], float, bool, bool, dict[str, Any]]
"""Observation, reward, whether it has ended, whether it was cut off, and the info."""


class RoboIRGEnv(gymnasium.Env[dict[str, Any], Actions]):
    """Episodes of one task, with an instruction in one setting.

    Observation: `front_rgb` and `wrist_rgb` uint8 (256, 256, 3) for the requested cameras;
    `joint_positions` float32 (7,) rad; `gripper` float32 (2,) m; `end_effector` float64 (6,)
    position (m) and extrinsic x-y-z angles (rad) of the tool center in the world frame;
    `instruction` the text said last, which is all of it unless `delivery` is ``turns``. With
    `depth`, `front_depth` and `wrist_depth` int16 (256, 256, 1) mm; with `calibration`,
    `front_extrinsic` float32 (3, 4), `front_intrinsic` (3, 3), and the same for the wrist. With
    `observe_every`, `history`: a tuple of such observations.

    Action: in the space named by `actions`. `joint_angle` (8,): absolute joint targets in rad and
    the gripper, +1 open to -1 closed; one control step of 0.05 s. `ee_pose` (7,): position (m) and
    extrinsic x-y-z angles (rad) of the tool center in the world frame, and the gripper; one control
    step. `waypoint` (7,): the same pose, reached by a straight move of many control steps; then
    -1 closes the gripper and +1 opens it in six more steps, and any other value leaves it. The
    episode fails if a pose cannot be reached. `choice` (3,): the number of one of the task's
    `choices`, row and column of a point (-1, -1 without); the scripted expert's motion follows.

    Reward: 1 at the step that completes the task, else 0.

    Episode end: terminated on success or failure, truncated after `max_steps`.

    Info: `status` (ongoing, success, failure, timeout), `is_success`, `cause`, `steps` of the
    policy, `elapsed_steps` since the start of the world, `events` since the last call, utterances
    `heard` since the last call (`text` and `step`), `subgoal` in words, and `grounded_subgoal` with
    `grounded`. At reset also `demonstration`, arrays as in the observation with a leading axis T
    (pictures are drawn when they are read), and `demonstration_subgoals`, T texts, and
    `demonstration_source`: ``recorded`` (RoboMME's actions), ``planned`` by the oracle, or
    ``none``; with actions of the space `choice`, `available_multi_choices`, as in RoboMME. In the
    arm ``other-goal`` also `verdict` and `original`: the status of the stated goal and of the
    scene's own one.

    The arguments are those of `roboirg.make`, which documents them.

    Attributes:
        episode: the episode that is played, or will be.
        instruction: its instruction.
        original: the scene's own episode in the arm ``other-goal``, whose `episode` has another
            goal; else None.
        choices: the task's choices of motions; empty in the other action spaces.
        draws: whether observations hold pictures; `picture` draws one at any time.

    Raises:
        UnknownNameError: a task, setting, split, form, action space or camera does not exist.
        InvalidValueError: the split has no such episode, or the combination is not defined.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - Gymnasium declares it this way
        "render_modes": list(RENDER_MODES),
        "render_fps": 20,
    }
    observation_space: spaces.Dict

    def __init__(self, task: str | Episode, **options: Unpack[EnvOptions]) -> None:
        self._task = task
        self._settings = EnvSettings.of(options)
        self._last_index: int | None = None
        # What the words of `instruction` were made for: they are made once.
        self._instructed: tuple[Episode, InstructionOptions, str] | None = None
        self.episode: Episode
        self.instruction: Instruction
        self.original: Episode | None
        self._select_episode(self._settings, choose_index(self._settings, None, None))

        self._space = find_action_space(self._settings.environment.actions)
        self._spec = self._settings.observation_spec()
        self.actions = self._space.name
        self.cameras = tuple(self._spec.cameras)
        self.depth = self._spec.depth
        self.calibration = self._spec.calibration
        self.demonstration_frames = self._spec.demonstration_frames
        self.observe_every = self._spec.observe_every
        self.history_cameras = tuple(self._spec.for_history.cameras)
        self.grounded = self._settings.grounded
        self.max_steps = self._settings.environment.max_steps
        self.render_mode = self._settings.render_mode
        self.draws = True
        self.observation_space = make_observation_space(self._spec)
        self.action_space = spaces.Box(self._space.low, self._space.high, dtype=np.float64)

        self._state: EpisodeState | None = None
        self._frame_hook: FrameHook | None = None
        self._hook_period = 1

    @property
    def session(self) -> EpisodeSession:
        """The current episode session.

        Raises:
            ResetNeeded: `reset` has not been called.
        """
        return self._current.session

    @property
    def status(self) -> str:
        """Episode status: ongoing, success, failure or timeout.

        In the arm other-goal it is that of the stated goal, once the scene's own goal is decided,
        too.
        """
        session = self.session
        is_late = self._current.steps >= self.max_steps
        # In the arm other-goal the episode goes on after the verdict, until both are decided.
        if not session.is_decided and not is_late:
            return "ongoing"
        if session.status is Status.ONGOING:
            return "timeout"
        return str(session.status)

    @property
    def cause(self) -> str | None:
        """Why the episode ended without success, in words; None if it did not."""
        status = self.status
        if status == "ongoing":
            return None
        if status == "timeout":
            return f"not done after {self.max_steps} steps"
        return self.session.judge.cause

    @property
    def subgoal(self) -> str:
        """The current subgoal in words; with `grounded`, with the pixel of its object."""
        grounding = self._current.pixel_grounding
        if grounding is not None:
            return grounding.text
        return _subgoal_of(self.due_stage)

    @property
    def due_stage(self) -> Stage | None:
        """The stage that is due, by which the subgoal is named; None after the last."""
        return self.session.judge.published

    @property
    def unheard(self) -> int:
        """Number of utterances that the policy has not heard yet.

        Raises:
            ResetNeeded: `reset` has not been called.
        """
        return self._current.spoken.unheard

    @property
    def executed_actions(self) -> int:
        """Number of actions executed since reset; the last perhaps in part.

        Raises:
            ResetNeeded: `reset` has not been called.
        """
        return self._current.executed_actions

    @property
    def events(self) -> Sequence[Event]:
        """All events since reset, including those of the demonstration."""
        return tuple(self.session.events)

    @property
    def attempts(self) -> Sequence[Event]:
        """What the hand tried since reset, as events of facts with the role ``attempt``."""
        return tuple(self.session.attempts)

    @property
    def render_device(self) -> str:
        """Name of the render device, or "none" if nothing is rendered."""
        if not self._renders:
            return "none"
        return describe_device(find_render_device()).name

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start an episode.

        Args:
            seed: chooses the episode if the environment was made with ``episode=None``: number
                ``seed % n`` of the n in the split. Without a seed it is then the one after the
                last played. It has no other effect: scene, words and physics do not depend on it.
            options: for this reset alone: ``split``, ``episode``, ``setting`` and the other
                options of the instruction, as in `roboirg.make`.

        Raises:
            UnknownNameError: there is no such option, or one of its values does not exist.
            InvalidValueError: the split has no such episode, or the combination is not defined.
        """
        super().reset(seed=seed, options=options)
        self._choose_episode(seed, options or {})
        recording = replay_or_plan(
            self.episode,
            self._play_demonstration,
            _shipped_recording(self.episode),
            watched=self._frame_hook is not None,
        )
        self._after_step(self.session.judge.published)
        state = self._current
        video = make_video(self.episode, recording, self._spec, state.video_proprioception)
        observation = self._observe()
        info = self._info()
        info["demonstration"] = video
        info["demonstration_subgoals"] = state.video_subgoals
        info["demonstration_source"] = recording.source
        if self.choices:
            info["available_multi_choices"] = [choice.as_dict() for choice in self.choices]
        return observation, info

    def step(self, action: ArrayLike) -> StepResult:
        """Execute one action: one control step, or many in the waypoint space.

        Raises:
            InvalidActionError: wrong shape, not numeric or not finite; nothing has moved.
            ResetNeeded: the episode is over or has not been reset.
        """
        return self.step_chunk(check_action(action, self._space)[None])

    def step_chunk(self, actions: ArrayLike) -> StepResult:
        """Execute several actions, stopping if the episode ends, and observe once at the end.

        Equivalent to one call of `step` per action, but renders only the last observation.

        Args:
            actions: (n, 8), in the other spaces (n, 7), n >= 1.

        Raises:
            InvalidActionError: wrong shape, not numeric or not finite; nothing has moved.
            ResetNeeded: the episode is over or has not been reset.
        """
        chunk = check_chunk(actions, self._space)
        if self.status != "ongoing":
            raise gymnasium.error.ResetNeeded(f"The episode is over ({self.status}); call reset().")
        if self._space is CHOICE:
            check_choices(chunk, self.choices)
        for action in chunk:
            self._execute(action)
            if self.status != "ongoing":
                break
        status = self.status
        terminated = status in {Status.SUCCESS, Status.FAILURE}
        reward = float(status == Status.SUCCESS)
        return self._observe(), reward, terminated, status == "timeout", self._info()

    def render(self) -> Pixels | None:
        """Return the front and wrist pictures side by side, uint8 (256, 512, 3).

        Returns None without a render mode.
        """
        if self.render_mode is None:
            return None
        return np.hstack([self.picture(camera) for camera in CAMERAS])

    def picture(self, camera: str) -> Pixels:
        """Return the current picture of a camera, uint8 (256, 256, 3).

        Raises:
            UnknownNameError: the camera does not exist.
            InvalidValueError: this environment renders nothing.
        """
        return self.session.world.picture(camera)

    def objects_at(self, point: Point) -> frozenset[str] | None:
        """Return the names of the objects at a point of the front picture; None without pictures.

        Args:
            point: row and column.
        """
        if not self._renders:
            return None
        world = self.session.world
        return objects_at(world.bodies, world.cameras, point)

    def set_frame_hook(self, hook: FrameHook, every: int = 1) -> None:
        """Call ``hook(env, is_demonstration)`` after every n-th control step and at the end.

        Also makes pictures available if observations hold none. Takes effect at the next reset.
        """
        self._frame_hook = hook
        self._hook_period = every

    def end_state(self) -> tuple[NDArray[np.float64], str]:
        """Return the state in numbers, as `EpisodeSession.state_numbers`, and as a hash."""
        return self.session.state_numbers(), self.session.state_hash()

    def close(self) -> None:
        """Release the current episode."""
        self._state = None

    @property
    def _renders(self) -> bool:
        """Whether anything needs pictures."""
        is_asked = bool(self.cameras) or self.grounded or self.render_mode is not None
        return is_asked or self._frame_hook is not None

    @property
    def _current(self) -> EpisodeState:
        """The state since the last reset; raises `ResetNeeded` before the first."""
        if self._state is None:
            raise gymnasium.error.ResetNeeded("Call reset() first.")
        return self._state

    def _choose_episode(self, seed: int | None, options: dict[str, Any]) -> None:
        """Choose the episode and the instruction of a reset; arguments as of `reset`."""
        choosing = {"split", "episode"} & options.keys()
        if isinstance(self._task, Episode) and choosing:
            raise InvalidValueError(
                f"This environment was made for one episode; reset takes no {min(choosing)!r}."
            )
        settings = self._settings.with_reset_options(options)
        self._select_episode(settings, choose_index(settings, seed, self._last_index))
        self._last_index = self.episode.index

    def _select_episode(self, settings: EnvSettings, index: int) -> None:
        """Make an episode the current one, with its words.

        Words are slow to make, so they are kept while episode, options and arm are the same.

        Args:
            settings: of the reset.
            index: number of the episode in its split; ignored where the task is an episode itself.
        """
        wanted = (settings.find_episode(self._task, index), settings.words, settings.arm)
        if self._instructed != wanted:
            said = say_arm(*wanted)
            self.episode = said.episode
            self.instruction = said.instruction
            self.original = said.original
            self._instructed = wanted
        self.delivery = settings.words.delivery
        self.choices: tuple[Choice, ...] = ()
        if settings.environment.actions == CHOICE.name:
            self.choices = choices_of(self.episode)

    def _play_demonstration(self, recording: Recording | None) -> Recording:
        """Start the episode in a new world and play its demonstration; return what was played.

        Args:
            recording: to replay; None plans the demonstration.
        """
        state = self._start_episode()
        self._state = state

        for stage in state.session.demonstrate(recording):
            self._after_step(stage, demonstration=True)
            state.video_proprioception.append(state.observation_builder.read_proprioception())
            state.video_subgoals.append(state.describe_stage(stage))
        return state.session.demonstrated

    def _start_episode(self) -> EpisodeState:
        """Return the state of the episode at its beginning, with a new world."""
        session = EpisodeSession(
            self.episode,
            visible=self._renders,
            rendering=self._spec.rendering,
            original=self.original,
        )
        world = session.world
        return EpisodeState(
            session,
            SpokenInstruction(self.instruction.turns, self.delivery),
            ObservationBuilder(world, self._spec),
            make_controller(self._space, world, self.choices),
            PixelGrounding(world.bodies, world.cameras) if self.grounded else None,
        )

    def _execute(self, action: NDArray[np.float64]) -> None:
        """Execute one validated action in all its control steps, stopping if the episode ends.

        A pose that cannot be reached ends it as a failure.
        """
        self._current.executed_actions += 1
        try:
            for trajectory in self._current.controller.trajectories(action):
                for row in trajectory:
                    self.session.step(row)
                    self._current.steps += 1
                    self._after_step(self.session.judge.published)
                    self._record_history()
                    if self.status != "ongoing":
                        return
        except MotionPlanningError as error:
            # The policy chose a pose that cannot be reached: a failure, not an error.
            self.session.fail(str(error))

    def _after_step(self, stage: Stage | None, *, demonstration: bool = False) -> None:
        """Update the state and call the frame hook after a control step.

        Args:
            stage: the stage whose subgoal is published.
            demonstration: whether the step belongs to the video.
        """
        self._current.after_step(stage)
        if self._frame_hook is None:
            return
        is_due = self.session.world.elapsed % self._hook_period == 0
        if is_due or self.status != "ongoing":
            self._frame_hook(self, demonstration)

    def _record_history(self) -> None:
        """Append an observation to the history, after every `observe_every`-th control step."""
        state = self._current
        if self.observe_every is None or state.steps % self.observe_every:
            return
        entry = state.observation_builder.read_history_entry()
        state.history.append({**entry, "instruction": state.spoken.said_at(state.steps)})

    def _observe(self) -> dict[str, Any]:
        """Return what the policy sees now, and let it hear what has been said.

        The history is handed over and emptied.
        """
        state = self._current
        if self.status == "ongoing":  # afterwards no policy hears anything
            state.spoken.hear(state.steps)
        builder = state.observation_builder
        readings = builder.read() if self.draws else builder.read_proprioception()
        observation = {**readings, "instruction": state.spoken.prompt}
        if self.observe_every is not None:
            observation["history"] = tuple(state.history)
            state.history.clear()
        return observation

    def _info(self) -> dict[str, Any]:
        """Return the info of a reset or step, with the events and utterances since the last info.

        In the arm other-goal it also has how the episode stands for the stated goal (``verdict``)
        and for the scene's own goal (``original``).
        """
        state = self._current
        judge = self.session.judge
        info = {
            "status": self.status,
            "is_success": self.status == Status.SUCCESS,
            "cause": self.cause,
            "steps": state.steps,
            "elapsed_steps": self.session.world.elapsed,
            "events": [event.as_dict() for event in state.take_new_events()],
            "heard": [utterance._asdict() for utterance in state.take_new_utterances()],
            "subgoal": _subgoal_of(judge.published),
        }
        if state.pixel_grounding is not None:
            info["grounded_subgoal"] = state.pixel_grounding.text
        if self.session.original is not None:
            info["verdict"] = str(judge.status)
            info["original"] = str(self.session.original.status)
        return info


def _subgoal_of(stage: Stage | None) -> str:
    """Return the subgoal of a stage that is due in words; None is after the last stage."""
    return COMPLETED if stage is None else plain_subgoal(stage)


def _shipped_recording(episode: Episode) -> Recording | None:
    """Return RoboMME's recording of an episode's demonstration; None if none is shipped."""
    slot = (episode.task, episode.split, episode.index)
    # An episode that is made by hand may have task, split and index of one that was recorded.
    if not episode.recorded or not is_recorded(*slot):
        return None
    recorded = recorded_actions(*slot)
    return Recording(*recorded, end="")
