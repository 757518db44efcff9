"""Train, validation and test episodes: which seeds, which difficulty.

An episode's seed is ``base + 100 * index + rejected``, where the base depends on split and task
and `rejected` counts the seeds that were passed over: those that give no valid scene, those with a
setting that cannot be expressed, and those that the oracle does not solve. The counts are shipped
in ``rejected_seeds.json``; ``roboirg build-splits`` finds them anew. Difficulties repeat easy,
easy, medium, hard (RoboMME's cycle).
"""

from __future__ import annotations

import contextlib
import functools
import json
import operator
from collections.abc import Mapping
from importlib import resources
from typing import SupportsIndex

import numpy as np

from roboirg.episode import SPLITS, Difficulty, Episode, Split, episode_key
from roboirg.errors import InvalidValueError, UnknownNameError
from roboirg.tasks import Task, get_task

SIZES: Mapping[Split, int] = {"train": 100, "val": 50, "test": 50}
CYCLE: tuple[Difficulty, ...] = ("easy", "easy", "medium", "hard")
SEED_STRIDE = 100
MAX_REJECTED = 30
"""Seeds that are tried for an episode."""
REJECTIONS_FILE = "rejected_seeds.json"


def base_seed(task: Task, split: Split) -> int:
    """Seed of the first slot of a split."""
    if split == "train":
        return 1000 * task.code
    return (1_000_000 if split == "val" else 500_000) + 10_000 * task.code


def check_split(split: str) -> Split:
    """The name as a split.

    Raises:
        UnknownNameError: there is no such split.
    """
    for known in SPLITS:
        if split == known:
            return known
    raise UnknownNameError("split", split, SPLITS)


def make_episode(
    task_name: str, seed: int, difficulty: Difficulty, split: Split = "test", index: int = 0
) -> Episode:
    """The episode that a seed gives, whether or not it belongs to a split.

    Raises:
        UnknownNameError: there is no such task.
        SceneRejectedError: the seed yields no valid scene.
    """
    task = get_task(task_name)
    scene, goal = task.sample(np.random.default_rng(seed), difficulty)
    return Episode(
        task=task.name,
        split=split,
        index=index,
        seed=seed,
        difficulty=difficulty,
        scene=scene,
        goal=goal,
        stages=task.stages(scene, goal),
        demonstration=task.demonstration(scene),
        motions=task.motions(scene),
    )


def slot_seed(task: Task, split: Split, index: int) -> int:
    """The first seed that is tried for an episode."""
    return base_seed(task, split) + SEED_STRIDE * index


@functools.cache
def rejections() -> Mapping[str, int]:
    """How many seeds were passed over, by episode key; episodes with none are left out."""
    text = resources.files("roboirg").joinpath(REJECTIONS_FILE).read_text(encoding="utf-8")
    counts: Mapping[str, int] = json.loads(text)
    return counts


def get_episode(task_name: str, split: str, index: SupportsIndex) -> Episode:
    """Episode number `index` (from 0) of a split of a task.

    Raises:
        UnknownNameError: there is no such task or split.
        InvalidValueError: the split has no episode of that number.
    """
    task, split_name = get_task(task_name), check_split(split)
    return _episode(task.name, split_name, _check_index(split_name, index))


def _check_index(split: Split, index: SupportsIndex) -> int:
    size = SIZES[split]
    number = -1
    if not isinstance(index, bool):
        with contextlib.suppress(TypeError):
            number = operator.index(index)
    if not 0 <= number < size:
        raise InvalidValueError(
            f"There is no episode {index!r}: split {split!r} has episodes 0 to {size - 1}."
        )
    return number


@functools.lru_cache(maxsize=4096)
def _episode(task: str, split: Split, index: int) -> Episode:
    seed = slot_seed(get_task(task), split, index)
    seed += rejections().get(episode_key(task, split, index), 0)
    return make_episode(task, seed, CYCLE[index % len(CYCLE)], split, index)
