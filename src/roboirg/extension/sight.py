"""What the front camera shows: labeled scenes, the expert at work, places in the picture."""

from __future__ import annotations

import contextlib
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import sapien
import sapien.physx
from numpy.typing import ArrayLike, NDArray

from roboirg.core.episode import ROBOT_BASE, Episode, SceneObject
from roboirg.core.errors import MotionPlanningError
from roboirg.core.motions import Point
from roboirg.core.observations import FRONT, PICTURE_SIZE, Demonstration, Pixels
from roboirg.envs.environment import RoboIRGEnv
from roboirg.envs.factory import make
from roboirg.policies.builtin.waypoint_expert import Disturbance, WaypointExpert
from roboirg.policies.contract.play import EpisodeLoop
from roboirg.simulation.bodies import Body
from roboirg.simulation.controllers import WaypointController
from roboirg.simulation.episode_session import EpisodeSession
from roboirg.simulation.panda import JointTrajectory, Panda
from roboirg.simulation.physics_settings import HOME_ACTION
from roboirg.simulation.proprioception import Proprioception, ProprioceptiveState, euler_angles
from roboirg.simulation.rendering.viewpoint import FOCAL_LENGTH, front_camera_matrix
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
    # With the first step, objects that appear only later in the episode leave the table.
    session.world.step(HOME_ACTION)
    views = [_view(session.world, episode)]
    if episode.demonstration:
        while session.world.elapsed <= later:
            session.world.step(HOME_ACTION)
        views.append(_view(session.world, episode))
    return tuple(views)


def _view(world: World, episode: Episode) -> LabeledView:
    """Return the front picture of a world, with class, center and position of each visible object.

    Centers are (column, row) in pixels, positions (x, y) in meters. Objects of which fewer than
    `MIN_PIXELS` pixels are visible are left out.
    """
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
    return LabeledView(
        picture=world.picture(FRONT),
        names=tuple(names),
        centers=np.array(centers, np.float32).reshape(-1, 2),
        positions=np.array(positions, np.float32).reshape(-1, 2),
    )


def class_of(item: SceneObject) -> str:
    """Return the class of an object that a picture can show, its kind and color: ``"cube red"``."""
    kind = item.kind.removeprefix("hidden_")
    return f"{kind} {item.color}" if item.color else kind


def pixels_by_object(world: World) -> dict[str, tuple[NDArray[np.intp], ...]]:
    """Return rows and columns of each body's visible pixels in the front picture, by its name."""
    segments = world.cameras.segmentation(FRONT)
    return {name: np.nonzero(segments == body.segment) for name, body in world.bodies.items()}


def shown_to_policy(episode: Episode, every: int) -> tuple[Pixels, Sequence[Pixels]]:
    """Return the first front picture of a policy's turn, and the frames of the video before it.

    Args:
        episode: the episode.
        every: control steps between two frames.

    Returns:
        Pictures (256, 256, 3), RGB; no frames if the episode has no video.
    """
    env = RoboIRGEnv(episode, cameras=(FRONT,), demonstration_frames=every)
    try:
        observation, info = env.reset()
        video = info["demonstration"]
        frames: Sequence[Pixels] = ()
        if video.length:
            frames = video[f"{FRONT}_rgb"]
        return observation[f"{FRONT}_rgb"], frames
    finally:
        env.close()


def points_of(positions: NDArray[np.floating]) -> NDArray[np.float64]:
    """Return where the front picture shows positions, as a pinhole camera; `places_of` reverses it.

    Args:
        positions: x, y and z (..., 3), world frame, m.

    Returns:
        Column and row (..., 2), pixels; they may lie outside of the picture.
    """
    matrix = front_camera_matrix()
    rotation = matrix[:3, :3]
    in_camera = positions @ rotation.T + matrix[:3, 3]
    # Pixels to the right of the picture's center, and down from it.
    offsets = FOCAL_LENGTH * in_camera[..., :2] / in_camera[..., 2:]
    points: NDArray[np.float64] = PICTURE_SIZE / 2 + offsets
    return points


