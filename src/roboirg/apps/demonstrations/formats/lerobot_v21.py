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
    StatsCollector,
    common_info,
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

__all__ = ["finish", "make_parts", "write_part"]

_DATA = "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet"
_VIDEO = "videos/chunk-{episode_chunk:03d}/{video_key}/episode_{episode_index:06d}.mp4"
_ARM_JOINTS = 7


def write_part(part: DatasetPart) -> None:
    """Write the episodes of one trajectory."""
    (episode,), columns = part.episodes, part.columns
    trajectory = load_trajectory(episode.path)
    shared = frame_columns(columns, trajectory)
    for placed in episode.texts:
        if columns.has_videos:
            write_videos(part, partial(_VIDEO.format, **_place(placed.episode_index)))
        own = own_columns(placed, trajectory.facts.frames)
        path = part.root / _DATA.format(**_place(placed.episode_index))
        write_frames(path, columns.table_features(), shared, [own], is_described=True)


def _place(episode_index: int) -> dict[str, int]:
    return {"episode_chunk": episode_index // CHUNK_SIZE, "episode_index": episode_index}


def finish(root: Path, parts: Sequence[DatasetPart]) -> None:
    """Write the metadata; ``info.json``, without which nothing reads the dataset, comes last."""
    columns = parts[0].columns
    collector = StatsCollector(columns)
    episodes, stats, facts = [], [], []
    for _, episode, trajectory in read_episodes(parts):
        for placed in episode.texts:
            name = {"episode_index": placed.episode_index}
            length = trajectory.facts.frames
            episodes.append({**name, "tasks": [placed.words.text], "length": length})
            stats.append({**name, "stats": collector.add(trajectory, placed)})
            facts.append(episode_row(trajectory, placed))
    texts = all_texts(parts)
    tasks_lines = [{"task_index": index, "task": text} for index, text in enumerate(texts)]
    write_rows(root / EPISODE_TABLE, facts)
    _write_lines(root / "meta/episodes.jsonl", episodes)
    _write_lines(root / "meta/episodes_stats.jsonl", stats)
    _write_lines(root / "meta/tasks.jsonl", tasks_lines)
    write_json(root / "meta/stats.json", collector.result())
    write_json(root / "meta/modality.json", modality(columns))
    info = common_info(parts, texts)
    count, videos = info["total_episodes"], len(columns.cameras) * columns.has_videos
    more = {
        "codebase_version": "v2.1",
        "total_videos": count * videos,
        "total_chunks": (count - 1) // CHUNK_SIZE + 1,
        "data_path": _DATA,
        "video_path": _VIDEO if columns.has_videos else None,
    }
    write_json(root / INFO, info | more)


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


def _write_lines(path: Path, lines: Iterable[object]) -> None:
    write_atomically(path, "".join(f"{json.dumps(one)}\n" for one in lines))
