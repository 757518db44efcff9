"""Read the states and actions of a dataset, whatever its format, without its pictures."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roboirg.apps.demonstrations.dataset_part import EPISODE_TABLE
from roboirg.apps.demonstrations.formats.robomme_hdf5 import SHARED_FOLDER, check_hdf5_support
from roboirg.apps.demonstrations.frame_columns import EXECUTED
from roboirg.apps.demonstrations.parquet_tables import read_rows
from roboirg.core.actions import JOINT_ANGLE, CheckedActions
from roboirg.core.errors import InvalidValueError
from roboirg.util.parquet_support import check_parquet_support

_STATES = ("observation.state", "state")
"""Names of the column of states, by format."""
_ACTIONS = (EXECUTED, "action", "actions")
"""Names of the column of what was executed, by format; the first that a dataset has counts."""
_HDF5_NAME = re.compile(r"record_dataset_(\w+)\.h5")
"""For example record_dataset_PickXtimes.h5."""
_JOINTS = 7


@dataclass(frozen=True, eq=False)
class ReplayableTrajectory:
    """What a dataset says of one trajectory.

    Attributes:
        name: of the trajectory, for messages.
        task: name of the task.
        seed: of the scene.
        split: of the episode; None if the dataset does not say, as RoboMME's.
        index: of the episode in the split; None likewise.
        actions: (n, size) that were executed, in a disturbed trajectory not those to learn.
        states: (n, 8) after each of the actions: joints (rad) and the first finger (m).
        final_state: (9,) joints and both fingers at the end; None if the dataset does not say.
        status: how it ended; RoboMME's are successes.
        space: name of the action space.
    """

    name: str
    task: str
    seed: int
    split: str | None
    index: int | None
    actions: CheckedActions
    states: NDArray[np.float64]
    final_state: NDArray[np.float64] | None
    status: str
    space: str = JOINT_ANGLE.name


def read_dataset(path: Path) -> Iterator[ReplayableTrajectory]:
    """Yield every trajectory of a dataset once, whatever the number of its instructions.

    Args:
        path: folder of an export, or of RoboMME's HDF5 files, or one of these files.

    Raises:
        InvalidValueError: the path holds no dataset that can be read.
        MissingDependencyError: a package is not installed.
    """
    if path.is_file() and _HDF5_NAME.fullmatch(path.name):
        return _read_hdf5([path])
    info = path / "meta/info.json"
    if info.is_file() and (path / EPISODE_TABLE).is_file():
        check_parquet_support()
        return _read_tables(path, json.loads(info.read_text(encoding="utf-8")))
    files = _hdf5_files(path)
    if not files:
        raise InvalidValueError(
            f"{str(path)!r} holds no dataset: neither a complete export of ours nor RoboMME's "
            "files record_dataset_TASK.h5."
        )
    return _read_hdf5(files)


def _hdf5_files(folder: Path) -> list[Path]:
    """Return the HDF5 files that hold time steps, not links to them."""
    for place in (folder, folder / SHARED_FOLDER):
        files = sorted(path for path in place.glob("*.h5") if _HDF5_NAME.fullmatch(path.name))
        if files:
            return files
    return []


def _read_tables(root: Path, info: Mapping[str, Any]) -> Iterator[ReplayableTrajectory]:
    """Yield the trajectories of an export of ours in LeRobot's formats."""
    files = _data_files(root, info)
    state, action = _columns(info)
    rows: dict[str, dict[str, Any]] = {}
    for row in read_rows(root / EPISODE_TABLE):
        rows.setdefault(row["trajectory"], row)  # that of its first instruction
    for name, row in rows.items():
        number = row["episode_index"]
        frames = _own_frames(files[number], number, (state, action))
        final = np.array(row["final_state"])
        yield ReplayableTrajectory(
            name=name,
            task=row["task"],
            seed=row["seed"],
            split=row["split"],
            index=row["episode"],
            actions=frames[action].astype(np.float64),
            states=np.concatenate([frames[state][1:], final[None, : _JOINTS + 1]]),
            final_state=final,
            status=row["status"],
            space=row.get("actions", JOINT_ANGLE.name),
        )


def _columns(info: Mapping[str, Any]) -> tuple[str, str]:
    """Return the names of the columns of states and of executed actions."""
    state = next(name for name in _STATES if name in info["features"])
    action = next(name for name in _ACTIONS if name in info["features"])
    return state, action


def _own_frames(path: Path, number: int, names: Sequence[str]) -> dict[str, NDArray[Any]]:
    """Return columns of the frames of an episode, without those of its video."""
    from pyarrow import parquet

    table = parquet.read_table(path, columns=[*names, "episode_index", "is_video_demo"])
    is_own = np.asarray(table["episode_index"]) == number
    is_own &= ~np.asarray(table["is_video_demo"])
    return {name: np.array(table[name].to_pylist())[is_own] for name in names}


def _data_files(root: Path, info: Mapping[str, Any]) -> Mapping[int, Path]:
    """Return the file of frames of each episode."""
    pattern = info["data_path"]
    files = {}
    if info["codebase_version"] != "v3.0":
        size = info["chunks_size"]
        for number in range(info["total_episodes"]):
            name = pattern.format(episode_chunk=number // size, episode_index=number)
            files[number] = root / name
        return files
    for path in sorted((root / "meta/episodes").glob("*/*.parquet")):
        for row in read_rows(path):
            name = pattern.format(
                chunk_index=row["data/chunk_index"], file_index=row["data/file_index"]
            )
            files[row["episode_index"]] = root / name
    return files


def _read_hdf5(files: list[Path]) -> Iterator[ReplayableTrajectory]:
    """Yield the trajectories of RoboMME's files."""
    check_hdf5_support()
    import h5py

    for path in files:
        task = path.stem.removeprefix("record_dataset_")
        with h5py.File(path, "r") as file:
            for name in sorted(file, key=_number):
                yield _read_hdf5_episode(file[name], task, name)


def _read_hdf5_episode(group: Any, task: str, name: str) -> ReplayableTrajectory:  # noqa: ANN401
    """Return an episode of RoboMME's files, without the time steps of its video."""
    actions = []
    states = []
    final = None
    names = [name for name in group if name.startswith("timestep_")]
    for step in sorted(names, key=_number):
        entry = group[step]
        action = np.asarray(entry["action/joint_action"][()])
        has_action = action.dtype.kind == "f"  # else it is a text
        if entry["info/is_video_demo"][()] or not has_action:
            continue
        joints = entry["obs/joint_state"][()]
        fingers = entry["obs/gripper_state"][()]
        actions.append(action.astype(np.float64))
        states.append(np.append(joints, fingers[0]).astype(np.float64))
        final = np.append(joints, fingers).astype(np.float64)
    return ReplayableTrajectory(
        name=f"{task}/{name}",
        task=task,
        seed=int(group["setup/seed"][()]),
        split=None,
        index=None,
        actions=np.array(actions).reshape(-1, _JOINTS + 1),
        states=np.array(states).reshape(-1, _JOINTS + 1),
        final_state=final,
        status="success",
    )


def _number(name: str) -> int:
    """Return the number at the end of a group's name."""
    return int(name.rpartition("_")[2])
