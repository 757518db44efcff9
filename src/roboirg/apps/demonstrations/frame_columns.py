"""The columns of a dataset's frames, for both versions of LeRobot's format."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.apps.demonstrations.export_plan import ExportedInstruction, ExportPlan
from roboirg.apps.demonstrations.feature_stats import FeatureStats, picture_stats, vector_stats
from roboirg.apps.demonstrations.picture_coding import STORED_FORMATS
from roboirg.apps.demonstrations.trajectory import Trajectory, picture_name
from roboirg.util.media import CONTROL_RATE

JOINTS = [f"joint_{number}" for number in range(1, 8)]
_POSE = ["x", "y", "z", "roll", "pitch", "yaw", "gripper"]
_KEYS = {
    "front": "observation.images.front",
    "wrist": "observation.images.wrist",
    "state": "observation.state",
    "action": "action",
}
_OPENPI_KEYS = {"front": "image", "wrist": "wrist_image", "state": "state", "action": "actions"}
_SINGLE = (
    ("next.reward", "float32", "reward"),
    ("next.done", "bool", "done"),
    ("next.success", "bool", "success"),
    ("is_video_demo", "bool", "is_video_demo"),
    ("subgoal", "string", "subgoal"),
    ("grounded_subgoal", "string", "grounded_subgoal"),
    ("timestamp", "float32", "s"),
    ("frame_index", "int64", "frame_index"),
    ("episode_index", "int64", "episode_index"),
    ("index", "int64", "index"),
    ("task_index", "int64", "task_index"),
)
"""The columns with one value in each frame: its type, and what it is called."""

LANGUAGE_COLUMNS = ("language_persistent", "language_events")
"""What LeRobot calls the columns of what is said during an episode, and of what in one frame."""
EXECUTED = "executed_action"
"""Column of what was executed where that is not the action to learn."""


class PlacedInstruction(NamedTuple):
    """An instruction at its place in a dataset.

    Attributes:
        instruction: the instruction.
        episode_index: of its episode in the dataset.
        first_index: index of its first frame among all frames.
        task_index: of its text among all texts.
    """

    instruction: ExportedInstruction
    episode_index: int
    first_index: int
    task_index: int


@dataclass(frozen=True)
class FrameColumns:
    """Names and contents of the columns of one dataset.

    Args:
        plan: what is exported.
    """

    plan: ExportPlan

    @property
    def keys(self) -> Mapping[str, str]:
        """Names of the columns of ``front``, ``wrist``, ``state`` and ``action``."""
        return _OPENPI_KEYS if self.plan.is_for_openpi else _KEYS

    @property
    def has_videos(self) -> bool:
        """Whether pictures are in videos, not in the table."""
        return self.plan.pictures not in ("png", "none")

    @property
    def cameras(self) -> tuple[str, ...]:
        """Cameras whose pictures are stored."""
        return () if self.plan.pictures == "none" else self.plan.cameras

    def features(self) -> dict[str, dict[str, Any]]:
        """Return the columns by name with type and shape, as LeRobot's ``info.json`` has them.

        For example ``{"dtype": "float32", "shape": [8], "names": ["joint_1", …]}``.
        """
        found = {self.keys[camera]: self._picture_feature() for camera in self.cameras}
        joint_names = [*JOINTS, "gripper"]
        names = _POSE if self.plan.actions == "waypoint" else joint_names
        found[self.keys["state"]] = _feature("float32", joint_names)
        found[self.keys["action"]] = _feature("float32", names)
        if self.plan.disturbed:
            found[EXECUTED] = _feature("float32", names)
        found["pose_action"] = _feature("float32", _POSE)
        for column, dtype, name in _SINGLE:
            found[column] = _feature(dtype, [name])
        if self.plan.language:
            for column in LANGUAGE_COLUMNS:
                found[column] = {"dtype": "language", "shape": [1], "names": None}
        return found

    def table_features(self) -> dict[str, dict[str, Any]]:
        """Return the features that are columns of the tables: all but videos."""
        features = self.features().items()
        return {name: feature for name, feature in features if feature["dtype"] != "video"}

    def _picture_feature(self) -> dict[str, Any]:
        """Return what ``info.json`` says of a column of pictures: type, shape, coding of videos."""
        feature: dict[str, Any] = {
            "dtype": "video" if self.has_videos else "image",
            "shape": [self.plan.size, self.plan.size, 3],
            "names": ["height", "width", "channel"],
        }
        if self.has_videos:
            feature["info"] = {
                "video.fps": CONTROL_RATE,
                "video.codec": "h264",
                "video.pix_fmt": STORED_FORMATS[self.plan.pictures],
                "video.height": self.plan.size,
                "video.width": self.plan.size,
                "video.channels": 3,
                "video.is_depth_map": False,
                "is_depth_map": False,
                "has_audio": False,
            }
        return feature

    def numbers(self, trajectory: Trajectory) -> dict[str, NDArray[Any]]:
        """Return the columns of numbers that do not depend on the instruction.

        Row 0 of a trajectory is before its first action. A frame has the state of one row and the
        action that leads to the next (``[:-1]`` and ``[1:]``), so there is one frame less than
        rows.

        Returns:
            By column, arrays of shape (frames, size); size is 1 for flags and times.
        """
        facts = trajectory.facts
        frames = np.arange(facts.frames, dtype=np.int64)
        columns: dict[str, NDArray[Any]] = {
            self.keys["state"]: trajectory.state[:-1],
            self.keys["action"]: trajectory.targets[1:].astype(np.float32),
            "pose_action": trajectory.pose_actions[1:].astype(np.float32),
        }
        if self.plan.disturbed:
            columns[EXECUTED] = trajectory.actions[1:].astype(np.float32)
        is_last = frames == facts.frames - 1
        is_success = is_last & (facts.status == "success")
        single_values = {
            "next.reward": is_success.astype(np.float32),
            "next.done": is_last,
            "next.success": is_success,
            "is_video_demo": frames < facts.video_length,
            "timestamp": (frames / CONTROL_RATE).astype(np.float32),
            "frame_index": frames,
        }
        for name, values in single_values.items():
            columns[name] = values[:, None]  # (frames,) becomes (frames, 1)
        return columns

    @staticmethod
    def indices(placed: PlacedInstruction, length: int) -> dict[str, NDArray[np.int64]]:
        """Return the columns of indices of one instruction, (frames, 1)."""
        return {
            "episode_index": np.full((length, 1), placed.episode_index, dtype=np.int64),
            "index": np.arange(placed.first_index, placed.first_index + length)[:, None],
            "task_index": np.full((length, 1), placed.task_index, dtype=np.int64),
        }

    def texts(self, trajectory: Trajectory) -> dict[str, list[str]]:
        """Return the columns of texts: what the robot does in the frame's action."""
        return {
            "subgoal": trajectory.subgoals[1:].tolist(),
            "grounded_subgoal": trajectory.grounded_subgoals[1:].tolist(),
        }

    def pictures(self, trajectory: Trajectory) -> dict[str, list[bytes]]:
        """Return the pictures of each camera as PNG files, one for each frame, by column.

        ``{"observation.images.front": [b"…", …]}``. The last row has no frame, as no action follows
        it.
        """
        rows = range(trajectory.facts.frames)
        columns = {}
        with zipfile.ZipFile(trajectory.path) as archive:
            for camera in self.cameras:
                pictures = [archive.read(picture_name(camera, row)) for row in rows]
                columns[self.keys[camera]] = pictures
        return columns

    def stats(
        self,
        numbers: Mapping[str, list[NDArray[Any]]],
        counts: Mapping[str, NDArray[np.int64]],
    ) -> dict[str, FeatureStats]:
        """Return the statistics, such as mean and deviation, of all columns but texts.

        Args:
            numbers: by column its values, arrays of shape (frames, size).
            counts: by column of pictures, how often each value of a channel occurs, (3, 256).
        """
        stats = {}
        for name, value_counts in counts.items():
            stats[name] = picture_stats(value_counts, self.plan.size**2)
        for name, arrays in numbers.items():
            stats[name] = vector_stats(np.concatenate(arrays))
        return stats


def _feature(dtype: str, names: list[str]) -> dict[str, Any]:
    """Return what ``info.json`` says of a column whose rows are vectors with a name per number."""
    return {"dtype": dtype, "shape": [len(names)], "names": names}
