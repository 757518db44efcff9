"""Rivals: a second value of the same kind as one that is meant, on equal terms.

RoboMME's goals are given and uneven; the rivals are ours. Two episodes of a split with different
values, each possible in the other, are partners: the value of one is the rival in the other. So of
two values each is the meant one in half of a split's episodes.

- *meant*: the value that the goal has. *rival*: another one that the goal could have there.
- *pair*: a meant value with a rival. `possible_pairs` finds all, `pairs_of_drawn_slot` those of one
  slot, and `balanced_rival` the one that is said.
- *entry*: an episode of a split with all that may be its rival.
"""

from __future__ import annotations

import functools
import itertools
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from roboirg.core.episode import SPLITS, Difficulty, Episode, Split, values_in
from roboirg.core.goal_slots import COLOR_SLOTS
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language.instruction import REFERENCE
from roboirg.language.request import GoalValue, InstructionRequest
from roboirg.language.word_sampler import sampler_for, sampler_of
from roboirg.tasks import Task, get_task
from roboirg.tasks.splits.splits import split_episodes

REFERENCE_SPLIT: Split = "train"
"""Its goals show which numbers are usual for a difficulty, and its partners how often each rival
goes with a value, for episodes outside the splits."""
_FIELDS_OF_ONE_AMOUNT = 2
"""A goal that counts cubes of one color has two fields: the color and its count."""
NUMBER_SLOTS = ("repeats", "counts", "visit", "placement")


class ValuePair(NamedTuple):
    """A value of the goal and its rival, for which the goal could ask instead: *red* and *blue*.

    Attributes:
        meant: a value of the goal; of two colors in order, the one that comes first.
        rival: the other value. It has the slot ``reference`` and no field, but of two colors in
            order it is the goal's second one.
    """

    meant: GoalValue
    rival: GoalValue

    @property
    def slot(self) -> str:
        """The goal slot of the meant value."""
        return self.meant.slot

    @property
    def is_ordered(self) -> bool:
        """Whether the goal has both values, and only their order is open."""
        return self.rival.slot == self.meant.slot


def pair_refusal(request: InstructionRequest) -> str | None:
    """Return why an episode can have no rival, a second value for which its goal could ask.

    None if it can. The text is the end of a sentence, without a stop.
    """
    if pairs_of_drawn_slot(request):
        return None
    if len(request.values_of("amount")) > _FIELDS_OF_ONE_AMOUNT:
        return "a goal that counts cubes of several colors leaves no rival"
    return "the scene has no second value that the goal could ask for"


def pairs_of_drawn_slot(request: InstructionRequest) -> list[ValuePair]:
    """Draw a slot of the goal, and return its value there with each of its rivals.

    A rival is a value that words may name next to it: *red or blue?* where red is meant. Only slots
    that can have rivals are drawn from. A color that the video gives away has none, as the choice
    would be no choice. Empty if no slot can have a rival. The draw is the same each time.
    """
    pairs_by_slot: dict[str, list[ValuePair]] = {}
    for pair in possible_pairs(request):
        is_given_away = pair.slot in COLOR_SLOTS and request.shows_color
        if not is_given_away:
            pairs_by_slot.setdefault(pair.slot, []).append(pair)
    if not pairs_by_slot:
        return []
    return pairs_by_slot[request.sampler.pick("rival slot", list(pairs_by_slot))]


def possible_pairs(request: InstructionRequest) -> Iterator[ValuePair]:
    """Yield each value of the goal with each other value that it could have instead, its rival.

    For the goal *red* in a scene with red and blue cubes: red and its rival blue. Of two colors in
    order, the rival is the other order: *first red, then blue* or *first blue, then red*. A goal
    that counts several colors has none.
    """
    if len(request.values_of("amount")) > _FIELDS_OF_ONE_AMOUNT:
        return
    for slot, _ in request.episode.goal.slots:
        meant = request.values_in(slot)
        if len(meant) == 1:
            for value in _other_values(request, meant[0]):
                yield ValuePair(meant[0], GoalValue("", REFERENCE, meant[0].slot_type, value))
        elif _has_opposite_order(request, slot):
            yield ValuePair(meant[0], meant[1])


