"""The proof over many episodes, in batches and in processes."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from roboirg.core.episode import Episode, Split
from roboirg.core.errors import InvalidValueError, SceneRejectedError
from roboirg.episodes.splits import SEED_STRIDE, SIZES, get_episode, make_episode, slot_difficulty
from roboirg.language.validation.episode_checks import check_episode
from roboirg.language.validation.evidence import ValidationResults
from roboirg.util.parallel_map import parallel_map

RANDOM_BASE = 10_000_000
"""First random seed; those of the splits are smaller."""
BATCH = 50
"""Episodes that a process examines in one go."""


class Batch(NamedTuple):
    """Episodes in a row.

    Attributes:
        task: name of the task.
        split: theirs; None for random ones.
        first: index of the first.
        size: how many.
    """

    task: str
    split: Split | None
    first: int
    size: int


def batches(tasks: Sequence[str], splits: Sequence[Split], seeds: int) -> tuple[Batch, ...]:
    """All episodes of the splits and so many random ones for each task.

    Raises:
        InvalidValueError: a negative number of random ones, or nothing at all to examine.
    """
    if seeds < 0:
        raise InvalidValueError(f"The number of random seeds is {seeds}; it must be at least 0.")
    amounts: list[tuple[Split | None, int]] = [(split, SIZES[split]) for split in splits]
    amounts.append((None, seeds))
    found = tuple(
        Batch(task, split, first, min(BATCH, amount - first))
        for task in tasks
        for split, amount in amounts
        for first in range(0, amount, BATCH)
    )
    if not found:
        raise InvalidValueError("There is nothing to examine: neither a split nor a random seed.")
    return found


def random_episode(task: str, index: int) -> Episode:
    """An episode that no split has; difficulties take turns as in the splits.

    Raises:
        SceneRejectedError: no seed of that number gives a scene.
    """
    first = RANDOM_BASE + SEED_STRIDE * index
    for seed in range(first, first + SEED_STRIDE):
        with contextlib.suppress(SceneRejectedError):
            return make_episode(task, seed, slot_difficulty(index), "test", index)
    raise SceneRejectedError(f"No seed from {first} on gives a scene of {task}.")


def validate_batch(batch: Batch) -> ValidationResults:
    """What the episodes of a batch prove."""
    found = ValidationResults()
    for index in range(batch.first, batch.first + batch.size):
        if batch.split is None:
            found.add(check_episode(random_episode(batch.task, index)))
        else:
            episode = get_episode(batch.task, batch.split, index)
            found.add(check_episode(episode, must_be_expressible=True))
    return found


def validate(work: Sequence[Batch], workers: int) -> Iterator[tuple[Batch, ValidationResults]]:
    """Every batch with what it proves, as they end, in so many processes; 0 for this one.

    Raises:
        InvalidValueError: a negative number of workers.
        RoboIRGError: a process died.
    """
    return parallel_map(validate_batch, work, workers)
