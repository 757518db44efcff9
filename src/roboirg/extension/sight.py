"""What the front camera shows: labeled scenes, the expert at work, places in the picture."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import sapien
import sapien.physx
from numpy.typing import ArrayLike, NDArray

from roboirg.core.episode import ROBOT_BASE, Episode, SceneObject
from roboirg.core.errors import MotionPlanningError
from roboirg.core.observations import FRONT, Demonstration, Pixels
from roboirg.envs.environment import RoboIRGEnv
from roboirg.envs.factory import make
from roboirg.policies.builtin.waypoint_expert import Disturbance, ExpertWaypoint, WaypointExpert
from roboirg.policies.contract.play import EpisodeLoop
from roboirg.simulation.bodies import Body
from roboirg.simulation.controllers import WaypointController
from roboirg.simulation.episode_session import EpisodeSession
from roboirg.simulation.panda import JointTrajectory, Panda
from roboirg.simulation.physics_settings import HOME_ACTION
from roboirg.simulation.proprioception import Proprioception, ProprioceptiveState, euler_angles
from roboirg.simulation.rendering.viewpoint import FOCAL_LENGTH, SIZE, front_camera_matrix
from roboirg.simulation.world import World
from roboirg.util.media import Picture, decode_png, encode_png

__all__ = [
    "LOOK_EVERY",
    "ROBOT_BASE",
    "ExpertRecording",
    "LabeledView",
    "ObservedRobot",
    "decode_png",
    "labeled_views",
    "places_of",
    "points_of",
    "record_expert",
    "shown_to_policy",
]

MIN_PIXELS = 12
"""Objects of which fewer pixels are visible are not labeled."""
LOOK_EVERY = 8
"""Control steps between two looks, in the video and in the policy's own time."""
COVER = 0.03
"""Meters in the plane within which a container on the table hides a cube."""
ON_TABLE = 0.07
"""Height of a container's origin below which it stands on the table, m."""
SEED = 1
"""Of the disturbance."""


Floats = NDArray[np.float32]


class LabeledView(NamedTuple):
    """A picture with the centers of its objects.

    Attributes:
        picture: uint8 (256, 256, 3), RGB.
        names: of the objects' classes, such as ``cube red``.
        centers: (n, 2), column and row of the mean of the visible pixels.
        positions: (n, 2), x and y on the table, m.
    """

    picture: Pixels
    names: tuple[str, ...]
    centers: Floats
    positions: Floats


def labeled_views(episode: Episode, later: int) -> tuple[LabeledView, ...]:
    """Return labeled pictures of an episode's start; of one with a video, also a later one.

    Args:
        episode: the episode.
        later: control step of the second picture.
    """
    session = EpisodeSession(episode, visible=True)
    # What comes later leaves the table with the first step, before anything is shown.
    session.world.step(HOME_ACTION)
    views = [_view(session.world, episode)]
    if episode.demonstration:
        while session.world.elapsed <= later:
            session.world.step(HOME_ACTION)
        views.append(_view(session.world, episode))
    return tuple(views)


def _view(world: World, episode: Episode) -> LabeledView:
    names = []
    centers = []
    positions = []
    pixels = pixels_by_object(world)
    for item in episode.scene.objects:
        rows, columns = pixels[item.name]
        if len(rows) >= MIN_PIXELS:
            names.append(class_of(item))
            centers.append((columns.mean(), rows.mean()))
            positions.append(world.bodies[item.name].position[:2])
    points = (np.array(one, np.float32).reshape(-1, 2) for one in (centers, positions))
    return LabeledView(world.picture(FRONT), tuple(names), *points)


def class_of(item: SceneObject) -> str:
    """Return the class of an object that a picture can show: its kind and color."""
    return " ".join(filter(None, (item.kind.removeprefix("hidden_"), item.color)))


def pixels_by_object(world: World) -> dict[str, tuple[NDArray[np.intp], ...]]:
    """Return rows and columns of each body's visible pixels in the front picture, by its name."""
    segments = world.cameras.segmentation(FRONT)
    return {name: np.nonzero(segments == body.segment) for name, body in world.bodies.items()}


def shown_to_policy(episode: Episode, every: int) -> tuple[Pixels, Sequence[Pixels]]:
    """Return the first front picture of a policy's turn, and the frames of the video before it.

    Args:
        episode: the episode.
        every: control steps between two frames.
    """
    env = RoboIRGEnv(episode, cameras=(FRONT,), demonstration_frames=every)
    try:
        observation, info = env.reset()
        video = info["demonstration"]
        frames = video[f"{FRONT}_rgb"] if video.length else ()
        return observation[f"{FRONT}_rgb"], frames
    finally:
        env.close()