def _other_values(request: InstructionRequest, meant: GoalValue) -> Iterator[str | int]:
    """Yield every other value that the goal's slot could hold in this scene, instead of its value.

    A number is yielded only if goals of the same difficulty ask for it; others would stand out.
    """
    usual_numbers = _usual_numbers(request.task.name, request.episode.difficulty, meant.slot)
    for values in request.alternatives(meant.slot):
        if len(values) > 1 or values == (meant.value,):
            continue  # it is no single value, or the one that is meant
        (value,) = values
        if meant.slot not in NUMBER_SLOTS or value in usual_numbers:
            yield value


def _has_opposite_order(request: InstructionRequest, slot: str) -> bool:
    """Return whether another goal of the scene has a slot's values in the opposite order.

    *First red, then blue* has if the scene also allows *first blue, then red*.
    """
    values = tuple(value.value for value in request.values_in(slot))
    swapped = values[::-1]
    return swapped != values and swapped in request.alternatives(slot)


@functools.cache
def _usual_numbers(task: str, difficulty: Difficulty, slot: str) -> frozenset[str | int]:
    """Return the numbers that goals of a difficulty have in a slot: ``{1, 2, 3}`` repeats.

    They are counted in the training split. Any other number would give itself away as the wrong
    one: only hard episodes ask for four or five.
    """
    numbers: set[str | int] = set()
    for episode in split_episodes([get_task(task).name], [REFERENCE_SPLIT]):
        if episode.difficulty == difficulty:
            numbers.update(values_in(episode.goal[slot]))
    return frozenset(numbers)


class _SlotValue(NamedTuple):
    """A value with its slot, since another slot may have the same value."""

    slot: str
    value: str | int


class _SplitEntry(NamedTuple):
    """An episode of a split that can have a rival, a second value for which its goal could ask.

    Attributes:
        episode: the episode.
        meant: the value that its goal has.
        rivals: each value that it may have instead.
        rival: the one that words name: the meant value of the episode with which this one is
            paired; None if it is not paired (yet).
    """

    episode: Episode
    meant: _SlotValue
    rivals: frozenset[_SlotValue]
    rival: str | int | None = None

    def is_of(self, episode: Episode) -> bool:
        """Return whether it is about an episode: another one may have the same index."""
        return self.episode.split == episode.split and self.episode.seed == episode.seed

    def is_partner(self, other: _SplitEntry) -> bool:
        """Return whether two episodes fit together: the value of each can be the other's rival."""
        return other.meant in self.rivals and self.meant in other.rivals


def balanced_rival(request: InstructionRequest, pairs: list[ValuePair]) -> ValuePair:
    """Return the value of the goal with the rival that words should name next to it.

    Rivals are chosen so that over a split each of two values is the meant one equally often; where
    several are as good, one is drawn.

    Args:
        request: the episode.
        pairs: all pairs of its value, as `pairs_of_drawn_slot` returns them; at least one.
    """
    by_rival = {pair.rival.value: pair for pair in pairs}
    likely = _likely_rivals(request, pairs[0].meant)
    possible = [value for value in likely if value in by_rival]
    return by_rival[request.sampler.pick("rival", possible or list(by_rival))]


def _likely_rivals(request: InstructionRequest, meant: GoalValue) -> list[str | int]:
    """Return the values that words should name next to the meant one; empty if there are none.

    Episodes of a split are paired so that the meant value of each is named, as its rival, in the
    other: that value is returned. Any other episode gets the rivals that training episodes of the
    same difficulty have with the same value, each as often as there, to be drawn from.
    """
    episode = request.episode
    split = episode.split if episode.split in SPLITS else REFERENCE_SPLIT
    entries = _paired_entries(request.task.name, split)
    entry = entries.get(episode.index)
    if entry is not None and entry.is_of(episode):
        like_episode = [entry]
    else:
        meant_value = _SlotValue(meant.slot, meant.value)
        with_same_value = [entry for entry in entries.values() if entry.meant == meant_value]
        like_episode = [
            entry for entry in with_same_value if entry.episode.difficulty == episode.difficulty
        ]
    return [entry.rival for entry in like_episode if entry.rival is not None]


