"""Record what there is to see and what the expert decides, at looks evenly spaced in time."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from roboirg.apps.learning.labeled_views import MIN_PIXELS, class_of
from roboirg.core.episode import Episode
from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import FRONT, Demonstration
from roboirg.envs.environment import RoboIRGEnv
from roboirg.envs.factory import make
from roboirg.policies.builtin.waypoint_expert import (
    Disturbance,
    ExpertWaypoint,
    WaypointExpert,
)
from roboirg.policies.contract.play import EpisodeLoop
from roboirg.simulation.bodies import Body
from roboirg.simulation.proprioception import euler_angles
from roboirg.util.atomic_write import replacing
from roboirg.util.media import Picture, encode_png

if TYPE_CHECKING:
    from roboirg.simulation.world import World

LOOK_EVERY = 8
"""Control steps between two looks, in the video and in the policy's own time."""
COVER = 0.03
"""Meters in the plane within which a container on the table hides a cube."""
_PICTURE = "picture_"
"""Before the number of a look, in the names of a file."""
ON_TABLE = 0.07
"""Height of a container's origin below which it stands on the table, m."""


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
    things: NDArray[np.float32]
    visible: NDArray[np.bool_]
    tool: NDArray[np.float32]
    is_video: NDArray[np.bool_]
    steps: NDArray[np.int32]
    done: NDArray[np.int32]
    looks: NDArray[np.int32]
    actions: NDArray[np.float32]
    anchors: NDArray[np.int32]
    turns: tuple[str, ...]
    pictures: dict[int, bytes]
    status: str


def record_episode(
    episode: Episode, seed: int, disturbance: Disturbance | None, drawn: range = range(0)
) -> ExpertRecording:
    """Let the disturbed expert play an episode, and return what was to be seen.

    Args:
        episode: the episode.
        seed: of the disturbance.
        disturbance: how waypoints are moved; None for not at all.
        drawn: numbers of the looks of which a picture is drawn.
    """
    env = make(
        episode,
        actions=WaypointExpert.actions,
        cameras=(FRONT,) if drawn else (),
        demonstration_frames="none",
    )
    env.draws = False
    try:
        return _LookRecorder(env, WaypointExpert(seed, disturbance), drawn).record()
    finally:
        env.close()


def unplanned(episode: Episode) -> ExpertRecording:
    """Return the recording of an episode that cannot be played: its key and status alone."""
    nothing: NDArray[Any] = np.zeros(0)
    return ExpertRecording(
        episode.key, (), (), *(nothing,) * 9, turns=(), pictures={}, status="unplanned"
    )


class _LookRecorder(EpisodeLoop):
    """Plays one episode and notes looks and decisions."""

    def __init__(self, env: RoboIRGEnv, policy: WaypointExpert, drawn: range) -> None:
        super().__init__(env, policy)
        self._expert, self._drawn = policy, drawn
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
            np.array([-1 if one.anchor is None else names.index(one.anchor) for one in decided]),
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
            segments = world.cameras.segmentation(FRONT)
            shown = [int((segments == body.segment).sum()) >= MIN_PIXELS for body in bodies]
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


def save_recording(recorded: ExpertRecording, path: Path) -> None:
    """Write a recording, whole or not at all."""
    fields = recorded._asdict()
    pictures = fields.pop("pictures")
    arrays = {name: np.asarray(value) for name, value in fields.items()}
    arrays |= {f"{_PICTURE}{look}": np.frombuffer(png, np.uint8) for look, png in pictures.items()}
    with replacing(path) as part, part.open("wb") as file:
        np.savez(file, allow_pickle=False, **arrays)


def load_recording(path: Path) -> ExpertRecording:
    """Return a recording.

    Raises:
        InvalidValueError: the file is none.
    """
    try:
        with np.load(path, allow_pickle=False) as content:
            found = dict(content)
        pictures = {
            int(name.removeprefix(_PICTURE)): found.pop(name).tobytes()
            for name in list(found)
            if name.startswith(_PICTURE)
        }
        texts = {name: tuple(found[name].tolist()) for name in ("names", "classes", "turns")}
        words = {name: str(found[name]) for name in ("key", "status")}
        return ExpertRecording(**{**found, **texts, **words}, pictures=pictures)
    except (OSError, ValueError, KeyError, TypeError, zipfile.BadZipFile) as error:
        raise InvalidValueError(
            f"The recording {str(path)!r} cannot be read ({error}); delete it to make it again."
        ) from error
