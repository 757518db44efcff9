"""Write RoboMME's own format: one HDF5 file per task, a group per time step.

As in RoboMME's files, the observation of a time step is the result of its action, and neither the
robot's way home after the video nor the observation after it is stored.
"""

from __future__ import annotations

import json
import math
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from roboirg.apps.demonstrations.dataset_part import (
    EPISODE_TABLE,
    DatasetPart,
    RecordedEpisode,
    RecordedTexts,
    episode_row,
    place_texts,
    read_episodes,
)
from roboirg.apps.demonstrations.export_plan import ExportPlan, TaskText
from roboirg.apps.demonstrations.frame_columns import FrameColumns, PlacedText
from roboirg.apps.demonstrations.parquet_tables import write_rows
from roboirg.apps.demonstrations.trajectory import (
    Trajectory,
    load_trajectory,
    read_depth,
    read_picture,
)
from roboirg.core.extras import extra_needed
from roboirg.core.observations import CAMERAS
from roboirg.util.atomic_write import replacing

SHARED_FOLDER = "trajectories"
"""Folder of the time steps if several settings refer to them."""
_CLOSED_FINGER = 0.03
_NO_CHOICE = json.dumps({"choice": "", "point": []})


def check_hdf5_support() -> None:
    """Check early that HDF5 files can be written and read."""
    with extra_needed("RoboMME's format needs h5py", "demonstrations"):
        import h5py  # noqa: F401


def words_of(words: TaskText) -> str:
    """Return the name of the folder of a setting and form."""
    return f"{words.options.setting}-{words.options.form}"


def make_parts(
    plan: ExportPlan, root: Path, recorded: Sequence[RecordedTexts]
) -> list[DatasetPart]:
    """Return a part for each task."""
    columns, tasks = FrameColumns(plan), dict[str, list[RecordedEpisode]]()
    for one in place_texts(recorded):
        tasks.setdefault(_task(one), []).append(one)
    return [
        DatasetPart(number, root, columns, tuple(episodes))
        for number, episodes in enumerate(tasks.values())
    ]


def _task(episode: RecordedEpisode) -> str:
    return str(episode.texts[0].words.facts["task"])


def write_part(part: DatasetPart) -> None:
    """Write the files of one task: one, or one for each setting and form that share its steps."""
    import h5py

    name = f"record_dataset_{_task(part.episodes[0])}.h5"
    words = dict.fromkeys(words_of(one.words) for ep in part.episodes for one in ep.texts)
    is_shared = len(words) > 1
    home = part.root / SHARED_FOLDER if is_shared else part.root
    with replacing(home / name) as path, h5py.File(path, "w") as file:
        for episode in part.episodes:
            _write_episode(file, episode)
    for folder in words if is_shared else ():
        with replacing(part.root / folder / name) as path, h5py.File(path, "w") as file:
            for episode in part.episodes:
                _link_episode(file, episode, folder, f"../{SHARED_FOLDER}/{name}")


def _write_episode(file: Any, episode: RecordedEpisode) -> None:  # noqa: ANN401
    trajectory = load_trajectory(episode.path)
    group = file.create_group(f"episode_{trajectory.facts.episode}")
    _write_setup(group, trajectory, episode.texts[0])
    with zipfile.ZipFile(episode.path) as archive:
        for step, row in enumerate(time_steps(trajectory)):
            _write_step(group.create_group(f"timestep_{step}"), trajectory, row, archive)


def _link_episode(file: Any, episode: RecordedEpisode, folder: str, home: str) -> None:  # noqa: ANN401
    """Write an episode's own words, and links to its time steps."""
    import h5py

    for placed in episode.texts:
        if words_of(placed.words) != folder:
            continue
        trajectory = load_trajectory(episode.path)
        name = f"episode_{trajectory.facts.episode}"
        group = file.create_group(name)
        _write_setup(group, trajectory, placed)
        for step in range(len(time_steps(trajectory))):
            group[f"timestep_{step}"] = h5py.ExternalLink(home, f"/{name}/timestep_{step}")


def time_steps(trajectory: Trajectory) -> list[int]:
    """Return the rows that are time steps: all but the policy's first observation."""
    facts = trajectory.facts
    return [row for row in range(facts.frames + 1) if row != facts.video_length]


def _write_setup(group: Any, trajectory: Trajectory, placed: PlacedText) -> None:  # noqa: ANN401
    import h5py

    setup, facts = group.create_group("setup"), trajectory.facts
    setup["seed"] = np.int64(facts.seed)
    setup["difficulty"] = facts.difficulty
    setup.create_dataset("task_goal", data=[placed.words.text], dtype=h5py.string_dtype())
    for camera in CAMERAS:
        name = f"{camera}_intrinsic"
        setup[f"{camera}_camera_intrinsic"] = trajectory.calibration[name]
    setup["available_multi_choices"] = "[]"


def _write_step(
    group: Any,  # noqa: ANN401
    trajectory: Trajectory,
    row: int,
    archive: zipfile.ZipFile,
) -> None:
    seen = group.create_group("obs")
    for camera in CAMERAS:
        options = {"compression": "gzip", "compression_opts": 1}
        seen.create_dataset(f"{camera}_rgb", data=read_picture(archive, camera, row), **options)
        seen.create_dataset(f"{camera}_depth", data=read_depth(archive, camera, row), **options)
        extrinsic = trajectory.calibration[f"{camera}_extrinsic"][row]
        seen[f"{camera}_camera_extrinsic"] = extrinsic
    seen["joint_state"] = trajectory.joint_positions[row]
    seen["eef_state"] = trajectory.end_effector[row].astype(np.float32)
    seen["gripper_state"] = trajectory.gripper[row]
    seen["is_gripper_close"] = np.bool_((trajectory.gripper[row] < _CLOSED_FINGER).any())
    done = group.create_group("action")
    done["joint_action"] = trajectory.actions[row]
    done["eef_action"] = trajectory.pose_actions[row]
    done["waypoint_action"] = np.full(7, math.nan)
    done["choice_action"] = _NO_CHOICE
    info = group.create_group("info")
    info["simple_subgoal"] = str(trajectory.subgoals[row])
    info["simple_subgoal_online"] = str(trajectory.online_subgoals[row])
    info["grounded_subgoal"] = str(trajectory.grounded_subgoals[row])
    info["grounded_subgoal_online"] = str(trajectory.grounded_online_subgoals[row])
    info["is_video_demo"] = np.bool_(row < trajectory.facts.video_length)
    info["is_subgoal_boundary"] = np.bool_(_is_boundary(trajectory, row))
    info["is_completed"] = np.bool_(False)


def _is_boundary(trajectory: Trajectory, row: int) -> bool:
    """Return whether a row is the first of its subgoal among the time steps."""
    length = trajectory.facts.video_length
    before = row - 2 if row - 1 == length else row - 1
    is_first = before < 0 or row == length + 1
    return is_first or bool(trajectory.subgoals[row] != trajectory.subgoals[before])


def finish(root: Path, parts: Sequence[DatasetPart]) -> None:
    """Write the table of facts."""
    rows = [
        episode_row(trajectory, placed)
        for _, episode, trajectory in read_episodes(parts)
        for placed in episode.texts
    ]
    write_rows(root / EPISODE_TABLE, rows)
