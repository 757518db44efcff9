"""Validate many episodes, in batches and in processes."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from roboirg.core.episode import Episode, Split
from roboirg.core.errors import InvalidValueError, SceneRejectedError
from roboirg.episodes.splits import SEED_STRIDE, SIZES, get_episode, make_episode, slot_difficulty
from roboirg.language.validation.episode_checks import check_episode
from roboirg.language.validation.validation_results import ValidationResults
from roboirg.language.wordings.wording_store import open_wordings
from roboirg.util.parallel_map import parallel_map

RANDOM_BASE = 10_000_000
"""The first random seed; the seeds of the splits are smaller."""
BATCH = 50
"""Maximum size of a batch, in episodes."""


class Batch(NamedTuple):
    """Consecutive episodes.

    Attributes:
        task: name of the task.
        split: name of the split; None for random episodes.
        first: index of the first episode.
        size: number of episodes.
        wordings: path of a wording file; None for our own words.
    """

    task: str
    split: Split | None
    first: int
    size: int
    wordings: str | None = None


def batches(
    tasks: Sequence[str], splits: Sequence[Split], seeds: int, wordings: str | None = None
) -> tuple[Batch, ...]:
    """Return batches of all episodes of the splits and of random ones.

    Args:
        tasks: names.
        splits: names.
        seeds: number of random episodes for each task.
        wordings: path of a wording file; None for our own words.

    Raises:
        InvalidValueError: the number is negative, or there is nothing to validate.
    """
    if seeds < 0:
        raise InvalidValueError(f"The number of random seeds is {seeds}; it must be at least 0.")
    amounts: list[tuple[Split | None, int]] = [(split, SIZES[split]) for split in splits]
    amounts.append((None, seeds))
    found = tuple(
        Batch(task, split, first, min(BATCH, amount - first), wordings)
        for task in tasks
        for split, amount in amounts
        for first in range(0, amount, BATCH)
    )
    if not found:
        raise InvalidValueError("There is nothing to validate: no split and no random seed.")
    return found


def random_episode(task: str, index: int) -> Episode:
    """Return an episode of no split; difficulties alternate as in the splits.

    Raises:
        SceneRejectedError: none of the seeds for this index gives a scene.
    """
    first = RANDOM_BASE + SEED_STRIDE * index
    for seed in range(first, first + SEED_STRIDE):
        with contextlib.suppress(SceneRejectedError):
            return make_episode(task, seed, slot_difficulty(index), "test", index)
    raise SceneRejectedError(f"No seed from {first} on gives a scene of {task}.")


def validate_batch(batch: Batch) -> ValidationResults:
    """Check the episodes of a batch."""
    results = ValidationResults()
    identity = open_wordings(batch.wordings)
    for index in range(batch.first, batch.first + batch.size):
        if batch.split is None:
            results.add(check_episode(random_episode(batch.task, index), wordings=identity))
        else:
            episode = get_episode(batch.task, batch.split, index)
            results.add(check_episode(episode, must_be_expressible=True, wordings=identity))
    return results


def validate(work: Sequence[Batch], workers: int) -> Iterator[tuple[Batch, ValidationResults]]:
    """Yield every batch with its results, in the order of completion.

    Args:
        work: the batches.
        workers: number of processes; 0 for this one.

    Raises:
        InvalidValueError: the number of workers is negative.
        RoboIRGError: a process died.
    """
    return parallel_map(validate_batch, work, workers)
