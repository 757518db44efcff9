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
from roboirg.apps.demonstrations.frame_columns import FrameColumns, PlacedText
from roboirg.apps.demonstrations.parquet_tables import write_frames, write_rows
from roboirg.apps.demonstrations.trajectory import Trajectory, load_trajectory
from roboirg.util.atomic_write import write_atomically

__all__ = ["finish", "make_parts", "write_part"]

_DATA = "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet"
_VIDEO = "videos/chunk-{episode_chunk:03d}/{video_key}/episode_{episode_index:06d}.mp4"
_ARM_JOINTS = 7


def write_part(part: DatasetPart) -> None:
    """Write the episodes of one trajectory."""
    (episode,) = part.episodes
    columns = part.columns
    trajectory = load_trajectory(episode.path)
    shared = frame_columns(columns, trajectory)
    for placed in episode.texts:
        place = _place(placed.episode_index)
        if columns.has_videos:
            write_videos(part, partial(_VIDEO.format, **place))
        own = own_columns(placed, trajectory.facts.frames)
        path = part.root / _DATA.format(**place)
        write_frames(path, columns.table_features(), shared, [own], is_described=True)


def _place(episode_index: int) -> dict[str, int]:
    return {"episode_chunk": episode_index // CHUNK_SIZE, "episode_index": episode_index}


def finish(root: Path, parts: Sequence[DatasetPart]) -> None:
    """Write the metadata; ``info.json``, without which nothing reads the dataset, comes last."""
    columns = parts[0].columns
    lines = _EpisodeLines(columns)
    for _, episode, trajectory in read_episodes(parts):
        for placed in episode.texts:
            lines.add(trajectory, placed)
    texts = all_texts(parts)
    task_lines = [{"task_index": index, "task": text} for index, text in enumerate(texts)]
    write_rows(root / EPISODE_TABLE, lines.facts)
    _write_lines(root / "meta/episodes.jsonl", lines.episodes)
    _write_lines(root / "meta/episodes_stats.jsonl", lines.stats)
    _write_lines(root / "meta/tasks.jsonl", task_lines)
    write_json(root / "meta/stats.json", lines.collector.result())
    write_json(root / "meta/modality.json", modality(columns))
    write_json(root / INFO, _info(parts, texts))


class _EpisodeLines:
    """What the files of metadata say of each episode.

    Attributes:
        collector: of the statistics of all.
        episodes: lines of ``episodes.jsonl``.
        stats: lines of ``episodes_stats.jsonl``.
        facts: rows of the table of facts.
    """

    def __init__(self, columns: FrameColumns) -> None:
        self.collector = StatsCollector(columns)
        self.episodes: list[dict[str, Any]] = []
        self.stats: list[dict[str, Any]] = []
        self.facts: list[dict[str, Any]] = []

    def add(self, trajectory: Trajectory, placed: PlacedText) -> None:
        """Add an episode: a trajectory with one of its instructions."""
        index = placed.episode_index
        texts = [placed.words.text]
        length = trajectory.facts.frames
        self.episodes.append({"episode_index": index, "tasks": texts, "length": length})
        stats = self.collector.add(trajectory, placed)
        self.stats.append({"episode_index": index, "stats": stats})
        self.facts.append(episode_row(trajectory, placed))


def _info(parts: Sequence[DatasetPart], texts: Sequence[str]) -> dict[str, Any]:
    """Return what ``info.json`` says."""
    columns = parts[0].columns
    info = common_info(parts, texts)
    episodes = info["total_episodes"]
    info["codebase_version"] = "v2.1"
    info["total_videos"] = episodes * len(columns.cameras) if columns.has_videos else 0
    info["total_chunks"] = (episodes - 1) // CHUNK_SIZE + 1
    info["data_path"] = _DATA
    info["video_path"] = _VIDEO if columns.has_videos else None
    return info


def modality(columns: FrameColumns) -> dict[str, Any]:
    """Return GR00T's description of the columns: which numbers are what."""
    state = {}
    action = {}
    for name, start, end in (("arm", 0, _ARM_JOINTS), ("gripper", _ARM_JOINTS, _ARM_JOINTS + 1)):
        span = {"start": start, "end": end}
        state[name] = {**span, "original_key": columns.keys["state"]}
        action[name] = {**span, "original_key": columns.keys["action"], "absolute": True}
    return {
        "state": state,
        "action": action,
        "video": {camera: {"original_key": columns.keys[camera]} for camera in columns.cameras},
        "annotation": {"human.task_description": {"original_key": "task_index"}},
    }


def _write_lines(path: Path, lines: Iterable[object]) -> None:
    """Write a line of JSON for each object."""
    texts = [json.dumps(line) + "\n" for line in lines]
    write_atomically(path, "".join(texts))