@functools.cache
def _paired_entries(task: str, split: Split) -> Mapping[int, _SplitEntry]:
    """Return the episodes of a split that can have a rival, paired with each other, by index.

    A rival is a value for which the goal could ask instead of its own. That of an entry is the
    meant value of the episode with which it is paired: of red and blue, each is the rival of the
    other.
    """
    entries = {}
    for episode in split_episodes([task], [split]):
        entry = _unpaired_entry(episode, get_task(task))
        if entry is not None:
            entries[episode.index] = entry
    return {entry.episode.index: entry for entry in _with_partners(entries)}


def _unpaired_entry(episode: Episode, task: Task) -> _SplitEntry | None:
    """Return an episode with its rivals, values for which its goal could ask instead.

    None if there are none. The entry is not paired with another episode yet.
    """
    request = InstructionRequest(episode, task, InstructionOptions(), sampler_of(episode))
    pairs = pairs_of_drawn_slot(request)
    if not pairs:
        return None
    meant = _SlotValue(pairs[0].slot, pairs[0].meant.value)
    rivals = [_SlotValue(pair.slot, pair.rival.value) for pair in pairs]
    return _SplitEntry(episode, meant, frozenset(rivals))


def _with_partners(entries: Mapping[int, _SplitEntry]) -> Iterator[_SplitEntry]:
    """Pair the episodes of a split, and yield each with the value of its partner as its rival.

    If episode 3 means red and its partner, 7, means blue, 3 gets blue and 7 gets red. The most
    frequent of the values that are left is paired first, so that few episodes remain without a
    partner; these are yielded without a rival.
    """
    unmatched = dict(entries)
    while unmatched:
        frequency = Counter(entry.meant for entry in unmatched.values())
        # The most frequent value goes first; of its episodes, the one with the lowest index.
        priority_by_index = {
            index: (frequency[entry.meant], -index) for index, entry in unmatched.items()
        }
        entry = unmatched.pop(max(priority_by_index, key=priority_by_index.__getitem__))
        partners = [index for index, other in unmatched.items() if entry.is_partner(other)]
        if not partners:
            yield entry
            continue
        partner = unmatched.pop(max(partners, key=priority_by_index.__getitem__))
        yield entry._replace(rival=partner.meant.value)
        yield partner._replace(rival=entry.meant.value)


class PairOrder(NamedTuple):
    """In which order a value and its rival are said, and which one the last words point at.

    Attributes:
        is_meant_first: whether the value that is meant is said first.
        points_at_meant: whether the last words choose it, *let's take the former*; else they set
            the rival aside, *let's skip the latter*.
    """

    is_meant_first: bool
    points_at_meant: bool


_ORDERS = (
    PairOrder(is_meant_first=True, points_at_meant=True),
    PairOrder(is_meant_first=True, points_at_meant=False),
    PairOrder(is_meant_first=False, points_at_meant=True),
    PairOrder(is_meant_first=False, points_at_meant=False),
)
"""Their positions are in the log of draws."""
BLOCK = len(_ORDERS)


def draw_order(request: InstructionRequest) -> PairOrder:
    """Draw in which order two values are said, and whether the remark points at the meant one.

    Each block of four episodes has each of the four cases once: with independent draws, a split of
    fifty could favor the value named first by chance. The case is added to the log of the request.
    """
    episode = request.episode
    block, place_in_block = divmod(episode.index, BLOCK)
    # The block has its own sampler, so that its four episodes share one shuffled row of orders.
    sampler = sampler_for(f"{episode.task}|{episode.split}|{block}")
    shuffled = list(itertools.islice(sampler.cycle("rival order", _ORDERS), BLOCK))
    order = shuffled[place_in_block]
    request.sampler.log.append(f"rival order/{_ORDERS.index(order)}")
    return order
