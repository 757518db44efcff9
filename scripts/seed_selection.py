"""Select the seeds of the splits: scene, language and oracle must all accept a seed."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

from roboirg.core.episode import SPLITS, Difficulty, Episode, Split, episode_key
from roboirg.core.errors import MotionPlanningError, SceneRejectedError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.envs.factory import make
from roboirg.language.generator import request_of
from roboirg.language.settings import ACCEPTANCE_SETTINGS, all_settings, settings_of
from roboirg.policies import Policy, make_policy, play
from roboirg.tasks import every_task, get_task
from roboirg.tasks.splits.fingerprint import fingerprint
from roboirg.tasks.splits.published_episodes import published_episode
from roboirg.tasks.splits.splits import (
    MAX_REJECTED,
    SIZES,
    TaskSplits,
    fixed_episode,
    make_episode,
    slot_difficulty,
    slot_key,
    slot_seed,
)
from roboirg.util.parallel_map import parallel_map

Reason = Literal["no room", "not expressible", "oracle failed"]


class Rejection(NamedTuple):
    """Why a seed is rejected.

    Attributes:
        seed: the seed.
        reason: kind of reason.
        cause: details: the object without a place, the settings with their reasons, or the
            oracle's failure.
    """

    seed: int
    reason: Reason
    cause: str


@dataclass(frozen=True, slots=True)
class EpisodeSlot:
    """An episode that is sampled and needs a seed."""

    task: str
    split: Split
    index: int

    @property
    def difficulty(self) -> Difficulty:
        """Difficulty of the scene."""
        return slot_difficulty(self.index)

    @property
    def key(self) -> str:
        """Short unique name of the episode."""
        return episode_key(self.task, self.split, self.index)


class SelectedSeed(NamedTuple):
    """A slot and the seeds rejected for it, in order."""

    slot: EpisodeSlot
    rejections: tuple[Rejection, ...]


SeedCheck = Callable[[EpisodeSlot, int], Rejection | None]
"""Returns why a seed is rejected for a slot; None if it is accepted."""


def episode_slots(tasks: Sequence[str]) -> tuple[EpisodeSlot, ...]:
    """Return a slot for every sampled episode of the tasks' splits, in order."""
    slots = []
    for task, split in itertools.product(tasks, SPLITS):
        for index in range(SIZES[split]):
            if published_episode(task, split, index) is None:
                slots.append(EpisodeSlot(task, split, index))
    return tuple(slots)


def check_words(slot: EpisodeSlot, seed: int) -> Rejection | None:
    """Return why the scene or the language rejects a seed; needs no simulator."""
    try:
        episode = _episode(slot, seed)
    except SceneRejectedError as error:
        return Rejection(seed, "no room", str(error))
    causes: list[str] = []
    for name in ACCEPTANCE_SETTINGS:
        if name in settings_of(get_task(slot.task)):
            request = request_of(episode, InstructionOptions(name))
            # The setting's own reason: which words are written must not change the splits.
            reason = all_settings()[name].refusal(request)
            if reason is not None:
                causes.append(f"{name}: {reason}")
    if causes:
        return Rejection(seed, "not expressible", "; ".join(causes))
    return None


def check_seed(slot: EpisodeSlot, seed: int) -> Rejection | None:
    """Return why the scene, the language or the oracle rejects a seed."""
    rejection = check_words(slot, seed)
    if rejection is not None:
        return rejection
    failure = oracle_failure(_episode(slot, seed), make_policy("oracle", 0))
    if failure is not None:
        return Rejection(seed, "oracle failed", failure)
    return None


def oracle_failure(episode: Episode, oracle: Policy) -> str | None:
    """Return why the oracle fails in an episode, played without pictures; None if it succeeds."""
    try:
        info = play(make(episode, cameras=()), oracle)
    except MotionPlanningError as error:
        return str(error)
    if info["status"] == "success":
        return None
    return str(info["cause"] or info["status"])


def find_seed(slot: EpisodeSlot, check: SeedCheck = check_seed) -> SelectedSeed:
    """Find the first seed of a slot that is accepted.

    Raises:
        SceneRejectedError: there is none; the message names the episode.
    """
    first = slot_seed(get_task(slot.task), slot.split, slot.index)
    rejections: list[Rejection] = []
    for seed in range(first, first + MAX_REJECTED + 1):
        rejection = check(slot, seed)
        if rejection is None:
            return SelectedSeed(slot, tuple(rejections))
        rejections.append(rejection)
    raise SceneRejectedError(
        f"No seed from {first} to {first + MAX_REJECTED} is accepted for episode {slot.key}; "
        f"the last rejection: {rejections[-1].reason} ({rejections[-1].cause})."
    )


def find_seeds(slots: Sequence[EpisodeSlot], workers: int) -> Iterator[SelectedSeed]:
    """Find a seed for every slot; yields the results as they finish.

    Args:
        slots: the episodes.
        workers: number of processes; 0 works in this process.

    Raises:
        InvalidValueError: a negative number of workers.
        SceneRejectedError: an episode has no seed.
        RoboIRGError: a process died.
    """
    for _, selected in parallel_map(find_seed, slots, workers):
        yield selected


def merge_splits(
    tasks: Sequence[str], found: Sequence[SelectedSeed], known: Mapping[str, TaskSplits]
) -> dict[str, TaskSplits]:
    """Return the splits to ship, with new ones of the named tasks.

    Args:
        tasks: names of the tasks whose splits are built.
        found: the seeds selected for all of their sampled episodes.
        known: the splits shipped before.
    """
    rejected = {selected.slot: len(selected.rejections) for selected in found}
    splits = dict(known)
    for task in tasks:
        passed_over = {}
        for slot in episode_slots([task]):
            if rejected[slot]:
                passed_over[slot_key(slot.split, slot.index)] = rejected[slot]
        sha256 = fingerprint(_fixed_episodes(task, passed_over))
        splits[task] = TaskSplits(sha256, passed_over)
    return {task: splits[task] for task in every_task() if task in splits}


def _fixed_episodes(task: str, passed_over: Mapping[str, int]) -> Iterator[Episode]:
    """Yield the episodes of train, val and test, in this order, as `fixed_episode` returns them."""
    for split in SPLITS:
        for index in range(SIZES[split]):
            yield fixed_episode(get_task(task), split, index, passed_over)


def splits_text(splits: Mapping[str, TaskSplits]) -> str:
    """Return the text of ``splits.json``, which `shipped_splits` reads: a line for each task."""
    lines: list[str] = []
    for task, entry in splits.items():
        numbers = json.dumps(entry._asdict())
        lines.append(f"{json.dumps(task)}: {numbers}")
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _episode(slot: EpisodeSlot, seed: int) -> Episode:
    return make_episode(slot.task, seed, slot.difficulty, slot.split, slot.index)
