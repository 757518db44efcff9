"""A recorded trajectory: one file per episode, from which every format is written.

The file is a ZIP archive without compression: ``facts.json``, an array per name as ``NAME.npy``,
and the pictures as ``CAMERA/000000.png`` or ``CAMERA.mp4``. It appears whole or not at all.
"""

from __future__ import annotations

import contextlib
import io
import json
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from roboirg.apps.demonstrations.picture_coding import PictureCoding
from roboirg.core.actions import JOINT_ANGLE, CheckedActions
from roboirg.core.errors import InvalidValueError
from roboirg.core.observations import Pixels
from roboirg.util.atomic_write import replacing
from roboirg.util.media import decode_png

TRAJECTORY_VERSION = 2
"""Increases with any change of what a file holds."""
SUFFIX = ".zip"

_FACTS = "facts.json"
_ARRAY = ".npy"
_HISTOGRAM = "_histogram"
"""Ends the name of an array with the histogram of a camera, such as ``front_histogram``."""


class TrajectoryFacts(msgspec.Struct, frozen=True):
    """What identifies a trajectory, and how it ended.

    Attributes:
        task: name of the task.
        split: of the episode.
        episode: position in the split.
        seed: of the scene.
        difficulty: of the scene.
        variation: seed of the disturbances.
        policy: who moved the robot.
        status: success, failure or timeout.
        cause: why it is no success; empty for a success.
        video_length: rows of the video before the policy's first observation.
        steps: actions of the policy, control steps or waypoints.
        demonstration_source: who moved the robot in the video: recorded, planned or none.
        environment_version: of scenes, rules and physics.
        coding: how the pictures are stored.
        depth: whether depth and calibration are stored.
        actions: name of the action space.
        disturbed: whether the actions that were executed are not those to learn from.
        version: of the file.
    """

    task: str
    split: str
    episode: int
    seed: int
    difficulty: str
    variation: int
    policy: str
    status: str
    cause: str
    video_length: int
    steps: int
    demonstration_source: str
    environment_version: int
    coding: PictureCoding
    depth: bool
    actions: str = JOINT_ANGLE.name
    disturbed: bool = False
    version: int = TRAJECTORY_VERSION

    @property
    def frames(self) -> int:
        """Number of observations that an action follows: all rows of the trajectory but the last.

        The action of frame r is that of row r + 1.
        """
        return self.video_length + self.steps


@dataclass(frozen=True, eq=False)
class Trajectory:
    """One episode as it was played, without its pictures, which stay in the file.

    Row r is an observation, and ``actions[r]`` is the action that led to it. First come the rows of
    the video, then the policy's first observation (after a step at home), then one for each step of
    the policy.

    Attributes:
        path: of the file.
        facts: what identifies it.
        joint_positions: (rows, 7) float32, rad.
        gripper: (rows, 2) float32 finger positions, m.
        end_effector: (rows, 6) float64: position (m) and unwrapped extrinsic x-y-z angles (rad) of
            the tool in the world frame.
        actions: (rows, 8) float64: joint targets (rad) and the gripper, +1 open to -1 closed, as
            executed; each value is that of a float32. Of waypoints (rows, 7), unwrapped.
        pose_actions: (rows, 7) float64: the tool's pose at the joint targets to learn, as
            `end_effector`, and the gripper.
        subgoals: (rows,) texts: what the robot was doing in the step that led to the row.
        online_subgoals: (rows,) texts: what had to happen next, by the judge.
        grounded_subgoals: as `subgoals`, with the pixel of the object.
        grounded_online_subgoals: as `online_subgoals`, with the pixel of the object.
        histograms: for each camera (3, 256) int64: how often each value of red, green and blue
            occurs in the frames.
        calibration: ``front_extrinsic`` (rows, 3, 4), ``front_intrinsic`` (3, 3) and the same for
            the wrist, float32; empty without depth.
        labels: of a disturbed trajectory, what the undisturbed expert would have done, as
            `actions`; else None.
    """

    path: Path
    facts: TrajectoryFacts
    joint_positions: NDArray[np.float32]
    gripper: NDArray[np.float32]
    end_effector: NDArray[np.float64]
    actions: CheckedActions
    pose_actions: CheckedActions
    subgoals: NDArray[np.str_]
    online_subgoals: NDArray[np.str_]
    grounded_subgoals: NDArray[np.str_]
    grounded_online_subgoals: NDArray[np.str_]
    histograms: Mapping[str, NDArray[np.int64]]
    calibration: Mapping[str, NDArray[np.float32]]
    labels: CheckedActions | None = None

    @property
    def targets(self) -> CheckedActions:
        """The actions to learn from, as `actions`."""
        return self.actions if self.labels is None else self.labels

    @property
    def state(self) -> NDArray[np.float32]:
        """(rows, 8): the joints and the first finger, as policies of LeRobot and openpi get it."""
        return np.column_stack([self.joint_positions, self.gripper[:, 0]])


