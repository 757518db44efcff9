"""Write LeRobot's format, version 3.0: a file of frames and one per camera for each trajectory."""

from __future__ import annotations

import json
import zipfile
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roboirg.apps.demonstrations.dataset_part import (
    CHUNK_SIZE,
    DatasetPart,
    RecordedInstructions,
    all_texts,
    place_instructions,
    read_episodes,
)
from roboirg.apps.demonstrations.export_format import ExportFormat
from roboirg.apps.demonstrations.export_plan import ExportPlan
from roboirg.apps.demonstrations.feature_stats import FeatureStats, vector_stats
from roboirg.apps.demonstrations.formats.lerobot_tables import INFO, read_tables
from roboirg.apps.demonstrations.frame_columns import FrameColumns, PlacedInstruction
from roboirg.apps.demonstrations.language_columns import language_columns
from roboirg.apps.demonstrations.parquet_tables import (
    number_column,
    picture_column,
    text_column,
    write_frames,
    write_rows,
)
from roboirg.apps.demonstrations.trajectory import (
    Trajectory,
    load_facts,
    load_trajectory,
    video_name,
)
from roboirg.util.atomic_write import replacing, write_atomically
from roboirg.util.media import CONTROL_RATE

_DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
_VIDEO = "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
_LEROBOT = """\
```sh
# Needs the environment of docs/training.md, Install: Python 3.12 with LeRobot and roboirg.
lerobot-train --dataset.repo_id=local/roboirg --dataset.root={root}{backend} \\
    --policy.type=act --policy.push_to_hub=false --policy.device=cuda \\
    --policy.pretrained_backbone_weights=null --dataset.use_imagenet_stats=false \\
    --batch_size=64 --steps=20000 --wandb.enable=false --output_dir=outputs/act
{after}```

The same line with `--policy.type=diffusion` trains Diffusion Policy, and with `--policy.type=vqbet`
VQ-BeT, which takes one camera. None of the three reads the instruction: train them on one task at a
time. With `null`, they begin without the weights of ImageNet, and nothing is downloaded.

Expect little of these lines: ACT, trained like this for three minutes (one H100, a narrower
network, 100 demonstrations of PickXtimes), solved 0 of 50 episodes of `val`. All 20,000 steps have
not been trained here. `roboirg learn policy --tasks PickXtimes`, with 400 scenes, made a policy
that solves 95 % of the same episodes.
"""
_LEROBOT_RUN = """\
roboirg run --policy 'act=lerobot://outputs/act/checkpoints/last/pretrained_model?device=cuda' \\
    --tasks {task} --out runs/act
"""
_WAYPOINTS = """\
# lerobot:// plays joint angles alone. To play a policy of waypoints, write a class with
# actions = "waypoint", and round its gripper to -1, 0 or 1.
"""
_PYAV = " --dataset.video_backend=pyav"
"""Of a dataset with videos; LeRobot's usual decoder, torchcodec, needs FFmpeg on the system."""


def make_parts(
    plan: ExportPlan, root: Path, recorded: Sequence[RecordedInstructions]
) -> list[DatasetPart]:
    """Return a part for each trajectory, numbered from 0; files are named after the numbers."""
    columns = FrameColumns(plan)
    return [
        DatasetPart(number, root, columns, (episode,))
        for number, episode in enumerate(place_instructions(recorded))
    ]


def write_part(part: DatasetPart) -> None:
    """Write one trajectory as a Parquet file, with its videos: LeRobot's format 3.0.

    The file has the trajectory's frames once for each of its instructions; the videos are stored
    once. Makes only files of this part, so parts can be written by several processes.
    """
    (episode,) = part.episodes
    columns = part.columns
    trajectory = load_trajectory(episode.path)
    place = {"chunk_index": part.place.chunk, "file_index": part.place.file}
    if columns.has_videos:
        write_videos(part, partial(_VIDEO.format, **place))
    shared = frame_columns(columns, trajectory)
    own = []
    for placed in episode.instructions:
        own_of_episode = own_columns(placed, trajectory.facts.frames)
        if columns.plan.language:
            own_of_episode |= language_columns(trajectory, placed)
        own.append(own_of_episode)
    path = part.root / _DATA.format(**place)
    write_frames(path, columns.table_features(), shared, own)


def write_videos(part: DatasetPart, name_of: Callable[..., str]) -> None:
    """Write the videos of a part's one trajectory; `name_of` gets the column, `video_key`."""
    with zipfile.ZipFile(part.episodes[0].path) as archive:
        for camera in part.columns.cameras:
            path = part.root / name_of(video_key=part.columns.keys[camera])
            write_atomically(path, archive.read(video_name(camera)))