def places_of(points: NDArray[np.floating], heights: NDArray[np.floating]) -> Floats:
    """Return the positions that points of the front picture show, the reverse of `points_of`.

    A point shows a ray from the camera; the position is where that has the given height.

    Args:
        points: column and row (n, 2), pixels.
        heights: of the positions (n,), m.

    Returns:
        x and y (n, 2), m.
    """
    matrix = front_camera_matrix()
    rotation = matrix[:3, :3]
    slopes = (points - PICTURE_SIZE / 2) / FOCAL_LENGTH
    in_camera = np.column_stack([slopes, np.ones(len(points))])
    # The matrix leads from the world to the camera, so its inverse is applied: the rotation's
    # transpose, to the rays and to the camera's own position.
    rays = in_camera @ rotation
    camera = -rotation.T @ matrix[:3, 3]
    lengths = (heights - camera[2]) / rays[:, 2]
    places = camera[:2] + lengths[:, None] * rays[:, :2]
    return np.asarray(places, np.float32)


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
    """Let the expert play an episode in waypoints; return where things were, and its decisions.

    If a disturbance leads to where the arm cannot go on, the episode is recorded undisturbed. Of a
    scene in which not even the video can be planned, only key and status (``"unplanned"``) are
    returned, and arrays are empty.

    Args:
        episode: the episode.
        drawn: numbers of the looks of which a picture is drawn.
        disturbed: whether some waypoints are moved, so that decisions show how to recover.
    """
    disturbances: list[Disturbance | None] = [None]
    if disturbed:
        disturbances.insert(0, Disturbance())
    for disturbance in disturbances:
        env = make(
            episode,
            actions=WaypointExpert.actions,
            cameras=(FRONT,) if drawn else (),
            demonstration_frames="none",
        )
        env.draws = False
        with contextlib.closing(env), contextlib.suppress(MotionPlanningError):
            return _LookRecorder(env, WaypointExpert(SEED, disturbance), drawn).record()
    return ExpertRecording(
        key=episode.key,
        names=(),
        classes=(),
        **_as_arrays({}),
        turns=(),
        pictures={},
        status="unplanned",
    )


_ARRAY_TYPES = {
    "things": np.float32,
    "visible": np.bool_,
    "tool": np.float32,
    "is_video": np.bool_,
    "steps": np.int32,
    "done": np.int32,
    "looks": np.int32,
    "actions": np.float32,
    "anchors": np.int32,
}
"""The types of the numbers in the arrays of an `ExpertRecording`."""


def _as_arrays(noted: Mapping[str, Sequence[Any]]) -> dict[str, Any]:
    """Return the arrays of an `ExpertRecording` by name; those of which nothing is noted are empty.

    Args:
        noted: by the name of the array, its rows.
    """
    return {name: np.array(noted.get(name, ()), dtype) for name, dtype in _ARRAY_TYPES.items()}


