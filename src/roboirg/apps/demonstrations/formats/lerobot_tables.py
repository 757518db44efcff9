"""Read the states and actions of a dataset in either version of LeRobot's format."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from roboirg.apps.demonstrations.dataset_part import EPISODE_TABLE
from roboirg.apps.demonstrations.frame_columns import EXECUTED
from roboirg.apps.demonstrations.parquet_tables import read_rows
from roboirg.apps.demonstrations.replayable_trajectory import ReplayableTrajectory
from roboirg.core.actions import JOINT_ANGLE
from roboirg.util.parquet_support import check_parquet_support
from roboirg.util.regular_file import read_regular

INFO = "meta/info.json"
"""Path of the file that describes a dataset and is written last."""
_STATES = ("observation.state", "state")
"""Names of the column of states, by format."""
_ACTIONS = (EXECUTED, "action", "actions")
"""Names of the column of what was executed, by format; the first that a dataset has counts."""
_JOINTS = 7


def read_tables(root: Path) -> Iterator[ReplayableTrajectory]:
    """Read the trajectories of a dataset that was exported in LeRobot's format, to replay them.

    A trajectory is in the dataset once for each instruction, of which the first is read. Frames of
    the video that the policy was shown are left out. Yields nothing if the folder holds no such
    export.
    """
    path = root / INFO
    if not path.is_file() or not (root / EPISODE_TABLE).is_file():
        return
    check_parquet_support()
    from pyarrow import parquet

    info = json.loads(read_regular(path))
    state = _present(_STATES, info)
    action = _present(_ACTIONS, info)
    files = sorted((root / "data").rglob("*.parquet"))
    frames = parquet.ParquetDataset(files).read(columns=[state, action])
    seen = set()
    for row in read_rows(root / EPISODE_TABLE):
        if row["trajectory"] in seen:
            continue  # the same with another instruction
        seen.add(row["trajectory"])
        after_video = row["from_index"] + row["video_length"]
        own = frames.slice(after_video, row["length"] - row["video_length"])
        yield _trajectory(row, own[state].to_pylist(), own[action].to_pylist())


def _trajectory(
    row: Mapping[str, Any], states: Sequence[Sequence[float]], actions: Sequence[Sequence[float]]
) -> ReplayableTrajectory:
    """Return a trajectory from its row in the table of facts and its frames without the video.

    Args:
        row: with the names of `episode_row`.
        states: before each action, (n, 8); those of the result are after it, the last from `row`.
        actions: (n, size).
    """
    final = np.array(row["final_state"])  # with both fingers; frames have one
    return ReplayableTrajectory(
        name=row["trajectory"],
        task=row["task"],
        seed=row["seed"],
        split=row["split"],
        index=row["episode"],
        actions=np.array(actions, np.float64),
        states=np.concatenate([np.array(states)[1:], final[None, : _JOINTS + 1]]),
        final_state=final,
        status=row["status"],
        space=row.get("actions", JOINT_ANGLE.name),
    )


def _present(names: Iterable[str], info: Mapping[str, Any]) -> str:
    """Return the first of some names that is a column of the dataset, by its ``info.json``."""
    return next(name for name in names if name in info["features"])
