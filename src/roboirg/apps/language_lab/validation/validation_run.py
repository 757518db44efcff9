"""Validate many episodes, in batches and in processes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from roboirg.apps.language_lab.validation.episode_checks import check_episode
from roboirg.apps.language_lab.validation.validation_results import ValidationResults
from roboirg.core.episode import SPLITS, Split
from roboirg.core.errors import InvalidValueError
from roboirg.language.wordings.wording_store import open_wordings
from roboirg.tasks.splits.splits import SIZES, get_episode

BATCH = 50
"""Maximum size of a batch, in episodes."""


class Batch(NamedTuple):
    """Consecutive episodes.

    Attributes:
        task: name of the task.
        split: name of the split.
        first: index of the first episode.
        size: number of episodes.
        wordings_file: its path, or the name of a pool; None for the words of the split.
    """

    task: str
    split: Split
    first: int
    size: int
    wordings_file: str | None = None


def batches(
    tasks: Sequence[str], splits: Sequence[Split], seeds: int, wordings_file: str | None = None
) -> tuple[Batch, ...]:
    """Return batches of all episodes of the splits and of random ones.

    Args:
        tasks: names.
        splits: names.
        seeds: number of random episodes for each task.
        wordings_file: its path, or the name of a pool; None for the words of the split.

    Raises:
        InvalidValueError: the number is negative, or there is nothing to validate.
    """
    if seeds < 0:
        raise InvalidValueError(f"The number of random seeds is {seeds}; it must be at least 0.")
    amounts = [(split, SIZES[split]) for split in splits]
    amounts.append(("random", seeds))
    found = tuple(
        Batch(task, split, first, min(BATCH, amount - first), wordings_file)
        for task in tasks
        for split, amount in amounts
        for first in range(0, amount, BATCH)
    )
    if not found:
        raise InvalidValueError("There is nothing to validate: no split and no random seed.")
    return found


def validate_batch(batch: Batch) -> ValidationResults:
    """Check the episodes of a batch."""
    results = ValidationResults()
    identity = open_wordings(batch.wordings_file)
    for index in range(batch.first, batch.first + batch.size):
        episode = get_episode(batch.task, batch.split, index)
        expected = batch.split in SPLITS
        results.add(check_episode(episode, must_be_expressible=expected, wordings=identity))
    return results
