"""Surface rules: pick the values of a goal by the words of an instruction, without understanding.

A rule sees the text and the vocabulary of the task: no scene, no goal, no metadata. It decides
about the slots of the goal that the command (the last sentence) leaves open; `text_guess` reads the
others from the command.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from roboirg.reader.tokens import Sentence, number_of
from roboirg.shortcuts.goal_vocabulary import SlotVocabulary, Value
from roboirg.shortcuts.named_values import EXCLUSIONS, is_ordinal_slot

Candidates = tuple[Value, ...]
"""Equally likely values for one position of a slot. ``("red",)`` is certain."""

MORE = frozenset({"more", "later", "after", "following"})
"""Words that say that a number is larger than one named before: *one time more*."""
FEWER = frozenset({"fewer", "less", "earlier", "before", "preceding"})
"""Words that say that it is smaller."""
ONLY_ORDINAL = frozenset({"before", "after", "following", "preceding"})
"""Of these, the ones that do so in slots for ordinals only; elsewhere they are about time."""
REST = frozenset({"other", "others", "left", "remaining"})
"""Words for what remains when one of two is taken."""
PAIR = 2
_NUMBER_REACH = 2
"""How many words before it are searched for the size of a difference: *two visits before*."""


@dataclass(frozen=True)
class SlotWords:
    """What a rule sees of one goal slot that the command leaves open.

    For *Red and blue. I mean the latter. Take it.*, the slot ``color`` has the named values red and
    blue, and the pointed index 1.

    Attributes:
        slot: its name.
        vocabulary: the values that it may take.
        named: the values that the text names, in order, with repetitions.
        command: the words of the last sentence.
        value_count: the number of values to find.
        pointed_index: at which of two named values the words before the command point, 0 or 1;
            None if at neither.
        ranks: indices of named values at which the command itself points: 0 for *the former*.
    """

    slot: str
    vocabulary: SlotVocabulary
    named: tuple[Value, ...]
    command: Sentence
    value_count: int
    pointed_index: int | None = None
    ranks: tuple[int, ...] = ()

    @property
    def unique_values(self) -> tuple[Value, ...]:
        """The named values, each once."""
        return tuple(dict.fromkeys(self.named))

    @property
    def all_but_last(self) -> tuple[Value, ...]:
        """The named values, each once, without the one that is named last."""
        return tuple(value for value in self.unique_values if value != self.named[-1])

    @property
    def is_number(self) -> bool:
        """Whether the slot holds counts or ordinals."""
        return isinstance(self.vocabulary.values[0], int)

    @property
    def is_ordinal(self) -> bool:
        """Whether the slot holds an ordinal, such as the number of a visit."""
        return is_ordinal_slot(self.slot)


def certain(values: Iterable[Value]) -> list[Candidates]:
    """Return candidates of certain values, one for each position: red, blue -> (red,), (blue,)."""
    return [(value,) for value in values]


SurfaceRule = Callable[[SlotWords], list[Candidates]]
"""Returns candidates for each position of a slot, in order; a slot with one value has one position.

Where they are empty, or fewer than there are positions, every value of the vocabulary is as likely.
"""


def take_first(words: SlotWords) -> list[Candidates]:
    """Take the values that are named first: *Red, blue and green.* -> red."""
    return certain(words.named[: words.value_count])


def take_last(words: SlotWords) -> list[Candidates]:
    """Take the values that are named last: *Red, blue and green.* -> green."""
    return certain(words.named[-words.value_count :])


def take_unnamed(words: SlotWords) -> list[Candidates]:
    """Take a value that is not named; each is as likely: *Not red.* -> blue or green."""
    unnamed = tuple(value for value in words.vocabulary.values if value not in words.named)
    return [unnamed] * max(1, min(words.value_count, len(unnamed)))


def take_by_cues(words: SlotWords) -> list[Candidates]:
    """Return the values that key words of the text suggest.

    Of this table, the first row that fits decides:

    | the words | the values |
    | --- | --- |
    | *the former*, *the third one* in the command | at those places |
    | *other*, *left* after a value that is named again | the first one that is another |
    | *former*, *latter* before the command | at that place, then the other one of two |
    | *one fewer*, *twice*, *right after* | the number that is named first, so changed |
    | a number without such words | the first one |
    | *other*, *different*, *not* | one that is not named, then one named but not last |
    | otherwise | the first one |
    """
    # Rows 1 to 3 are `_pointed_values`, 4 and 5 `_changed_number`.
    pointed = _pointed_values(words)
    if pointed:
        return pointed[: words.value_count]
    if words.is_number:
        return _changed_number(words)
    if EXCLUSIONS.isdisjoint(words.command):
        return take_first(words)

    if set(words.vocabulary.values) <= set(words.named):
        return [words.all_but_last]
    return [*take_unnamed(words)[:1], words.all_but_last]


def _pointed_values(words: SlotWords) -> list[Candidates]:
    """Return the named values at which words such as *latter* point; none without such words.

    For a text that begins with *Red and blue*:

    - *Take the latter.* -> blue
    - *Red is gone. Take the one that is left.* -> blue
    - *I mean the latter. Take both.* -> blue, then red
    """
    values = words.unique_values
    if words.ranks and not words.is_number and max(words.ranks) < len(values):
        return certain(values[rank] for rank in words.ranks)

    is_one_named_again = words.value_count == 1 and len(values) < len(words.named)
    if is_one_named_again and not REST.isdisjoint(words.command):
        return certain(words.all_but_last[:1])

    if words.pointed_index is not None and len(values) == PAIR:
        other = 1 - words.pointed_index
        return certain((values[words.pointed_index], values[other]))
    return []


def _changed_number(words: SlotWords) -> list[Candidates]:
    """Return the numbers that are named first, changed as the command says.

    *Bob pressed it three times. Press it twice as often.* -> 6. A command that changes nothing
    leaves them as they are.
    """
    named = words.named[: words.value_count]
    return certain(_changed(int(value), words) for value in named)


def _changed(number: int, words: SlotWords) -> int:
    """Return the number that a command asks for, given the one that was named before.

    *Twice as often* doubles it, *half as often* halves it, and *two times fewer* subtracts 2.
    """
    if "half" in words.command:
        return number // 2
    if "twice" in words.command or "double" in words.command:
        return 2 * number
    return number + _difference(words)


def _difference(words: SlotWords) -> int:
    """Return by how much a command changes a number; 0 if it names no difference.

    *Two times more* -> 2, *one time fewer* -> -1, *the visit right before* -> -1. The first word of
    `MORE` or `FEWER` decides.
    """
    for index, word in enumerate(words.command):
        if word not in MORE | FEWER:
            continue
        if word in ONLY_ORDINAL and not words.is_ordinal:
            continue
        words_before = words.command[max(0, index - _NUMBER_REACH) : index]
        numbers = [number for number in map(number_of, words_before) if number is not None]
        size = numbers[-1] if numbers else 1  # "the visit before" is one before
        size = max(size, 1)  # "zero times fewer" is once fewer
        return size if word in MORE else -size
    return 0


SURFACE_RULES: Mapping[str, SurfaceRule] = {
    "first-mention": take_first,
    "last-mention": take_last,
    "elimination": take_unnamed,
    "surface": take_by_cues,
}
"""The rules by name. A built-in policy of the same name plays by the rule."""