def load_trajectory(path: Path) -> Trajectory:
    """Read a trajectory from its file: facts, states and actions, but no pictures.

    The file has an array for each field of `Trajectory` that is one, and for each camera's
    histogram; with depth, also for each matrix of the calibration. `write_arrays` is the other
    half.

    Raises:
        InvalidValueError: the file is missing or damaged, or of another version.
    """
    with _opened(path) as archive:
        facts = _read_facts(archive, path)
        names = [name for name in archive.namelist() if name.endswith(_ARRAY)]
        arrays = {name.removesuffix(_ARRAY): _read_array(archive, name) for name in names}
    histograms = {}
    calibration = {}
    for name in list(arrays):
        if name.endswith(_HISTOGRAM):
            histograms[name.removesuffix(_HISTOGRAM)] = arrays.pop(name)
        elif name.endswith(("_extrinsic", "_intrinsic")):
            calibration[name] = arrays.pop(name)
    return Trajectory(path, facts, histograms=histograms, calibration=calibration, **arrays)


def load_facts(path: Path) -> TrajectoryFacts:
    """Read what identifies a trajectory.

    Raises:
        InvalidValueError: the file is missing or damaged, or of another version.
    """
    with _opened(path) as archive:
        return _read_facts(archive, path)


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[zipfile.ZipFile]:
    """Open a trajectory's file, and turn every error of reading it into one.

    Raises:
        InvalidValueError: the file is missing or damaged.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            yield archive
    except (OSError, zipfile.BadZipFile, ValueError, KeyError, msgspec.ValidationError) as error:
        raise InvalidValueError(f"The trajectory {str(path)!r} cannot be read: {error}.") from error


def _read_facts(archive: zipfile.ZipFile, path: Path) -> TrajectoryFacts:
    """Read the facts of an open trajectory's file; `path` is for the message.

    Raises:
        InvalidValueError: the file is of another version of the format.
    """
    fields = json.loads(archive.read(_FACTS))
    if fields.get("version") != TRAJECTORY_VERSION:
        raise InvalidValueError(
            f"{str(path)!r} is a trajectory of version {fields.get('version')}; "
            f"this package reads version {TRAJECTORY_VERSION}. Delete it to record it again."
        )
    return msgspec.convert(fields, TrajectoryFacts)


def _read_array(archive: zipfile.ZipFile, name: str) -> NDArray[Any]:
    """Read one array of an open trajectory's file, given its name there, ``actions.npy``."""
    array: NDArray[Any] = np.load(io.BytesIO(archive.read(name)), allow_pickle=False)
    return array


def write_arrays(
    archive: zipfile.ZipFile, facts: TrajectoryFacts, arrays: Mapping[str, NDArray[Any]]
) -> None:
    """Write arrays and facts into the open file of a trajectory, behind its pictures.

    Args:
        archive: the file.
        facts: what identifies the trajectory, and how it ended.
        arrays: by name, such as ``actions``, with a row for each time step.
    """
    for name, array in arrays.items():
        file = io.BytesIO()
        np.save(file, array, allow_pickle=False)
        archive.writestr(name + _ARRAY, file.getvalue())
    archive.writestr(_FACTS, json.dumps(msgspec.to_builtins(facts)))


def picture_name(track: str, row: int) -> str:
    """Return the name of one PNG of a track: a camera, or ``CAMERA_depth``."""
    return f"{track}/{row:06d}.png"


def video_name(camera: str) -> str:
    """Return the name of a camera's video in a trajectory's file."""
    return f"{camera}.mp4"


def read_picture(archive: zipfile.ZipFile, camera: str, row: int) -> Pixels:
    """Return a row's picture from a trajectory's open file, RGB, (size, size, 3)."""
    return decode_png(archive.read(picture_name(camera, row)))


def read_depth(archive: zipfile.ZipFile, camera: str, row: int) -> NDArray[np.int16]:
    """Return a row's depth from a trajectory's open file, mm, (256, 256, 1)."""
    data = np.frombuffer(archive.read(picture_name(f"{camera}_depth", row)), np.uint8)
    found = cv2.imdecode(data, cv2.IMREAD_UNCHANGED)
    return np.asarray(found).astype(np.int16)[..., None]


def drop_pictures(path: Path) -> None:
    """Remove the pictures from a trajectory's file, to save space; keep its facts and arrays.

    The file is replaced at once, so a reader finds either the old or the new one.
    """
    if not has_pictures(path):
        return
    with (
        zipfile.ZipFile(path) as archive,
        replacing(path) as part,
        zipfile.ZipFile(part, "w") as smaller,
    ):
        for name in archive.namelist():
            if name.endswith((_ARRAY, _FACTS)):
                smaller.writestr(name, archive.read(name))


def has_pictures(path: Path) -> bool:
    """Return whether a trajectory's file holds pictures."""
    with zipfile.ZipFile(path) as archive:
        return any(not name.endswith((_ARRAY, _FACTS)) for name in archive.namelist())