def points_of(positions: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return column and row (..., 2) in the front picture of positions (..., 3), m."""
    matrix = front_camera_matrix()
    seen = positions @ matrix[:3, :3].T + matrix[:3, 3]
    flat: NDArray[np.float64] = SIZE / 2 + FOCAL_LENGTH * seen[..., :2] / seen[..., 2:]
    return flat


def places_of(points: NDArray[np.floating], heights: NDArray[np.floating]) -> Floats:
    """Return x and y (n, 2), m, of points (n, 2), column and row, at heights (n,), m."""
    matrix = front_camera_matrix()
    rays = np.column_stack([(points - SIZE / 2) / FOCAL_LENGTH, np.ones(len(points))])
    turned = rays @ matrix[:3, :3]
    eye = -matrix[:3, :3].T @ matrix[:3, 3]
    reach = (heights - eye[2]) / turned[:, 2]
    return np.asarray(eye[:2] + reach[:, None] * turned[:, :2], np.float32)


class ObservedRobot:
    """A robot outside of the world, which stands as another one is observed to stand."""

    def __init__(self) -> None:
        self._scene = sapien.Scene([sapien.physx.PhysxCpuSystem()])
        self._robot = Panda(self._scene, visible=False)
        self._proprioception = Proprioception(self._robot)
        self._controller = WaypointController(self._robot)

    def observe(
        self, joints: NDArray[np.floating[Any]], fingers: NDArray[np.floating[Any]]
    ) -> ProprioceptiveState:
        """Stand at joint positions (7), rad, with fingers (2), m; return proprioception there."""
        self._robot.articulation.set_qpos(np.concatenate([joints, fingers]))
        self._proprioception.update()
        return self._proprioception.read()

    def plan(self, waypoint: NDArray[np.float64]) -> Iterator[JointTrajectory]:
        """Yield joint angles with the gripper (T, 8): of the move, then of the gripper.

        Nothing if the waypoint (7) cannot be reached.
        """
        with contextlib.suppress(MotionPlanningError):
            yield from self._controller.trajectories(waypoint)


class ExpertRecording(NamedTuple):
    """What was to be seen in an episode, and what the expert decided.

    Attributes:
        key: of the episode.
        names: of its n objects.
        classes: of its n objects, as `class_of` names them.
        things: (T, n, 4) x, y, z, m, and the angle about the vertical, rad, at each look.
        visible: (T, n) whether a look shows the object.
        tool: (T, 7) end effector as in observations, and the opening of a finger, m.
        is_video: (T,) whether the look is one of the video.
        steps: (T,) control steps since the video's or the policy's start.
        done: (T,) stages of the goal that are completed.
        looks: (D,) the look at which a decision is made.
        actions: (D, 7) the expert's undisturbed waypoints.
        anchors: (D,) number of the object at whose place a waypoint is; -1 for the tool's.
        turns: (D,) how the tool turns: keep, align, home.
        pictures: PNGs of the front camera by look; empty unless drawn.
        status: how the episode ended.
    """

    key: str
    names: tuple[str, ...]
    classes: tuple[str, ...]
    things: Floats
    visible: NDArray[np.bool_]
    tool: Floats
    is_video: NDArray[np.bool_]
    steps: NDArray[np.int32]
    done: NDArray[np.int32]
    looks: NDArray[np.int32]
    actions: Floats
    anchors: NDArray[np.int32]
    turns: tuple[str, ...]
    pictures: dict[int, bytes]
    status: str


def record_expert(
    episode: Episode, drawn: range = range(0), *, disturbed: bool = True
) -> ExpertRecording:
    """Let the expert play an episode in waypoints, and return what was to be seen.

    If a disturbance leads to where the arm cannot go on, the episode is recorded undisturbed. Of a
    scene in which not even the video can be planned, only key and status are returned.

    Args:
        episode: the episode.
        drawn: numbers of the looks of which a picture is drawn.
        disturbed: whether some waypoints are moved, so that decisions show how to recover.
    """
    for disturbance in (Disturbance(), None) if disturbed else (None,):
        env = make(
            episode,
            actions=WaypointExpert.actions,
            cameras=(FRONT,) if drawn else (),
            demonstration_frames="none",
        )
        env.draws = False
        with contextlib.closing(env), contextlib.suppress(MotionPlanningError):
            return _LookRecorder(env, WaypointExpert(SEED, disturbance), drawn).record()
    nothing: NDArray[Any] = np.zeros(0)
    return ExpertRecording(
        episode.key, (), (), *(nothing,) * 9, turns=(), pictures={}, status="unplanned"
    )


class _LookRecorder(EpisodeLoop):
    """Plays one episode and notes looks and decisions."""

    def __init__(self, env: RoboIRGEnv, policy: WaypointExpert, drawn: range) -> None:
        super().__init__(env, policy)
        self._expert = policy
        self._drawn = drawn
        self._rows: list[tuple[Any, ...]] = []
        self._decisions: list[tuple[int, ExpertWaypoint]] = []
        self._pictures: dict[int, bytes] = {}
        self._video_steps = self._steps = 0
        self._has_begun = False

    def record(self) -> ExpertRecording:
        self.env.set_frame_hook(self._after_step)
        info = self.play()
        objects = self.env.episode.scene.objects
        names = tuple(item.name for item in objects)
        things, visible, tool, is_video, steps, done = zip(*self._rows, strict=True)
        decided = [one for _, one in self._decisions]
        return ExpertRecording(
            self.env.episode.key,
            names,
            tuple(map(class_of, objects)),
            np.array(things, np.float32),
            np.array(visible, bool),
            np.array(tool, np.float32),
            np.array(is_video, bool),
            np.array(steps, np.int32),
            np.array(done, np.int32),
            np.array([look for look, _ in self._decisions], np.int32),
            np.array([one.action for one in decided], np.float32).reshape(-1, 7),
            np.array([names.index(one.anchor) if one.anchor else -1 for one in decided], np.int32),
            tuple(one.turn for one in decided),
            self._pictures,
            info["status"],
        )

    def act(self, observation: dict[str, Any]) -> ArrayLike:
        """Look if that is not done yet, and note the expert's decision."""
        action = super().act(observation)
        if not self._rows or self._rows[-1][3] or self._rows[-1][4] != self._steps:
            self._look(is_video=False)
        if self._expert.last is not None:
            self._decisions.append((len(self._rows) - 1, self._expert.last))
        return action

    def _after_step(self, env: RoboIRGEnv, is_demonstration: bool) -> None:
        del env
        if is_demonstration:
            if self._video_steps % LOOK_EVERY == 0:
                self._look(is_video=True)
            self._video_steps += 1
        elif self._has_begun:
            self._steps += 1
            if self._steps % LOOK_EVERY == 0:
                self._look(is_video=False)

    def start_policy(self, instruction: str, demonstration: Demonstration) -> None:
        """Start the expert; steps count from now on."""
        super().start_policy(instruction, demonstration)
        self._has_begun = True

    def _look(self, *, is_video: bool) -> None:
        world = self.env.session.world
        number = len(self._rows)
        bodies = [world.bodies[item.name] for item in self.env.episode.scene.objects]
        things = [(*body.position, body.yaw) for body in bodies]
        visible = visible_of(world, bodies)
        if number in self._drawn:
            pixels = pixels_by_object(world)
            shown = [len(pixels[body.item.name][0]) >= MIN_PIXELS for body in bodies]
            visible = [one and in_view for one, in_view in zip(visible, shown, strict=True)]
            self._pictures[number] = encode_png(Picture(world.picture(FRONT)))
        steps = self._video_steps if is_video else self._steps
        done = max(0, self.env.session.judge.index - len(self.env.episode.demonstration))
        self._rows.append((things, visible, _tool_of(world), is_video, steps, done))


def _tool_of(world: World) -> tuple[float, ...]:
    """Return the tool's pose and the opening of a finger; angles are from -pi to pi."""
    robot = world.robot
    return (*robot.tool_pose.p, *euler_angles(robot.tool_pose), float(robot.finger_positions[0]))


def visible_of(world: World, bodies: Sequence[Body]) -> list[bool]:
    """Return which objects the front camera can see if the robot hides nothing."""
    absent = world.absent
    lids = [
        body.position
        for body in bodies
        if body.item.kind == "container"
        and body.item.name not in absent
        and body.position.z < ON_TABLE
    ]
    found = []
    for body in bodies:
        x, y, _ = body.position
        is_there = body.item.name not in absent and body.item.kind != "site"
        is_hidden = body.item.kind == "hidden_cube" and any(
            np.hypot(lid.x - x, lid.y - y) < COVER for lid in lids
        )
        found.append(is_there and not is_hidden)
    return found
