"""Surface rules: pick the values of a goal by the words of an instruction, without understanding.

A rule sees the text and the vocabulary of the task: no scene, no goal, no metadata. Every rule
takes what the command states plainly, and decides about the slots that the command leaves open.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

from roboirg.core.goal_slots import SLOT_TYPE_NAMES
from roboirg.reader.tokens import Sentence, number_of
from roboirg.shortcuts.goal_vocabulary import SlotVocabulary, Value
from roboirg.shortcuts.named_values import EXCLUSIONS, NEIGHBOR, ORDINAL_TYPES

Candidates = tuple[Value, ...]
"""Values for one place of a slot, among which a rule chooses with equal probability."""

MORE = frozenset({"more", "later", "after", "following"})
FEWER = frozenset({"fewer", "less", "earlier", "before", "preceding"})
ONLY_ORDINAL = frozenset({"before", "after", "following", "preceding"})
"""Next to other numbers these words are about time."""
REST = frozenset({"other", "others", "left", "remaining"})
"""Words for what remains when one of two is taken."""
PAIR = 2
_REACH = 2
"""Words between a difference and its number: *two visits before*."""


class SlotWords(NamedTuple):
    """What a rule sees of one slot that the command leaves open.

    Attributes:
        slot: its name.
        vocabulary: the values that it may take.
        named: the values that the text names, in order.
        command: the words of the last sentence.
        parts: the number of values to find.
        pointed: which of two named values the words before the command point at.
        ranks: the places of named values at which the command points.
    """

    slot: str
    vocabulary: SlotVocabulary
    named: tuple[Value, ...]
    command: Sentence
    parts: int
    pointed: int | None = None
    ranks: tuple[int, ...] = ()

    @property
    def is_number(self) -> bool:
        """Whether the slot holds counts or ordinals."""
        return isinstance(self.vocabulary.values[0], int)

    @property
    def is_ordinal(self) -> bool:
        """Whether the slot holds an ordinal."""
        return SLOT_TYPE_NAMES.get(self.slot) in ORDINAL_TYPES


SurfaceRule = Callable[[SlotWords], list[Candidates]]
"""Returns candidates for the places of a slot, the first ones first.

Where they are none, or missing, every value of the vocabulary is as likely.
"""


def take_first(words: SlotWords) -> list[Candidates]:
    """Take the values that are named first."""
    return [(value,) for value in words.named[: words.parts]]


def take_last(words: SlotWords) -> list[Candidates]:
    """Take the values that are named last."""
    return [(value,) for value in words.named[-words.parts :]]


def take_unnamed(words: SlotWords) -> list[Candidates]:
    """Take a value that is not named; each is as likely."""
    unnamed = tuple(value for value in words.vocabulary.values if value not in words.named)
    return [unnamed] * max(1, min(words.parts, len(unnamed)))


def take_by_cues(words: SlotWords) -> list[Candidates]:
    """Choose among four rules by key words of the command and of what points at one of two values.

    *The former*, *the third one* in the command: the values at those places. *Other* or *left*
    after a value that is named again: of the values, the first one that is not that. After a
    pointer, such as *former* or *latter*, the value at its place, and then the other one.
    *Other*, *different*, *not* or *neighbor*: the value that is not named, then the one that is
    named but not last. *One fewer*, *twice*, *right after* and the like: the number that is named
    first, changed by the difference. Otherwise the first value.
    """
    pair = tuple(dict.fromkeys(words.named))
    pointed = _pointed_values(words, pair)
    if pointed:
        return pointed[: words.parts]
    if words.is_number:
        change = _change(words)
        first = [one for (one,) in take_first(words)]
        return [change(int(one)) for one in first] if change else take_first(words)
    if EXCLUSIONS.isdisjoint(words.command):
        return take_first(words)
    unnamed = take_unnamed(words)[:1] if set(words.vocabulary.values) - set(words.named) else []
    complement = tuple(value for value in dict.fromkeys(words.named) if value != words.named[-1])
    return [*unnamed, complement]


def _pointed_values(words: SlotWords, named: tuple[Value, ...]) -> list[Candidates]:
    """Return the named values at which the words point; none if they point at none."""
    if words.ranks and not words.is_number and max(words.ranks) < len(named):
        return [(named[rank],) for rank in words.ranks]
    if words.parts == 1 and len(named) < len(words.named) and not REST.isdisjoint(words.command):
        rest = [value for value in named if value != words.named[-1]]
        return [(rest[0],)] if rest else []
    if words.pointed is not None and len(named) == PAIR:
        return [(named[words.pointed],), (named[1 - words.pointed],)]
    return []


def _change(words: SlotWords) -> Callable[[int], Candidates] | None:
    """Return how the command changes a number that was named; None if it does not."""
    command = words.command
    if "half" in command:
        return lambda number: (number // 2,)
    if "twice" in command or "double" in command:
        return lambda number: (2 * number,)
    if words.is_ordinal and NEIGHBOR in command:
        near = words.vocabulary.values
        return lambda number: tuple(one for one in (number - 1, number + 1) if one in near)
    difference = next(_differences(words), None)
    return None if difference is None else lambda number: (number + difference,)


def _differences(words: SlotWords) -> Iterator[int]:
    """Yield the differences that a command names: -1 for *one time fewer* or *right before*."""
    for place, word in enumerate(words.command):
        sign = (word in MORE) - (word in FEWER)
        if not sign or (word in ONLY_ORDINAL and not words.is_ordinal):
            continue
        nearby = words.command[max(0, place - _REACH) : place]
        numbers = [number_of(one) for one in nearby if number_of(one) is not None]
        yield sign * (numbers[-1] or 1) if numbers else sign


SURFACE_RULES: Mapping[str, SurfaceRule] = {
    "first-mention": take_first,
    "last-mention": take_last,
    "elimination": take_unnamed,
    "surface": take_by_cues,
}
"""By name, also that of the policy with the rule."""
