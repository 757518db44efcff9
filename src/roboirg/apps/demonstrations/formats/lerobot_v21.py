"""Write LeRobot's format, version 2.1, for openpi and GR00T: a file of frames for each episode."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from roboirg.apps.demonstrations.dataset_part import (
    CHUNK_SIZE,
    EPISODE_TABLE,
    DatasetPart,
    all_texts,
    episode_row,
    read_episodes,
)
from roboirg.apps.demonstrations.formats.lerobot_v3 import (
    INFO,
    ROBOT,
    StatsCollector,
    count_frames,
    frame_columns,
    make_parts,
    own_columns,
    write_json,
    write_videos,
)
from roboirg.apps.demonstrations.frame_columns import FrameColumns
from roboirg.apps.demonstrations.parquet_tables import write_frames, write_rows
from roboirg.apps.demonstrations.trajectory import load_trajectory
from roboirg.util.atomic_write import write_atomically
from roboirg.util.media import CONTROL_RATE

__all__ = ["finish", "make_parts", "write_part"]

_DATA = "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet"
_VIDEO = "videos/chunk-{episode_chunk:03d}/{video_key}/episode_{episode_index:06d}.mp4"
_ARM_JOINTS = 7


def write_part(part: DatasetPart) -> None:
    """Write the episodes of one trajectory."""
    (episode,), columns = part.episodes, part.columns
    trajectory = load_trajectory(episode.path)
    shared = frame_columns(columns, trajectory)
    length = len(columns.rows(trajectory.facts))
    pictures = [] if columns.has_videos else [columns.keys[one] for one in columns.cameras]
    for placed in episode.texts:
        if columns.has_videos:
            write_videos(part, partial(_VIDEO.format, **_place(placed.episode_index)))
        own = own_columns(columns, trajectory, placed, length)
        order = [name for name in columns.features() if name in shared or name in own]
        path = part.root / _DATA.format(**_place(placed.episode_index))
        write_frames(path, order, shared, [own], pictures, columns.features())


def _place(episode_index: int) -> dict[str, int]:
    return {"episode_chunk": episode_index // CHUNK_SIZE, "episode_index": episode_index}


def finish(root: Path, parts: Sequence[DatasetPart]) -> None:
    """Write the metadata; ``info.json``, without which nothing reads the dataset, comes last."""
    columns = parts[0].columns
    collector = StatsCollector(columns)
    episodes, stats, facts = [], [], []
    for _, episode, trajectory in read_episodes(parts):
        length = len(columns.rows(trajectory.facts))
        for placed in episode.texts:
            index = placed.episode_index
            tasks = [placed.words.text]
            episodes.append({"episode_index": index, "tasks": tasks, "length": length})
            own = collector.add(trajectory, placed)
            stats.append({"episode_index": index, "stats": own})
            facts.append(episode_row(trajectory, placed, length))
    texts = all_texts(parts)
    tasks_lines = [{"task_index": index, "task": text} for index, text in enumerate(texts)]
    write_rows(root / EPISODE_TABLE, facts)
    _write_lines(root / "meta/episodes.jsonl", episodes)
    _write_lines(root / "meta/episodes_stats.jsonl", stats)
    _write_lines(root / "meta/tasks.jsonl", tasks_lines)
    write_json(root / "meta/stats.json", collector.result())
    write_json(root / "meta/modality.json", modality(columns))
    write_json(root / INFO, _info(columns, parts, len(texts)))


def modality(columns: FrameColumns) -> dict[str, Any]:
    """Return GR00T's description of the columns: which numbers are what."""
    arm, gripper = {"start": 0, "end": _ARM_JOINTS}, {"start": _ARM_JOINTS, "end": _ARM_JOINTS + 1}
    return {
        "state": {
            name: {**span, "original_key": columns.keys["state"]}
            for name, span in (("arm", arm), ("gripper", gripper))
        },
        "action": {
            name: {**span, "original_key": columns.keys["action"], "absolute": True}
            for name, span in (("arm", arm), ("gripper", gripper))
        },
        "video": {camera: {"original_key": columns.keys[camera]} for camera in columns.cameras},
        "annotation": {"human.task_description": {"original_key": "task_index"}},
    }


def _info(columns: FrameColumns, parts: Sequence[DatasetPart], texts: int) -> dict[str, Any]:
    count, frames = count_frames(columns, parts[-1].episodes[-1])
    return {
        "codebase_version": "v2.1",
        "robot_type": ROBOT,
        "total_episodes": count,
        "total_frames": frames,
        "total_tasks": texts,
        "total_videos": count * len(columns.cameras) if columns.has_videos else 0,
        "total_chunks": (count - 1) // CHUNK_SIZE + 1,
        "chunks_size": CHUNK_SIZE,
        "fps": CONTROL_RATE,
        "splits": {"train": f"0:{count}"},
        "data_path": _DATA,
        "video_path": _VIDEO if columns.has_videos else None,
        "features": columns.features(),
    }


def _write_lines(path: Path, lines: Iterable[object]) -> None:
    write_atomically(path, "".join(f"{json.dumps(one)}\n" for one in lines))