def frame_columns(columns: FrameColumns, trajectory: Trajectory) -> dict[str, Any]:
    """Return a trajectory's columns of Parquet that all its instructions share, by name.

    They are numbers such as states and actions, texts, and pictures if these are not in videos.
    `own_columns` returns the others.
    """
    arrow_columns = {}
    for name, numbers in columns.numbers(trajectory).items():
        arrow_columns[name] = number_column(numbers)
    for name, texts in columns.texts(trajectory).items():
        arrow_columns[name] = text_column(texts)
    if not columns.has_videos:
        for name, pictures in columns.pictures(trajectory).items():
            arrow_columns[name] = picture_column(pictures)
    return arrow_columns


def own_columns(placed: PlacedInstruction, length: int) -> dict[str, Any]:
    """Return the columns that differ between the instructions of a trajectory: its indices."""
    indices = FrameColumns.indices(placed, length)
    return {name: number_column(values) for name, values in indices.items()}


def finish(root: Path, parts: Sequence[DatasetPart]) -> None:
    """Write the metadata of a complete dataset: episodes, texts, statistics, and ``info.json``.

    The latter comes last, because nothing reads the dataset without it. Episodes are added in the
    order of their numbers, on which LeRobot's tables rely.
    """
    columns = parts[0].columns
    stats = StatsCollector(columns)
    episodes = []
    for part, episode, trajectory in read_episodes(parts):
        for placed in episode.instructions:
            entry = _episode_entry(part, placed, trajectory.facts.frames)
            entry |= _flat(stats.add(trajectory, placed))
            episodes.append(entry)
    texts = all_texts(parts)
    write_rows(root / "meta/episodes/chunk-000/file-000.parquet", episodes)
    _write_tasks(root / "meta/tasks.parquet", texts)
    write_json(root / "meta/stats.json", stats.result())
    info = {
        **common_info(parts, texts),
        "codebase_version": "v3.0",
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "data_path": _DATA,
        "video_path": _VIDEO if columns.has_videos else None,
    }
    write_json(root / INFO, info)


class StatsCollector:
    """Collects the statistics of single episodes and of the whole dataset, in one pass.

    Call `add` for each episode, then `result`. All instructions of a trajectory must be added one
    after the other: what they share is computed once and kept until another trajectory comes.
    """

    def __init__(self, columns: FrameColumns) -> None:
        """Begin with no episodes; `columns` says which columns there are."""
        self._columns = columns
        # By column: the numbers of each episode, (frames, size), and of pictures (3, 256) how often
        # each value of a color channel occurs.
        self._numbers: defaultdict[str, list[NDArray[Any]]] = defaultdict(list)
        self._counts: dict[str, NDArray[np.int64]] = {}
        # Instructions of a trajectory follow one another and share what is slow to compute.
        self._last_path: Path | None = None
        self._shared_stats: dict[str, FeatureStats] = {}

    def add(self, trajectory: Trajectory, placed: PlacedInstruction) -> dict[str, FeatureStats]:
        """Add an episode to the statistics of the dataset; return those of the episode alone.

        Args:
            trajectory: what the robot did.
            placed: the episode's instruction, with its numbers in the dataset.

        Returns:
            By column the statistics, ``{"action": {"min": […], "max": […], …}, …}``.
        """
        shared = self._columns.numbers(trajectory)
        indices = self._columns.indices(placed, trajectory.facts.frames)
        for name, values in (shared | indices).items():
            self._numbers[name].append(values)
        for name, counts in self._picture_counts(trajectory).items():
            self._counts[name] = self._counts.get(name, 0) + counts
        stats = self._stats_of(trajectory, shared)
        for name, values in indices.items():
            stats[name] = vector_stats(values)
        return stats

    def _picture_counts(self, trajectory: Trajectory) -> dict[str, NDArray[np.int64]]:
        """Return the counts of pixel values by the columns of pictures."""
        cameras = self._columns.cameras
        return {self._columns.keys[camera]: trajectory.histograms[camera] for camera in cameras}

    def _stats_of(
        self, trajectory: Trajectory, shared: Mapping[str, NDArray[Any]]
    ) -> dict[str, FeatureStats]:
        """Return the statistics of the columns that all instructions of a trajectory share.

        They are kept until the next trajectory comes.
        """
        if self._last_path != trajectory.path:
            numbers = {name: [values] for name, values in shared.items()}
            counts = self._picture_counts(trajectory)
            self._shared_stats = self._columns.stats(numbers, counts)
            self._last_path = trajectory.path
        return dict(self._shared_stats)

    def result(self) -> dict[str, FeatureStats]:
        """Return the statistics of all episodes."""
        return self._columns.stats(self._numbers, self._counts)