class _LookRecorder(EpisodeLoop):
    """Plays one episode and notes looks and decisions; call `record` once.

    A *look* is what the camera sees at one control step, a *decision* a waypoint of the expert.
    """

    def __init__(self, env: RoboIRGEnv, policy: WaypointExpert, drawn: range) -> None:
        """Begin with nothing noted; looks and decisions grow while the episode is played.

        Control steps are counted apart for the video and for the policy's turn. `drawn` has the
        numbers of the looks of which a picture is drawn.
        """
        super().__init__(env, policy)
        self._expert = policy
        self._drawn = drawn
        self._names = tuple(item.name for item in env.episode.scene.objects)
        self._noted: defaultdict[str, list[Any]] = defaultdict(list)
        self._turns: list[str] = []
        self._pictures: dict[int, bytes] = {}
        self._video_steps = 0
        self._steps = 0
        self._has_begun = False

    def record(self) -> ExpertRecording:
        """Play the episode, and return all looks and decisions as arrays."""
        self.env.set_frame_hook(self._after_step)
        info = self.play()
        return ExpertRecording(
            key=self.env.episode.key,
            names=self._names,
            classes=tuple(map(class_of, self.env.episode.scene.objects)),
            **_as_arrays(self._noted),
            turns=tuple(self._turns),
            pictures=self._pictures,
            status=info["status"],
        )

    def _note(self, **values: object) -> None:
        """Add a row to each of some arrays of `ExpertRecording`, by their names."""
        for name, value in values.items():
            self._noted[name].append(value)

    def act(self, observation: dict[str, Any]) -> ArrayLike:
        """Return the expert's action; note its decision, and the look that it belongs to.

        A decision belongs to the newest look; without one at this very step, one is added first.
        """
        action = super().act(observation)
        if not self._has_looked():
            self._look(is_video=False)
        decided = self._expert.last
        anchor = -1 if decided.anchor is None else self._names.index(decided.anchor)
        newest_look = len(self._noted["steps"]) - 1
        self._note(looks=newest_look, actions=decided.action, anchors=anchor)
        self._turns.append(decided.turn)
        return action

    def _has_looked(self) -> bool:
        """Return whether the newest look is of the policy's turn, at this step."""
        if not self._noted["steps"]:
            return False
        return not self._noted["is_video"][-1] and self._noted["steps"][-1] == self._steps

    def _after_step(self, env: RoboIRGEnv, is_demonstration: bool) -> None:
        """Look after every `LOOK_EVERY`-th step; video and policy's turn are counted apart.

        The environment calls this after every control step. In the video, the first step is looked
        at.
        """
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
        """Note where everything is now, and what the camera sees of it: one *look*.

        Of the looks whose number is in `drawn` the picture is drawn too. Then an object counts as
        visible only if enough pixels show it; else what the robot hides counts as visible.
        """
        session = self.env.session
        bodies = [session.world.bodies[name] for name in self._names]
        stages_done = session.judge.index - len(self.env.episode.demonstration)
        number = len(self._noted["steps"])
        visible = visible_of(session.world, bodies)
        if number in self._drawn:
            visible = self._draw(number, visible)
        self._note(
            things=[(*body.position, body.yaw) for body in bodies],
            visible=visible,
            tool=_tool_of(session.world),
            is_video=is_video,
            steps=self._video_steps if is_video else self._steps,
            done=max(0, stages_done),
        )

    def _draw(self, number: int, visible: Sequence[bool]) -> list[bool]:
        """Draw the picture of a look; return which objects enough of its pixels show.

        Args:
            number: of the look.
            visible: for each object, whether it could be seen if the robot hid nothing.
        """
        world = self.env.session.world
        pixels = pixels_by_object(world)
        self._pictures[number] = encode_png(Picture(world.picture(FRONT)))
        shown = []
        for name, can_be_seen in zip(self._names, visible, strict=True):
            rows, _ = pixels[name]
            shown.append(can_be_seen and len(rows) >= MIN_PIXELS)
        return shown


def _tool_of(world: World) -> tuple[float, ...]:
    """Return the tool's x, y, z (m) and angles x-y-z (rad, -pi to pi), and a finger's opening.

    The opening is in meters, 0 to 0.04: seven numbers in all.
    """
    robot = world.robot
    return (*robot.tool_pose.p, *euler_angles(robot.tool_pose), float(robot.finger_positions[0]))


def visible_of(world: World, bodies: Sequence[Body]) -> list[bool]:
    """Return for each body whether the front camera can see it if the robot hides nothing.

    It cannot see what is absent, sites, and cubes below a container that stands on the table. In
    the order of `bodies`.
    """
    absent = world.absent
    lids = []
    for body in bodies:
        stands_on_table = body.item.kind == "container" and body.position.z < ON_TABLE
        if stands_on_table and body.item.name not in absent:
            lids.append(body.position)
    visible = []
    for body in bodies:
        item = body.item
        # A *hidden cube* is one that a container may cover.
        is_hidden = item.kind == "hidden_cube" and _is_covered(body.position, lids)
        is_there = item.name not in absent and item.kind != "site"
        visible.append(is_there and not is_hidden)
    return visible


def _is_covered(cube: Point, lids: Sequence[Point]) -> bool:
    """Return whether a cube is below one of some containers."""
    return any(np.hypot(lid.x - cube.x, lid.y - cube.y) < COVER for lid in lids)
