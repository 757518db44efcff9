"""Read the states and actions of a dataset in either version of LeRobot's format."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from roboirg.apps.demonstrations.dataset_part import EPISODE_TABLE
from roboirg.apps.demonstrations.frame_columns import EXECUTED
from roboirg.apps.demonstrations.parquet_tables import read_rows
from roboirg.apps.demonstrations.replayable_trajectory import ReplayableTrajectory
from roboirg.core.actions import JOINT_ANGLE
from roboirg.util.parquet_support import check_parquet_support

INFO = "meta/info.json"
"""Path of the file that describes a dataset and is written last."""
_STATES = ("observation.state", "state")
"""Names of the column of states, by format."""
_ACTIONS = (EXECUTED, "action", "actions")
"""Names of the column of what was executed, by format; the first that a dataset has counts."""
_JOINTS = 7


def read_tables(root: Path) -> Iterator[ReplayableTrajectory] | None:
    """Return the trajectories of an export, each once; None if the folder holds none."""
    info = root / INFO
    if not info.is_file() or not (root / EPISODE_TABLE).is_file():
        return None
    check_parquet_support()
    return _trajectories(root, json.loads(info.read_text(encoding="utf-8")))


def _trajectories(root: Path, info: Mapping[str, Any]) -> Iterator[ReplayableTrajectory]:
    """Yield the trajectories of an export, with the frames of the first instruction."""
    from pyarrow import parquet

    state, action = _columns(info)
    files = sorted((root / "data").rglob("*.parquet"))
    frames = parquet.ParquetDataset(files).read(columns=[state, action])
    rows: dict[str, dict[str, Any]] = {}
    for row in read_rows(root / EPISODE_TABLE):
        rows.setdefault(row["trajectory"], row)  # that of its first instruction
    for name, row in rows.items():
        after_video = row["from_index"] + row["video_length"]
        own = frames.slice(after_video, row["length"] - row["video_length"])
        states = np.array(own[state].to_pylist())
        actions = np.array(own[action].to_pylist())
        final = np.array(row["final_state"])
        yield ReplayableTrajectory(
            name=name,
            task=row["task"],
            seed=row["seed"],
            split=row["split"],
            index=row["episode"],
            actions=actions.astype(np.float64),
            states=np.concatenate([states[1:], final[None, : _JOINTS + 1]]),
            final_state=final,
            status=row["status"],
            space=row.get("actions", JOINT_ANGLE.name),
        )


def _columns(info: Mapping[str, Any]) -> tuple[str, str]:
    """Return the names of the columns of states and of executed actions."""
    state = next(name for name in _STATES if name in info["features"])
    action = next(name for name in _ACTIONS if name in info["features"])
    return state, action
