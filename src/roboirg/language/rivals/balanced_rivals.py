"""The rival of a value, so that of two values each is the meant one in half of a split's episodes.

RoboMME's goals are given and uneven; the rivals are ours. Two episodes of a split with different
values, each possible in the other, are partners: the value of one is the rival in the other.
"""

from __future__ import annotations

import functools
from collections import Counter
from collections.abc import Mapping
from typing import NamedTuple

from roboirg.core.episode import SPLITS, Difficulty, Split
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language.request import InstructionRequest
from roboirg.language.rivals.value_pair import ValuePair, rival_pairs
from roboirg.language.template_sampler import sampler_of
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import split_episodes

REFERENCE_SPLIT: Split = "train"
"""Its partners show how often each rival goes with a value, for episodes outside the splits."""


class SplitEntry(NamedTuple):
    """An episode that can have a rival.

    Attributes:
        seed: of the episode.
        difficulty: of the episode.
        meant: the slot and its value.
        rivals: the slot and each value that it may have instead.
    """

    seed: int
    difficulty: Difficulty
    meant: tuple[str, str | int]
    rivals: frozenset[tuple[str, str | int]]


def balanced_rival(request: InstructionRequest, pairs: list[ValuePair]) -> ValuePair:
    """Return one of the pairs of a value: that of the partner, or of a likely one."""
    episode, slot, meant = request.episode, pairs[0].slot, pairs[0].meant.value
    by_value = {pair.rival.value: pair for pair in pairs}
    split = episode.split if episode.split in SPLITS else REFERENCE_SPLIT
    entries, partners = _partners(request.task.name, split, request.options.language)
    entry = entries.get(episode.index)
    if episode.split == split and entry is not None and entry.seed == episode.seed:
        likely = [partners[episode.index]] if episode.index in partners else []
    else:
        likely = [
            value
            for index, value in partners.items()
            if entries[index].difficulty == episode.difficulty
            and entries[index].meant == (slot, meant)
        ]
    likely = [value for value in likely if value in by_value] or list(by_value)
    return by_value[request.sampler.pick("rival", likely)]


@functools.cache
def _partners(
    task: str, split: Split, language: int
) -> tuple[Mapping[int, SplitEntry], Mapping[int, str | int]]:
    """Return the episodes of a split that can have a rival, and the rivals of those with partners.

    Partners are found among the values that are left most often, so that few are left over.
    """
    entries: dict[int, SplitEntry] = {}
    for episode in split_episodes([task], [split]):
        sampler = sampler_of(episode, language=language)
        request = InstructionRequest(episode, get_task(task), InstructionOptions(), sampler)
        pairs = rival_pairs(request)
        if pairs:
            (slot, meant), rivals = (pairs[0].slot, pairs[0].meant.value), pairs
            values = frozenset((slot, pair.rival.value) for pair in rivals)
            entries[episode.index] = SplitEntry(
                episode.seed, episode.difficulty, (slot, meant), values
            )
    partners: dict[int, str | int] = {}
    left = dict(entries)
    while left:
        often = Counter(entry.meant for entry in left.values())
        index, one = max(left.items(), key=lambda item: (often[item[1].meant], -item[0]))
        del left[index]
        possible = [
            other
            for other, entry in left.items()
            if entry.meant in one.rivals and one.meant in entry.rivals
        ]
        if possible:
            other = max(possible, key=lambda at: (often[left[at].meant], -at))
            partners |= {index: left[other].meant[1], other: one.meant[1]}
            del left[other]
    return entries, partners
