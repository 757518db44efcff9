"""Train, validation and test episodes: which seeds, which difficulty.

An episode's seed is ``base + 100 * index + rejected``, where the base depends on split and task
and `rejected` counts the seeds that were passed over because they give no valid scene.
Difficulties repeat easy, easy, medium, hard (RoboMME's cycle).
"""

from __future__ import annotations

import functools
from collections.abc import Mapping

import numpy as np

from roboirg.episode import SPLITS, Difficulty, Episode, Split
from roboirg.errors import InvalidValueError, SceneRejectedError, UnknownNameError
from roboirg.tasks import Task, get_task

SIZES: Mapping[Split, int] = {"train": 100, "val": 50, "test": 50}
CYCLE: tuple[Difficulty, ...] = ("easy", "easy", "medium", "hard")
SEED_STRIDE = 100
MAX_REJECTED = 30


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


@functools.lru_cache(maxsize=4096, typed=True)
def get_episode(task_name: str, split: str, index: int) -> Episode:
    """Episode number `index` (from 0) of a split of a task.

    Raises:
        UnknownNameError: there is no such task or split.
        InvalidValueError: the split has no episode of that number.
    """
    task, split_name = get_task(task_name), check_split(split)
    size = SIZES[split_name]
    if isinstance(index, bool) or not isinstance(index, int) or not 0 <= index < size:
        raise InvalidValueError(
            f"There is no episode {index!r}: split {split!r} has episodes 0 to {size - 1}."
        )
    difficulty = CYCLE[index % len(CYCLE)]
    first = base_seed(task, split_name) + SEED_STRIDE * index
    for seed in range(first, first + MAX_REJECTED):
        try:
            return make_episode(task_name, seed, difficulty, split_name, index)
        except SceneRejectedError:
            continue
    raise SceneRejectedError(f"{MAX_REJECTED} seeds from {first} gave no scene of {task_name}")
