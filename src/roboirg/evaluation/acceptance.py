"""Which seeds enter a split: scene, words and oracle have to agree."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import roboirg
from roboirg.episode import SPLITS, Episode, Split
from roboirg.errors import MotionPlanningError, SceneRejectedError
from roboirg.language import expressible
from roboirg.policies import make_policy, play
from roboirg.splits import CYCLE, MAX_REJECTED, SIZES, make_episode, slot_seed
from roboirg.tasks import get_task


def find_rejections(
    tasks: Sequence[str], splits: Sequence[Split] = SPLITS
) -> Iterator[tuple[str, int]]:
    """For every episode its key and how many seeds had to be passed over for it.

    Raises:
        SceneRejectedError: thirty seeds in a row were refused.
    """
    for name in tasks:
        for split in splits:
            for index in range(SIZES[split]):
                yield _first_accepted(name, split, index)


def _first_accepted(task: str, split: Split, index: int) -> tuple[str, int]:
    first = slot_seed(get_task(task), split, index)
    for rejected in range(MAX_REJECTED):
        episode = sampled(task, first + rejected, split, index)
        if episode is not None and is_acceptable(episode):
            return episode.key, rejected
    raise SceneRejectedError(f"{MAX_REJECTED} seeds from {first} gave no episode of {task}")


def sampled(task: str, seed: int, split: Split, index: int) -> Episode | None:
    """The episode of a seed, or None if the seed yields no scene."""
    try:
        return make_episode(task, seed, CYCLE[index % len(CYCLE)], split, index)
    except SceneRejectedError:
        return None


def is_acceptable(episode: Episode) -> bool:
    """Whether every setting of the task can be expressed and the oracle solves the episode."""
    return expressible(episode) == get_task(episode.task).settings and is_solved(episode)


def is_solved(episode: Episode) -> bool:
    """Whether the oracle succeeds, played without pictures."""
    env = roboirg.make(episode, cameras=())
    try:
        info = play(env, make_policy("oracle", 0))
    except MotionPlanningError:
        return False
    return bool(info["status"] == "success")
