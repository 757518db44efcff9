"""Find the words of a text that name a value of a slot. No grammar, and nothing of the scene."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from roboirg.core.goal_slots import SLOT_TYPE_NAMES
from roboirg.reader.quantities import ADVERBS
from roboirg.reader.tokens import (
    Sentence,
    color_of,
    number_of,
    ordinal_of,
    split_sentences,
    word_set,
)
from roboirg.shortcuts.goal_vocabulary import GoalVocabulary, SlotVocabulary, Value

ORDINAL_TYPES = ("visit", "placement")
"""Slot types whose values are said as ordinals too."""

POINTING = word_set("the that this those these which other each every any no")
"""Before a cardinal they make it a pronoun: *the one there*, *those two*."""
NEIGHBOR = "neighbor"
"""Stands for *before or after*, which names neither."""
PRONOUNS = word_set("them these those")
COMPARISONS = word_set("fewer less more earlier later")
"""One or two words after a number they make it a difference: *one time fewer*."""
STEPS = word_set("before after")
"""The same for ordinals: *two visits before that*."""
EXCLUSIONS = word_set(
    "other another different distinct alternative separate new not neither except unlike neighbor"
)
"""Before a word they say that its value is not the one meant."""
ALL_PARTS = (("exactly", "those"), ("of", "each"))
"""Words of a command for all things that the context introduces."""
REFERENCES = word_set("than as half twice double before after neighbor following preceding")
"""Before a number they say that the one meant is another, which follows from it."""
POINTERS = {
    "former": 0, "first": 0, "earlier": 0, "latter": 1, "second": 1, "last": 1, "later": 1,
}  # fmt: skip
"""Words that point at the first or the second of two values."""
OPPOSITES = word_set("other not no")
"""In the sentence of a pointer they say that it is about the value that is not meant."""
ONE = word_set("one ones")
"""After an ordinal: *the second one* is no number, and no element of a series."""
SAYING = word_set("mentioned named")
"""Next to *first*, *last*, *earlier* and *later* they say that these are no ordinals or places."""

_SAME = (
    ("before or after", NEIGHBOR),
    ("the one i mentioned earlier", "it"),
    ("the one i mentioned", "it"),
    ("the other number", "the number left"),
)
"""Words whose parts would mislead a rule, each with words that say the same."""
_AFTER_RANK = ONE | {"of"}
_REACH = 5
"""Words before a value that may exclude it: *not the one right before*."""
_NUMBER_REACH = 3


class NamedValue(NamedTuple):
    """A value that a text names.

    Attributes:
        value: the value; a number need not be in the slot's vocabulary.
        stated: whether the last sentence states it plainly, so that nothing is left to a rule.
    """

    value: Value
    stated: bool


def named_values(text: str, slot: str, vocabulary: SlotVocabulary) -> tuple[NamedValue, ...]:
    """Return every mention of a slot's values in an instruction, in order.

    Its last sentence is taken for the command.
    """
    sentences = _sentences(text)
    return tuple(
        NamedValue(value, number == len(sentences) and _is_plain(words, place, value))
        for number, words in enumerate(sentences, start=1)
        for place, value in _values(words, slot, vocabulary)
    )


def marked_text(text: str, slot: str, vocabulary: SlotVocabulary) -> str:
    """Return a text in which the rank of mention stands for each named value of a slot.

    *Red and blue; not the blue one* becomes *rank0 and rank1; not the rank1 one*.
    """
    found: list[str] = []
    ranks: dict[Value, int] = {}
    for sentence in _sentences(text):
        words = list(sentence)
        for place, value in _values(sentence, slot, vocabulary):
            words[place] = f"rank{ranks.setdefault(value, len(ranks))}"
        found += words
    return " ".join(found)


# Cached: every slot and every rule reads the same text.
@functools.lru_cache(maxsize=1024)
def _sentences(text: str) -> tuple[Sentence, ...]:
    text = text.lower()
    for words, same in _SAME:
        text = text.replace(words, same)
    return split_sentences(text)


def command_words(text: str) -> Sentence:
    """Return the words of the last sentence."""
    sentences = _sentences(text)
    return sentences[-1] if sentences else ()


def pointed_value(text: str) -> int | None:
    """Return which of two values the words before the command point at, 0 or 1; None if neither.

    The last pointer decides; under *other*, *not* or *no* it is the opposite. That is no grammar:
    *not the former but the latter* has a *not*, too.
    """
    for words in reversed(_sentences(text)[:-1]):
        pointed = [POINTERS[word] for word in words if word in POINTERS]
        is_rank = not {"former", "latter"}.isdisjoint(words) or any(
            before in ("first", "second") and word in ONE
            for before, word in itertools.pairwise(words)
        )
        if pointed and (is_rank or not SAYING.isdisjoint(words)):
            return pointed[-1] if OPPOSITES.isdisjoint(words) else 1 - pointed[-1]
    return None


def part_count(text: str, thing: str, vocabulary: GoalVocabulary) -> int:
    """Return how many things a command seems to ask for, by its ranks, values and nouns.

    `thing` is the noun for what the task handles.
    """
    words = command_words(text)
    stated = [
        sum(one.stated for one in named_values(text, slot, one_slot))
        for slot, one_slot in vocabulary.items()
        if one_slot.several
    ]
    if any(pair in ALL_PARTS for pair in itertools.pairwise(words)):
        stated.append(_introduced(text, vocabulary))
    ranks = len(command_ranks(text))
    longest = max((one.longest for one in vocabulary.values()), default=1)
    nouns = sum(word in (thing, f"{thing}s", f"{thing}es") for word in words)
    return max(1, min(longest, max((*stated, ranks, nouns))))


def _introduced(text: str, vocabulary: GoalVocabulary) -> int:
    """Return how many values the first sentence names that names some of a slot with several."""
    several = {slot: one for slot, one in vocabulary.items() if one.several}
    for words in _sentences(text):
        found = [len(list(_values(words, slot, one))) for slot, one in several.items()]
        if any(found):
            return max(found)
    return 1


def command_ranks(text: str) -> tuple[int, ...]:
    """Return the places of introduced things that the command takes: 0 for *the former*."""
    words = command_words(text)
    found: list[int] = []
    for before, word, after in zip(("", *words), words, (*words[1:], ""), strict=False):
        rank = ordinal_of(word)
        if word in ("former", "latter"):
            found.append(POINTERS[word])
        elif rank is not None and before == "the" and after in ("of", "color", "place", "one"):
            found.append(rank - 1)
    return tuple(found)


def _values(words: Sentence, slot: str, vocabulary: SlotVocabulary) -> Iterator[tuple[int, Value]]:
    """Yield position and value of every word that names one."""
    if not all(isinstance(value, int) for value in vocabulary.values):
        for place, word in enumerate(words):
            value = color_of(word) or word
            # "Before or after" names neither.
            if value in vocabulary.values and "or" not in words[max(0, place - 1) : place + 2]:
                yield place, value
        return
    ordinals = SLOT_TYPE_NAMES.get(slot) in ORDINAL_TYPES
    for place, word in enumerate(words):
        number = _number(words, place, ordinals=ordinals, counts=slot == "counts")
        if number is not None:
            yield place, number
        elif (
            ordinals
            and ordinal_of(word) is not None
            and _AFTER_RANK.isdisjoint(words[place + 1 : place + 2])
        ):
            yield place, int(ordinal_of(word) or 0)


def _number(words: Sentence, place: int, *, ordinals: bool, counts: bool) -> int | None:
    """Return the number that a cardinal or adverb names, if it counts things.

    Where cubes are counted, *one of them* is one cube; elsewhere it points at a thing.
    """
    word, following = words[place], words[place + 1 : place + 3]
    if word in ADVERBS:
        multiplies = bool(following) and (
            following[0] in ("as", "that", "the") or number_of(following[0]) is not None
        )
        return None if multiplies else ADVERBS[word]
    differences = COMPARISONS | STEPS if ordinals else COMPARISONS
    before = words[place - 1] if place else ""
    is_pronoun = (
        (before in POINTING and following[:1] != ("times",))  # "we tried this three times"
        or ordinal_of(before) is not None
        or (not counts and following[:1] == ("of",) and not PRONOUNS.isdisjoint(following))
    )
    if is_pronoun or not differences.isdisjoint(following):
        return None
    return number_of(word)


def _is_plain(words: Sequence[str], place: int, value: Value) -> bool:
    """Return whether a command says a value without excluding it or counting from it."""
    if isinstance(value, str):
        return EXCLUSIONS.isdisjoint(words[max(0, place - _REACH) : place])
    counted_from = "each" in words[:place]  # "half as many of each as two red and four blue"
    return not counted_from and REFERENCES.isdisjoint(words[max(0, place - _NUMBER_REACH) : place])
