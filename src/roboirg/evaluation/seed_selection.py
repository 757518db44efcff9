"""Which seeds enter a split: scene, words and oracle have to agree."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import roboirg
from roboirg.core.episode import SPLITS, Difficulty, Episode, Split, episode_key
from roboirg.core.errors import (
    InvalidValueError,
    MotionPlanningError,
    SceneRejectedError,
)
from roboirg.episodes.splits import (
    MAX_REJECTED,
    SIZES,
    TaskSplits,
    fingerprint_of,
    make_episode,
    slot_difficulty,
    slot_key,
    slot_seed,
)
from roboirg.language import expressible, settings_of
from roboirg.policies import make_policy, play
from roboirg.tasks import every_task, get_task
from roboirg.util.parallel_map import parallel_map

Reason = Literal["no room", "not expressible", "oracle failed"]
REASONS: tuple[Reason, ...] = ("no room", "not expressible", "oracle failed")


class Rejection(NamedTuple):
    """Why a seed is passed over.

    Attributes:
        seed: the seed.
        reason: what kind of thing is amiss.
        cause: what exactly: the object without a place, the settings, the oracle's failure.
    """

    seed: int
    reason: Reason
    cause: str


@dataclass(frozen=True, slots=True)
class EpisodeSlot:
    """An episode whose seed is looked for."""

    task: str
    split: Split
    index: int

    @property
    def difficulty(self) -> Difficulty:
        """Of its scene."""
        return slot_difficulty(self.index)

    @property
    def key(self) -> str:
        """The short unique name of the episode."""
        return episode_key(self.task, self.split, self.index)


class SelectedSeed(NamedTuple):
    """A slot and the seeds that had to be passed over for it, in order."""

    slot: EpisodeSlot
    rejections: tuple[Rejection, ...]


SeedCheck = Callable[[EpisodeSlot, int], Rejection | None]
"""Says why a seed cannot be taken for a slot; None if it can."""


def episode_slots(
    tasks: Sequence[str], splits: Sequence[Split] = SPLITS
) -> tuple[EpisodeSlot, ...]:
    """Every episode of the splits of the tasks, in order."""
    return tuple(
        EpisodeSlot(task, split, index)
        for task in tasks
        for split in splits
        for index in range(SIZES[split])
    )


def check_words(slot: EpisodeSlot, seed: int) -> Rejection | None:
    """Why scene or words rule a seed out; needs no simulator."""
    try:
        episode = _episode(slot, seed)
    except SceneRejectedError as error:
        return Rejection(seed, "no room", str(error))
    sayable = expressible(episode)
    unsaid = [name for name in settings_of(get_task(slot.task)) if name not in sayable]
    return Rejection(seed, "not expressible", ", ".join(unsaid)) if unsaid else None


def check_seed(slot: EpisodeSlot, seed: int) -> Rejection | None:
    """Why scene, words or oracle rule a seed out; the oracle plays without pictures."""
    rejection = check_words(slot, seed)
    if rejection is None:
        failure = oracle_failure(_episode(slot, seed))
        rejection = None if failure is None else Rejection(seed, "oracle failed", failure)
    return rejection


def oracle_failure(episode: Episode) -> str | None:
    """Why the oracle does not solve an episode, played without pictures; None if it does."""
    env = roboirg.make(episode, cameras=())
    try:
        info = play(env, make_policy("oracle", 0))
    except MotionPlanningError as error:
        return str(error)
    return None if info["status"] == "success" else str(info["cause"] or info["status"])


def find_seed(slot: EpisodeSlot, judge: SeedCheck = check_seed) -> SelectedSeed:
    """The first seed of a slot that can be taken.

    Raises:
        SceneRejectedError: there is none; names the episode.
    """
    first = slot_seed(get_task(slot.task), slot.split, slot.index)
    rejections: list[Rejection] = []
    for seed in range(first, first + MAX_REJECTED + 1):
        rejection = judge(slot, seed)
        if rejection is None:
            return SelectedSeed(slot, tuple(rejections))
        rejections.append(rejection)
    raise SceneRejectedError(
        f"No seed from {first} to {first + MAX_REJECTED} gives episode {slot.key}; "
        f"the last one: {rejections[-1].reason} ({rejections[-1].cause})."
    )


def find_seeds(
    slots: Sequence[EpisodeSlot], workers: int, judge: SeedCheck = check_seed
) -> Iterator[SelectedSeed]:
    """`find_seed` for every slot, as they end, in so many processes; 0 for this one.

    Raises:
        InvalidValueError: a negative number of workers.
        SceneRejectedError: an episode has no seed.
        RoboIRGError: a process died.
    """
    found = parallel_map(functools.partial(find_seed, judge=judge), slots, workers)
    yield from (outcome for _, outcome in found)


def check_kept_splits(
    tasks: Sequence[str], splits: Sequence[Split], known: Mapping[str, TaskSplits]
) -> None:
    """See that the splits that are not built again can be kept.

    Raises:
        InvalidValueError: they were never built, or their scenes have changed since.
    """
    kept = [split for split in SPLITS if split not in splits]
    for slot in episode_slots(tasks, kept):
        entry = known.get(slot.task)
        passed_over = entry.passed_over.get(slot_key(slot.split, slot.index), 0) if entry else 0
        first = slot_seed(get_task(slot.task), slot.split, slot.index)
        if entry is None or check_words(slot, first + passed_over) is not None:
            raise InvalidValueError(
                f"There is no valid episode {slot.key} to keep; build all splits of {slot.task}."
            )


def merge_splits(
    found: Sequence[SelectedSeed], known: Mapping[str, TaskSplits]
) -> dict[str, TaskSplits]:
    """What is to be shipped: what was found, and what is known about everything else."""
    splits = {task: known[task] for task in every_task() if task in known}
    for task in dict.fromkeys(one.slot.task for one in found):
        old = known[task].passed_over if task in known else {}
        new = {one.slot: len(one.rejections) for one in found}
        counts: dict[str, int] = {}
        for slot in episode_slots([task]):
            key = slot_key(slot.split, slot.index)
            counts[key] = new.get(slot, old.get(key, 0))
        passed_over = {key: count for key, count in counts.items() if count}
        splits[task] = TaskSplits(fingerprint_of(task, passed_over), passed_over)
    return {task: splits[task] for task in every_task() if task in splits}


def _episode(slot: EpisodeSlot, seed: int) -> Episode:
    return make_episode(slot.task, seed, slot.difficulty, slot.split, slot.index)
