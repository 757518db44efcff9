"""Record one episode as a trajectory: pictures, states, actions and subgoals of every step."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roboirg.apps.demonstrations.picture_coding import (
    PictureCoding,
    VideoEncoder,
    count_values,
    encode_depth,
    encode_png,
)
from roboirg.apps.demonstrations.trajectory import (
    TrajectoryFacts,
    picture_name,
    video_name,
    write_arrays,
)
from roboirg.core.actions import (
    ARM_JOINTS,
    JOINT_ANGLE,
    POSE_SIZE,
    WAYPOINT,
    CheckedActions,
    check_chunk,
    find_action_space,
)
from roboirg.core.episode import ENVIRONMENT_VERSION, Episode
from roboirg.core.errors import InvalidValueError, MotionPlanningError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.observations import CAMERAS, PICTURE_SIZE, FetchedDemonstration, Pixels
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.core.subgoal_text import split_point
from roboirg.envs.factory import make
from roboirg.policies.contract.base import Policy, close_policy
from roboirg.policies.contract.play import EpisodeLoop, Moment
from roboirg.util.atomic_write import replacing
from roboirg.util.media import scaled_square

if TYPE_CHECKING:
    from roboirg.envs.environment import RoboIRGEnv

_ANGLES = slice(3, POSE_SIZE)


class RecordingSpec(NamedTuple):
    """What a trajectory holds.

    Attributes:
        coding: how pictures are stored; with ``none`` nothing is drawn, and no subgoal has a pixel.
        video: whether the pictures of the video are stored.
        depth: whether depth and calibration are stored.
        cameras: whose pictures are stored.
        size: width and height of the pictures, pixels.
        actions: name of the action space; a row is a control step, or a waypoint.
        disturbed: whether the expert is disturbed on its way.
    """

    coding: PictureCoding = "png"
    video: bool = False
    depth: bool = False
    cameras: tuple[str, ...] = CAMERAS
    size: int = PICTURE_SIZE
    actions: str = JOINT_ANGLE.name
    disturbed: bool = False


class _Row(NamedTuple):
    """What one step of the policy gives; see `Trajectory`.

    Attributes:
        observation: after the step.
        action: that was executed.
        label: that is to be learned.
        doing: what the robot was doing, with ``{at}`` for the pixel.
        due: what was due by the task, with its pixel.
    """

    observation: Mapping[str, Any]
    action: CheckedActions
    label: CheckedActions
    doing: str
    due: str


class PictureTracks:
    """Encodes the pictures of the cameras in the order of rows, into a trajectory's open file.

    Call `add` for each row, then `finish` once, which stores videos.

    Attributes:
        histograms: for each camera (3, 256) how often each value of each channel occurs, in all
            rows but the last.
    """

    def __init__(self, archive: zipfile.ZipFile, spec: RecordingSpec) -> None:
        """Begin with row 0; a video has an encoder for each camera, PNGs have none."""
        self._archive = archive
        self._spec = spec
        self._rows = 0
        self._encoders: dict[str, VideoEncoder] = {}
        if spec.coding not in ("png", "none"):
            self._encoders = {
                camera: VideoEncoder(spec.coding, spec.size) for camera in spec.cameras
            }
        self.histograms = {camera: np.zeros((3, 256), np.int64) for camera in spec.cameras}
        self._last_pictures: Mapping[str, Pixels] = {}

    def add(self, pictures: Mapping[str, Any]) -> None:
        """Encode the pictures of one row into the trajectory's file; nothing if none are stored.

        Args:
            pictures: by name, such as ``front_rgb``, and ``front_depth`` if depth is recorded.
        """
        if self._spec.coding == "none":
            return
        # Counted one row late, so that the last row never is: no action follows it, so datasets
        # leave it out.
        for camera, picture in self._last_pictures.items():
            self.histograms[camera] += count_values(picture)
        self._last_pictures = {
            camera: scaled_square(pictures[f"{camera}_rgb"], self._spec.size)
            for camera in self._spec.cameras
        }
        for camera, picture in self._last_pictures.items():
            if camera in self._encoders:
                self._encoders[camera].add(picture)
            else:
                self._archive.writestr(picture_name(camera, self._rows), encode_png(picture))
            if self._spec.depth:
                name = picture_name(f"{camera}_depth", self._rows)
                self._archive.writestr(name, encode_depth(pictures[f"{camera}_depth"]))
        self._rows += 1

    def finish(self) -> None:
        """Store the videos."""
        for camera, encoder in self._encoders.items():
            self._archive.writestr(video_name(camera), encoder.finish())


def record_trajectory(
    episode: Episode,
    policy: Policy,
    path: Path,
    spec: RecordingSpec,
    *,
    options: InstructionOptions | None = None,
    policy_name: str = "oracle",
    variation: int = 0,
    only_successes: bool = True,
) -> TrajectoryFacts:
    """Play an episode and write its trajectory; the file appears whole or not at all.

    Actions are rounded to float32 before they are executed, so that a dataset holds exactly what
    was executed.

    Args:
        episode: the episode.
        policy: moves the robot, in the action space of `spec`.
        path: file to write.
        spec: what it holds.
        options: of the instruction; None for the explicit instruction.
        policy_name: name of the policy.
        variation: number of the variation.
        only_successes: leave out the pictures of an episode that is no success.

    Raises:
        InvalidValueError: the policy has another action space; or the file cannot be written.
    """
    actions = PolicyNeeds.of(policy, "actions").actions
    if actions != spec.actions:
        raise InvalidValueError(
            f"Policy {policy_name!r} acts in {actions!r}; these demonstrations are recorded in "
            f"{spec.actions!r}."
        )
    env = _make_env(episode, spec, options or InstructionOptions(), policy_name)
    try:
        with replacing(path) as part:
            with zipfile.ZipFile(part, "w") as archive:
                recorder = _Recorder(env, policy, spec, archive)
                facts = recorder.record(policy_name, variation)
            if only_successes and facts.status != "success":
                # Begins the file anew with the facts alone.
                with zipfile.ZipFile(part, "w") as archive:
                    write_arrays(archive, facts, {})
    finally:
        env.close()
        close_policy(policy)
    return facts


def _make_env(
    episode: Episode, spec: RecordingSpec, options: InstructionOptions, policy_name: str
) -> RoboIRGEnv:
    """Return the environment in which an episode is recorded, with the cameras that are needed.

    The oracle knows the scene and looks at nothing, so with it pictures are made only for the
    recording; other policies look through all cameras.
    """
    is_drawn = spec.coding != "none"
    is_oracle = policy_name == "oracle"
    cameras: tuple[str, ...] = CAMERAS
    if is_oracle:
        cameras = spec.cameras if is_drawn else ()
    return make(
        episode,
        **asdict(options),
        actions=spec.actions,
        cameras=cameras,
        depth=spec.depth,
        calibration=spec.depth,
        grounded=is_drawn,
        demonstration_frames="none" if is_oracle else "all",
    )


class _GivenUpError(Exception):
    """The policy found no motion; the message says why."""


class _Recorder(EpisodeLoop):
    """Plays one episode with a policy and records it; call `record` once.

    `EpisodeLoop` calls `begin`, then `act` and `execute` in turns.
    """

    def __init__(
        self, env: RoboIRGEnv, policy: Policy, spec: RecordingSpec, archive: zipfile.ZipFile
    ) -> None:
        """Begin with no rows; the pictures go into `archive`, the trajectory's open file."""
        super().__init__(env, policy)
        self._spec = spec
        self._archive = archive
        self._tracks = PictureTracks(archive, spec)
        self._rows: list[_Row] = []
        self._video_session: object = None
        self._acts_in_waypoints = env.actions == WAYPOINT.name

    def record(self, policy_name: str, variation: int) -> TrajectoryFacts:
        """Play the episode, and store its pictures, states and actions; return how it ended.

        Pictures are written while it is played, all else at the end. `policy_name` and `variation`
        are kept among the facts.
        """
        if self._spec.video and self._spec.coding != "none":
            self.env.set_frame_hook(self._see_video)
        observation, info = self.begin()
        try:
            cause = str(self.take_turns(observation, info)["cause"] or "")
        except _GivenUpError as error:
            cause = str(error)
        self._tracks.finish()
        facts = self._facts(policy_name, variation, info, cause)
        write_arrays(self._archive, facts, self._arrays(info))
        return facts

    def _see_video(self, env: RoboIRGEnv, is_demonstration: bool) -> None:
        """Encode the pictures of the demonstration video while the simulator plays it.

        The environment calls this after every step: of the video, and of the policy's turn, in
        which it does nothing, since `_add_row` encodes those pictures.

        Raises:
            InvalidValueError: the video is played again from its beginning, in another session,
                because it did not come to its end.
        """
        if not is_demonstration:
            return
        if self._video_session not in (None, env.session):
            raise InvalidValueError(
                f"The recorded demonstration of {env.episode.key} does not play to its end here."
            )
        self._video_session = env.session
        cameras = env.session.world.cameras
        pictures: dict[str, Any] = {}
        for name, picture in cameras.pictures(self._spec.cameras).items():
            pictures[f"{name}_rgb"] = picture
        if self._spec.depth:
            for name in CAMERAS:
                pictures[f"{name}_depth"] = cameras.depth(name)
        self._tracks.add(pictures)

    def begin(self) -> Moment:
        """Start the episode; store what the policy observes first, as if after a step at home.

        Row 0 of the policy's turn has the home pose as its action, since every row has the action
        that led to it.
        """
        from roboirg.simulation.physics_settings import HOME_ACTION

        observation, info = super().begin()
        home = HOME_ACTION
        if self._acts_in_waypoints:
            home = self._pose_actions(HOME_ACTION[None])[0]
        subgoal = self.env.subgoal
        self._add_row(_Row(observation, home, home, subgoal, subgoal))
        return observation, info

    def act(self, observation: dict[str, Any]) -> ArrayLike:
        """Return the policy's next actions; a policy that finds no motion gives up."""
        try:
            return super().act(observation)
        except MotionPlanningError as error:
            raise _GivenUpError(str(error)) from error

    def execute(self, actions: ArrayLike) -> Moment:
        """Execute the policy's actions one after the other, and store each step.

        A disturbed expert has labels, which are the actions it should have done.

        Args:
            actions: shape (steps, size), in the action space of the recording.

        Returns:
            The last observation and info, with all turns of the instruction that came meanwhile.
        """
        observation: dict[str, Any] = {}
        info: dict[str, Any] = {}
        heard: list[Mapping[str, Any]] = []
        chunk = check_chunk(actions, find_action_space(self.env.actions))
        labels = getattr(self.policy, "labels", chunk) if self._spec.disturbed else chunk
        for exact_action, exact_label in zip(chunk, labels, strict=True):
            action = self._rounded(exact_action)
            label = self._rounded(exact_label)
            observation, info = super().execute(action[None])
            heard += info["heard"]
            due = self.env.subgoal
            self._add_row(_Row(observation, action, label, self._current_subgoal(due), due))
            if info["status"] != "ongoing":
                break
        return observation, {**info, "heard": heard}

    def _current_subgoal(self, due: str) -> str:
        """Return the subgoal that the policy pursues: its own if it has one, else what is due."""
        stage = getattr(self.policy, "stage", None)
        return due if stage is None else str(stage.subgoal)

    def _rounded(self, action: CheckedActions) -> CheckedActions:
        """Return an action in the precision of float32, so that datasets hold what is executed.

        Of a waypoint, whole turns are first added to its angles, to be near those of the last row:
        3.1, then -3.1 rad -> 3.1, then 3.18.
        """
        if self._acts_in_waypoints:
            angles = np.unwrap([self._rows[-1].action[_ANGLES], action[_ANGLES]], axis=0)[1]
            action = np.concatenate([action[:3], angles, action[POSE_SIZE:]])
        return action.astype(np.float32).astype(np.float64)

    def _add_row(self, row: _Row) -> None:
        """Add what one step gave: its pictures to the file at once, the rest to the rows kept."""
        self._tracks.add(row.observation)
        pictures = ("_rgb", "_depth")
        names = [name for name in row.observation if not name.endswith(pictures)]
        kept = {name: row.observation[name] for name in names}
        self._rows.append(row._replace(observation=kept))

    def _facts(
        self, policy_name: str, variation: int, info: Mapping[str, Any], cause: str
    ) -> TrajectoryFacts:
        """Return what identifies the trajectory, and how it ended."""
        episode = self.env.episode
        status = self.env.status
        return TrajectoryFacts(
            task=episode.task,
            split=episode.split,
            episode=episode.index,
            seed=episode.seed,
            difficulty=episode.difficulty,
            variation=variation,
            policy=policy_name,
            status="failure" if status == "ongoing" else status,
            cause=cause,
            video_length=info["demonstration"].length if self._spec.video else 0,
            steps=len(self._rows) - 1,
            demonstration_source=info["demonstration_source"],
            environment_version=ENVIRONMENT_VERSION,
            coding=self._spec.coding,
            depth=self._spec.depth,
            actions=self._spec.actions,
            disturbed=self._spec.disturbed,
        )

    def _arrays(self, info: Mapping[str, Any]) -> dict[str, NDArray[Any]]:
        """Return everything of the trajectory that is stored as arrays, the video's rows first.

        They are states, actions, subgoals, and how often each value of a color channel occurs.
        Their names are the fields of `Trajectory`; `load_trajectory` reads them.
        """
        length = info["demonstration"].length if self._spec.video else 0
        arrays = self._observed_arrays(info["demonstration"], length)
        arrays |= self._action_arrays(info["demonstration"].actions[:length])
        arrays |= self._subgoal_arrays(info["demonstration_subgoals"][:length])
        for camera, counts in self._tracks.histograms.items():
            arrays[f"{camera}_histogram"] = counts
        return arrays

    def _observed_arrays(self, video: FetchedDemonstration, length: int) -> dict[str, NDArray[Any]]:
        """Return the robot's states and, if depth is recorded, the cameras' calibration.

        Args:
            video: what was observed before the policy's turn.
            length: how many rows of it are stored.

        Returns:
            A row for each time step; of the cameras' intrinsics a single one, as they are constant.
        """
        names = ["joint_positions", "gripper", "end_effector"]
        if self._spec.depth:
            names += [f"{camera}_extrinsic" for camera in CAMERAS]
        arrays = {}
        for name in names:
            observed = np.stack([row.observation[name] for row in self._rows])
            arrays[name] = np.concatenate([video[name][:length], observed])
        if self._spec.depth:
            for camera in CAMERAS:
                name = f"{camera}_intrinsic"
                arrays[name] = self._rows[0].observation[name]
        return arrays

    def _action_arrays(self, of_video: CheckedActions) -> dict[str, NDArray[Any]]:
        """Return the actions of all rows: as executed, and as poses of the tool.

        If the expert was disturbed, also the labels: the actions that it should have done, which
        are then also what the poses are of.

        Args:
            of_video: the actions of the video, shape (rows, size), which come first.
        """
        labels = np.array([*of_video, *(row.label for row in self._rows)])
        arrays = {"actions": np.array([*of_video, *(row.action for row in self._rows)])}
        arrays["pose_actions"] = labels if self._acts_in_waypoints else self._pose_actions(labels)
        if self._spec.disturbed:
            arrays["labels"] = labels
        return arrays

    def _subgoal_arrays(self, of_video: Sequence[str]) -> dict[str, NDArray[Any]]:
        """Return the texts of all rows: what the robot was doing, and what was due by the task.

        Both come with the pixel of the thing that is meant, ``grounded_subgoals`` *pick up the cube
        at <120, 80>*, and without, ``subgoals`` *pick up the cube*; what was due is called
        ``online_…``.

        Args:
            of_video: what was due in the rows of the video, which come first.
        """
        due = [row.due for row in self._rows]
        doing = _with_pixels([row.doing for row in self._rows], due)
        arrays = {}
        for name, of_policy in (("online_subgoals", due), ("subgoals", doing)):
            texts = [*of_video, *of_policy]
            plain_texts = [without_pixel(text) for text in texts]
            arrays[f"grounded_{name}"] = np.array(texts, np.str_)
            arrays[name] = np.array(plain_texts, np.str_)
        return arrays

    def _pose_actions(self, actions: CheckedActions) -> CheckedActions:
        """Convert actions from joint angles to poses of the tool.

        Args:
            actions: joint angles (rad) and the gripper, shape (steps, 8).

        Returns:
            Position (m), Euler angles xyz (rad) and the gripper, shape (steps, 7). Angles do not
            jump by 2 π from one step to the next.
        """
        from roboirg.simulation.expert.motion_planning import MotionPlanner

        planner = MotionPlanner(self.env.session.world.robot)
        poses = [planner.forward_kinematics(action[:ARM_JOINTS]) for action in actions]
        angles = np.unwrap([pose.rotation.as_euler("xyz") for pose in poses], axis=0)
        positions = np.stack([pose.position for pose in poses])
        return np.column_stack([positions, angles, actions[:, ARM_JOINTS]])


def without_pixel(subgoal: str) -> str:
    """Return a grounded subgoal without its pixel."""
    return split_point(subgoal)[0]


def _with_pixels(templates: Sequence[str], due_subgoals: Sequence[str]) -> list[str]:
    """Fill pixels into the texts of what the robot was doing: where in the picture a thing is.

    *pick up the cube {at}*, while *pick up the cube at <120, 80>* is due -> the latter. The pixel
    is that of the last row, up to this one, in which the same subgoal was due; without one, there
    is none.

    Args:
        templates: what the robot was doing in each row, with ``{at}`` where the pixel goes.
        due_subgoals: what was due in each row, with its pixel.
    """
    with_pixel = {}  # by the text without it; later rows replace earlier ones
    filled = []
    for template, due in zip(templates, due_subgoals, strict=True):
        with_pixel[without_pixel(due)] = due
        # A subgoal such as ``pick up {at} the cube``.
        simple = without_pixel(template.replace("{at} ", "").replace(" {at}", ""))
        filled.append(with_pixel.get(simple, simple))
    return filled