def _episode_entry(part: DatasetPart, placed: PlacedInstruction, length: int) -> dict[str, Any]:
    """Return a row of LeRobot's table of episodes: where an episode's frames are stored.

    Args:
        part: the file with its frames.
        placed: its instruction, with its numbers in the dataset.
        length: number of its frames.
    """
    chunk, file = part.place
    entry: dict[str, Any] = {
        "episode_index": placed.episode_index,
        "tasks": [placed.instruction.text],
        "length": length,
        "data/chunk_index": chunk,
        "data/file_index": file,
        "dataset_from_index": placed.first_index,
        "dataset_to_index": placed.first_index + length,
    }
    if part.columns.has_videos:
        for camera in part.columns.cameras:
            key = f"videos/{part.columns.keys[camera]}"
            entry[f"{key}/chunk_index"] = chunk
            entry[f"{key}/file_index"] = file
            entry[f"{key}/from_timestamp"] = 0.0
            entry[f"{key}/to_timestamp"] = length / CONTROL_RATE
    entry["meta/episodes/chunk_index"] = 0
    entry["meta/episodes/file_index"] = 0
    return entry


def _flat(stats: Mapping[str, FeatureStats]) -> dict[str, Any]:
    """Return statistics in one level: that of ``action`` ``{"min": …}`` is ``stats/action/min``."""
    flat = {}
    for feature, stats_of_feature in stats.items():
        for name, value in stats_of_feature.items():
            flat[f"stats/{feature}/{name}"] = value
    return flat


def _write_tasks(path: Path, texts: Sequence[str]) -> None:
    """Write the distinct texts of instructions with their indices, as LeRobot expects them.

    LeRobot reads the file with pandas, and wants the texts as the index of the data frame; this is
    said by the metadata that pandas itself would write. `texts` are in the order of their indices
    from 0.
    """
    import pyarrow as pa
    from pyarrow import parquet

    table = pa.table({"task_index": pa.array(range(len(texts)), pa.int64()), "task": list(texts)})
    described = {
        "index_columns": ["task"],
        "column_indexes": [
            {
                "name": None,
                "field_name": None,
                "pandas_type": "unicode",
                "numpy_type": "object",
                "metadata": {"encoding": "UTF-8"},
            }
        ],
        "columns": [
            {
                "name": "task_index",
                "field_name": "task_index",
                "pandas_type": "int64",
                "numpy_type": "int64",
                "metadata": None,
            },
            {
                "name": "task",
                "field_name": "task",
                "pandas_type": "unicode",
                "numpy_type": "object",
                "metadata": None,
            },
        ],
        "creator": {"library": "pyarrow", "version": pa.__version__},
        "pandas_version": "2.0.0",
    }
    table = table.replace_schema_metadata({"pandas": json.dumps(described)})
    with replacing(path) as part:
        parquet.write_table(table, part)


def common_info(parts: Sequence[DatasetPart], texts: Sequence[str]) -> dict[str, Any]:
    """Return the facts of ``info.json`` that versions 2.1 and 3.0 of LeRobot's format share.

    Args:
        parts: of the dataset, in the order of its frames.
        texts: the distinct instructions.
    """
    last = parts[-1].episodes[-1]
    placed = last.instructions[-1]
    count = placed.episode_index + 1
    return {
        "robot_type": "panda",
        "total_episodes": count,
        "total_frames": placed.first_index + load_facts(last.path).frames,
        "total_tasks": len(texts),
        "chunks_size": CHUNK_SIZE,
        "fps": CONTROL_RATE,
        "splits": {"train": f"0:{count}"},
        "features": parts[0].columns.features(),
    }


def write_json(path: Path, content: object) -> None:
    """Write JSON, atomically."""
    write_atomically(path, json.dumps(content, indent=2) + "\n")


def training_text(plan: ExportPlan, root: Path) -> str:
    """Return how to train LeRobot's policies from a dataset, as Markdown."""
    backend = _PYAV if FrameColumns(plan).has_videos else ""
    after = _WAYPOINTS if plan.actions == "waypoint" else _LEROBOT_RUN.format(task=plan.tasks[0])
    return _LEROBOT.format(root=root, after=after, backend=backend)


FORMAT = ExportFormat(
    name="lerobot-v3",
    has_language=True,
    has_waypoints=True,
    make_parts=make_parts,
    write_part=write_part,
    finish=finish,
    training_text=training_text,
    read=read_tables,
)
