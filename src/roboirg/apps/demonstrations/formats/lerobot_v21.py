"""Write LeRobot's format, version 2.1, for openpi and GR00T: a file of frames for each episode."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from roboirg.apps.demonstrations.dataset_part import (
    CHUNK_SIZE,
    DatasetPart,
    all_texts,
    read_episodes,
)
from roboirg.apps.demonstrations.export_format import ExportFormat
from roboirg.apps.demonstrations.export_plan import ExportPlan
from roboirg.apps.demonstrations.formats.lerobot import (
    StatsCollector,
    common_info,
    frame_columns,
    make_parts,
    own_columns,
    write_json,
    write_videos,
)
from roboirg.apps.demonstrations.formats.lerobot_tables import INFO, read_tables
from roboirg.apps.demonstrations.frame_columns import FrameColumns
from roboirg.apps.demonstrations.parquet_tables import write_frames
from roboirg.apps.demonstrations.trajectory import load_trajectory
from roboirg.util.atomic_write import write_atomically

_DATA = "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet"
_VIDEO = "videos/chunk-{episode_chunk:03d}/{video_key}/episode_{episode_index:06d}.mp4"
_ARM_JOINTS = 7
_OPENPI = """\
openpi reads this dataset with the LeRobot that it pins. Save the following as
`roboirg_config.py` next to openpi's `scripts/`, and start training through it:

```python
import dataclasses
import pathlib
import runpy
import sys

import openpi.models.pi0_config as pi0_config
import openpi.policies.libero_policy as libero_policy
import openpi.training.config as configs
import openpi.training.optimizer as optimizer
import openpi.training.weight_loaders as weight_loaders
import openpi.transforms as transforms


@dataclasses.dataclass(frozen=True)
class RoboIRGData(configs.DataConfigFactory):
    def create(self, assets_dirs: pathlib.Path, model_config):
        repack = transforms.Group(inputs=[transforms.RepackTransform({{
            "observation/image": "{front}", "observation/wrist_image": "{wrist}",
            "observation/state": "{state}", "actions": "{action}", "prompt": "prompt"}})])
        data = transforms.Group(
            inputs=[libero_policy.LiberoInputs(model_type=model_config.model_type)],
            outputs=[FirstEight()])
        mask = transforms.make_bool_mask(7, -1)
        data = data.push(inputs=[transforms.DeltaActions(mask)],
                         outputs=[transforms.AbsoluteActions(mask)])
        return dataclasses.replace(
            self.create_base_config(assets_dirs, model_config), repack_transforms=repack,
            data_transforms=data,
            model_transforms=configs.ModelTransformFactory()(model_config),
            action_sequence_keys=("{action}",))


@dataclasses.dataclass(frozen=True)
class FirstEight(transforms.DataTransformFn):
    def __call__(self, data):
        return {{"actions": data["actions"][..., :8]}}


configs._CONFIGS_DICT["pi05_roboirg"] = configs.TrainConfig(
    name="pi05_roboirg",
    model=pi0_config.Pi0Config(pi05=True, action_horizon=20, max_token_len=160),
    data=RoboIRGData(repo_id="roboirg", base_config=configs.DataConfig(prompt_from_task=True)),
    weight_loader=weight_loaders.CheckpointWeightLoader(
        "gs://openpi-assets/checkpoints/pi05_base/params"),
    num_train_steps=80000, batch_size=64,
    lr_schedule=optimizer.CosineDecaySchedule(
        warmup_steps=10000, peak_lr=5e-05, decay_steps=80000,
        decay_lr=5e-05))
runpy.run_path(sys.argv.pop(1), run_name="__main__")
```

```sh
export HF_LEROBOT_HOME={parent}   # the folder above this one, which must be named `roboirg`
python roboirg_config.py scripts/compute_norm_stats.py --config-name pi05_roboirg
python roboirg_config.py scripts/train.py pi05_roboirg --exp-name first
```

The configuration follows the shape of openpi's own; it has not been run here, because openpi needs
a GPU and packages from git. """
_GROOT = """\
GR00T reads `meta/modality.json`; it needs videos, so export with `--pictures lossless-video` or
`lossy-video`.
"""


def write_part(part: DatasetPart) -> None:
    """Write the episodes of one trajectory in LeRobot's format 2.1, each as a Parquet file.

    An episode is the trajectory with one of its instructions; each gets a copy of frames and
    videos. Makes only files of this part, so parts can be written by several processes.
    """
    (episode,) = part.episodes
    columns = part.columns
    trajectory = load_trajectory(episode.path)
    shared = frame_columns(columns, trajectory)
    for placed in episode.instructions:
        index = placed.episode_index
        place = {"episode_chunk": index // CHUNK_SIZE, "episode_index": index}
        if columns.has_videos:
            write_videos(part, partial(_VIDEO.format, **place))
        own = own_columns(placed, trajectory.facts.frames)
        path = part.root / _DATA.format(**place)
        write_frames(path, columns.table_features(), shared, [own], is_described=True)


def finish(root: Path, parts: Sequence[DatasetPart]) -> None:
    """Write the metadata of a complete dataset: episodes, texts, statistics, and ``info.json``.

    The latter comes last, because nothing reads the dataset without it. Episodes are added in the
    order of their numbers.
    """
    columns = parts[0].columns
    collector = StatsCollector(columns)
    episodes = []
    stats = []
    for _, episode, trajectory in read_episodes(parts):
        for placed in episode.instructions:
            index = placed.episode_index
            tasks = [placed.instruction.text]
            length = trajectory.facts.frames
            episodes.append({"episode_index": index, "tasks": tasks, "length": length})
            stats.append({"episode_index": index, "stats": collector.add(trajectory, placed)})
    texts = all_texts(parts)
    task_lines = [{"task_index": index, "task": text} for index, text in enumerate(texts)]
    _write_lines(root / "meta/episodes.jsonl", episodes)
    _write_lines(root / "meta/episodes_stats.jsonl", stats)
    _write_lines(root / "meta/tasks.jsonl", task_lines)
    write_json(root / "meta/stats.json", collector.result())
    write_json(root / "meta/modality.json", modality(columns))
    write_json(root / INFO, _info(parts, texts))


def _info(parts: Sequence[DatasetPart], texts: Sequence[str]) -> dict[str, Any]:
    """Return the content of ``info.json``: counts, columns, and where files are.

    Args:
        parts: of the dataset, in the order of its frames.
        texts: the distinct instructions.
    """
    columns = parts[0].columns
    info = common_info(parts, texts)
    episodes = info["total_episodes"]
    return {
        **info,
        "codebase_version": "v2.1",
        "total_videos": episodes * len(columns.cameras) if columns.has_videos else 0,
        "total_chunks": (episodes - 1) // CHUNK_SIZE + 1,
        "data_path": _DATA,
        "video_path": _VIDEO if columns.has_videos else None,
    }


def modality(columns: FrameColumns) -> dict[str, Any]:
    """Return the content of ``modality.json``, with which GR00T finds arm and gripper in columns.

    For example, numbers 0 to 6 of the state are the arm, the last one is the gripper.
    """
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


def training_text(plan: ExportPlan, root: Path) -> str:
    """Return how to train openpi, if it can read a dataset, and GR00T, as Markdown."""
    if not plan.is_for_openpi:
        return _GROOT
    return _OPENPI.format(parent=root.parent, **FrameColumns(plan).keys) + _GROOT


FORMAT = ExportFormat(
    name="lerobot-v2.1",
    is_for_openpi=True,
    make_parts=make_parts,
    write_part=write_part,
    finish=finish,
    training_text=training_text,
    read=read_tables,
)
